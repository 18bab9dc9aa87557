"""Fit a hypothesis to measured FRFs: Levenberg–Marquardt on the noise-weighted residual, begun from several places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..indices import Index, Mask
from .explanations.hypothesis import Hypothesis
from .explanations.quick import quick
from .forward import Answer, Forward
from .noise.drift import Drift

_STEP = 1e-5
_BLUNT = 0.2
"""Relative error that a comparison of logarithms allows beside the noise: it sees peaks that are apart."""
_LOST = 3.0
_ROUNDS = 25
_SETTLED = 1e-3
_CREEP = 0.1
_SHARES = (1.0, 0.3, 0.1)
"""Lengths of a step that are tried."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A hypothesis at its best."""

    hypothesis: Hypothesis
    u: Array
    answer: Answer
    residual: ComplexArray
    """(measured − model)/deviation at the points, white and of unit variance where nothing is missing."""
    slopes: ComplexArray
    """Of the residual by u, (points, coordinates)."""
    penalty: float
    """What the prior adds to the loss."""

    @property
    def loss(self) -> float:
        """Σ abs(residual)²."""
        return float(np.sum(np.abs(self.residual) ** 2))

    @property
    def information(self) -> Array:
        """Half the inverse covariance of u by the records and the prior, for noise of unit variance."""
        J = self.slopes
        return np.asarray((J.conj().T @ J).real + np.diag(prior_weight(self.hypothesis)))

    def covariance(self, inflate: float = 1.0) -> Array:
        """Of u; with ``inflate`` the mean square of what noise is taken to be."""
        return np.asarray(np.linalg.pinv(self.information) / 2 * max(inflate, 1.0))


def prior_weight(hypothesis: Hypothesis) -> Array:
    """1/(2σ²) of every coordinate: the loss counts abs(residual)² of complex values, half of −2 ln likelihood."""
    return np.array([0.5 / c.prior**2 for c in hypothesis.coordinates])


@dataclass(frozen=True, eq=False)
class Fitting:
    """Records, their deviation per point, and the machine's answer."""

    forward: Forward
    sigma: Array
    correction: ComplexArray
    """m/N: what further harmonics add to the answer of describing functions, as the machine came in."""
    taken: Array | None = None
    """Drift of every record that is taken out of its frequencies, relative; None is none."""
    near: dict[str, ComplexArray] = field(default_factory=dict)
    """Motions of all joints that the records imply if all but one place is right, by that place."""

    @cached_property
    def drift(self) -> Drift:
        """From record to record."""
        p = self.forward.points
        test = p.drive * len(self.forward.responses) + p.response
        taken = np.zeros(p.record.max() + 1) if self.taken is None else self.taken
        return Drift.of(p.frequency, p.measured, p.record, test, self.sigma, taken)

    @cached_property
    def quick_joints(self) -> tuple[Joint, ...]:
        """Joints of the machine as it is."""
        held: dict[int, Joint] = {}
        return tuple(held.setdefault(id(joint), quick(joint)) for joint in self.forward.machine.joints())

    def moving(self, hypothesis: Hypothesis) -> tuple[int, ...]:
        """Joints that are solved for."""
        return tuple(sorted({*self.forward.nonlinear, *hypothesis.place.rows}))

    def answer(self, hypothesis: Hypothesis, u: Array, start: ComplexArray | None = None) -> Answer:
        """The machine at u, on the branch that ``start`` lies on.

        Without one, on that near the motions which the records imply, and where that leads nowhere on that of the
        linear response.
        """
        moving = self.moving(hypothesis)
        near = self.near.get(hypothesis.place.name)
        if start is None and near is not None:
            start = near[:, list(moving)]
        return self.forward.answer(hypothesis.joints(u), moving, start)

    def residual(self, answer: Answer) -> ComplexArray:
        """(measured − model)/deviation, white; where no solution was found the model counts as zero."""
        H = np.where(answer.fine, answer.receptance + self.correction, 0.0)
        return self.drift.residual((self.forward.points.measured - H) / self.sigma)

    def _blunt(self, answer: Answer) -> tuple[ComplexArray, ComplexArray]:
        """ln(measured/model) over its deviation, and its factor on slopes of the model."""
        measured = self.forward.points.measured
        size = np.abs(measured)
        H = answer.receptance + self.correction
        H = np.where(answer.fine & (H != 0), H, measured * np.exp(_LOST))
        weight = 1 / np.sqrt((self.sigma / size) ** 2 + _BLUNT**2)
        return np.asarray(np.log(measured / H) * weight), np.asarray(np.where(answer.fine, -weight / H, 0.0 + 0.0j))

    def _slopes(self, hypothesis: Hypothesis, u: Array, answer: Answer) -> ComplexArray:
        """Change of the receptance by u."""
        if not np.any(answer.fine):
            return np.zeros((len(answer.receptance), len(u)), dtype=complex)
        moved = []
        for i in range(len(u)):
            there = u.copy()
            there[i] += _STEP
            moved.append(hypothesis.joints(there))
        moving = self.moving(hypothesis)
        return self.forward.slopes(hypothesis.joints(u), moving, answer.z, moved) / _STEP

    def _white_slopes(self, residual: ComplexArray, answer: Answer, change: ComplexArray) -> ComplexArray:
        """Of the residual, as the receptance changes so."""
        error = np.where(answer.fine[:, None], -change / self.sigma[:, None], 0.0)
        return self.drift.slopes(residual, error)

    def cost(self, hypothesis: Hypothesis, u: Array, answer: Answer, blunt: bool) -> float:
        """What is minimised: squares of residuals, and the prior."""
        r = self._blunt(answer)[0] if blunt else self.residual(answer)
        return float(np.sum(np.abs(r) ** 2)) + penalty(hypothesis, u)

    def begin(self, hypothesis: Hypothesis, starts: Sequence[Array], keep: int) -> list[tuple[Array, Answer]]:
        """The best of several starts, by logarithms."""
        found = []
        for k, u in enumerate(starts):
            answer = self.answer(hypothesis, u)
            found.append((self.cost(hypothesis, u, answer, True), k, u, answer))
        found.sort(key=lambda row: row[:2])
        return [(u, answer) for _, _, u, answer in found[:keep]]

    def fit(
        self,
        hypothesis: Hypothesis,
        starts: Sequence[Array],
        keep: int = 1,
        blunt: bool = True,
        hopeless: float = np.inf,
        rounds: int = _ROUNDS,
    ) -> Fitted:
        """The best fit from several starts; first by logarithms where ``blunt``, then by the residual itself.

        A fit that creeps along above the loss ``hopeless`` is given up.
        """
        best: Fitted | None = None
        for u, answer in self.begin(hypothesis, starts, keep):
            if blunt:
                u, answer = self._descend(hypothesis, u, answer, True, 8, np.inf)
            u, answer = self._descend(hypothesis, u, answer, False, rounds, hopeless)
            found = self.finished(hypothesis, u, answer)
            if best is None or found.loss + found.penalty < best.loss + best.penalty:
                best = found
        assert best is not None
        return best

    def descend(self, hypothesis: Hypothesis, u: Array, answer: Answer, hopeless: float) -> Fitted:
        """The fit that one start leads to."""
        return self.finished(hypothesis, *self._descend(hypothesis, u, answer, False, _ROUNDS, hopeless))

    def finished(self, hypothesis: Hypothesis, u: Array, answer: Answer) -> Fitted:
        """What was reached, with its slopes."""
        residual = self.residual(answer)
        slopes = self._white_slopes(residual, answer, self._slopes(hypothesis, u, answer))
        return Fitted(hypothesis, u, answer, residual, slopes, penalty(hypothesis, u))

    def _descend(
        self, hypothesis: Hypothesis, u: Array, answer: Answer, blunt: bool, rounds: int, hopeless: float
    ) -> tuple[Array, Answer]:
        weight = prior_weight(hypothesis)
        cost, damping = self.cost(hypothesis, u, answer, blunt), 1e-2
        if not len(u):
            return u, answer
        for _ in range(rounds):
            change = self._slopes(hypothesis, u, answer)
            if blunt:
                r, factor = self._blunt(answer)
                J = change * factor[:, None]
            else:
                r = self.residual(answer)
                J = self._white_slopes(r, answer, change)
            A = (J.conj().T @ J).real + np.diag(weight)
            g = (J.conj().T @ r).real + weight * (u - hypothesis.centre)
            better = False
            while damping < 1e8:
                try:
                    step = -np.linalg.solve(A + damping * np.diag(np.diag(A)), g)
                except np.linalg.LinAlgError:
                    damping *= 10
                    continue
                there = hypothesis.bounded(u + np.clip(step, -1.0, 1.0))
                new = self.answer(hypothesis, there, answer.z)
                reached = self.cost(hypothesis, there, new, blunt)
                if reached < cost:
                    better = True
                    break
                damping *= 6
            if not better:
                break
            gained = cost - reached
            u, answer, cost, damping = there, new, reached, max(damping / 8, 1e-7)
            creeping = gained < _CREEP * cost and cost > hopeless
            if creeping or gained < _SETTLED * max(1.0, 1e-2 * cost):
                break
        return u, answer


def penalty(hypothesis: Hypothesis, u: Array) -> float:
    """What the prior adds."""
    return float(np.sum(prior_weight(hypothesis) * (u - hypothesis.centre) ** 2))


@dataclass(frozen=True, eq=False)
class Fold:
    """Points left out together."""

    name: str
    rows: Index
    fitting: Fitting

    @classmethod
    def of(cls, name: str, fitting: Fitting, out: Mask) -> Fold:
        return cls(name, np.flatnonzero(out), fitting)

    def residual(self, fitted: Fitted) -> ComplexArray:
        """Residual on the fold with the parameters that all other points give.

        They are a Gauss–Newton step from those of all points, shortened where the others do not fit better for it.
        """
        hypothesis, u = fitted.hypothesis, fitted.u
        inside = np.ones(len(fitted.residual), dtype=bool)
        inside[self.rows] = False
        weight = prior_weight(hypothesis)
        J, r = fitted.slopes[inside], fitted.residual[inside]
        A = (J.conj().T @ J).real + np.diag(weight)
        g = (J.conj().T @ r).real + weight * (u - hypothesis.centre)
        step = np.clip(np.linalg.pinv(A) @ g, -1.0, 1.0) if len(u) else u
        known = float(np.sum(np.abs(r) ** 2)) + fitted.penalty
        for share in _SHARES:
            there = hypothesis.bounded(u - share * step)
            found = self.fitting.residual(self.fitting.answer(hypothesis, there, fitted.answer.z))
            if float(np.sum(np.abs(found[inside]) ** 2)) + penalty(hypothesis, there) <= known:
                return found[self.rows]
        return fitted.residual[self.rows]
