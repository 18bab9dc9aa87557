"""Which place, which change: refits everywhere, effects where they can matter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..model.machine import Machine
from .explanations.families import COULOMB, CUBIC, DAMPING, EFFECTS, STIFFNESS, Family, Motion
from .explanations.hypothesis import Coordinate, Hypothesis, of_rotation, refit
from .explanations.places import Place
from .fit import Fitted, Fitting
from .forward import Answer
from .implied import Implied, shapes_of
from .judge import excess

_FACTORS = np.log([0.5, 0.7, 0.85, 0.94, 1.0, 1.06, 1.18, 1.4, 2.0])
_TURNED = np.log([0.4, 1.0, 2.5])
"""Factors of a stiffness against rotation."""
_HOPELESS = 4.0
_FEW = 3
"""Effects that every place gets a fit of; the others only where these come near the best of all."""
_QUICK = 8
_SPEAKS = 10.0
"""Loss by which records must contradict the covariance of a joint."""
_JUDGED = 12
"""Effects that are held out, the best by their loss; refits always are."""
_CHANGES = (-0.3, -0.1, -0.03, 0.03, 0.1, 0.35)
"""Share of the stiffness to begin at."""
_NEAR = 4.0


def _of_rotation(hypothesis: Hypothesis) -> Coordinate | None:
    """The coordinate of a stiffness against rotation beside deflections."""
    return next((c for c, _ in hypothesis.own if c.name == of_rotation("linear.stiffness")), None)


@dataclass(frozen=True, eq=False)
class Begun:
    """Where a fit begins, and its cost there."""

    hypothesis: Hypothesis
    u: Array
    answer: Answer
    cost: float


@dataclass(frozen=True, eq=False)
class Search:
    """A machine, its places, and the baseline's residual."""

    machine: Machine
    places: tuple[Place, ...]
    fitting: Fitting
    base: Answer
    """With every joint's motion, in the order of the machine."""
    residual: ComplexArray

    @property
    def before(self) -> float:
        """Loss of the machine as it is."""
        return float(np.sum(np.abs(self.residual) ** 2))

    def motion(self, place: Place) -> Motion:
        """How a place moves where the residual is."""
        A = np.abs(self.base.z[:, place.rows[int(np.argmax(place.share))]])
        omega = 2 * np.pi * self.fitting.forward.points.frequency
        weight = np.minimum(np.abs(self.residual) ** 2, 25.0) * A**2
        weight = weight / max(float(np.sum(weight)), 1e-300)
        typical = float(np.sum(weight * A)) or 1e-9
        return Motion(max(float(np.max(A)), 1e-12), typical, float(np.sum(weight * omega)) or 1.0, place.stiffness)

    def implied(self, place: Place) -> Implied | None:
        """What the records say the joint does; None for a bundle, whose rows one response cannot tell apart."""
        if len(place.rows) > 1 or self.machine.static is not None:
            return None
        return Implied.of(self.fitting, place.rows[0], self.base.z)

    def refit(self, place: Place, implied: Implied | None) -> Fitted:
        """The joint's own parameters, begun at several stiffnesses and at what the records imply."""
        hypothesis = refit(self.machine, place)
        starts = self._by_stiffness(hypothesis)
        if implied is not None:
            starts += [u for _, u in implied.tried(hypothesis, 0, [()])]
        free = self.fitting.fit(hypothesis, starts)
        if all(self.machine.joints()[row].covariance is None for row in place.rows):
            return free
        # What the joint was identified with holds as long as the records do not speak against it.
        within = refit(self.machine, place, within=True)
        held = self.fitting.fit(within, [np.zeros(len(free.u)), free.u], blunt=False)
        return held if held.loss + held.penalty < free.loss + free.penalty + _SPEAKS else free

    def _by_stiffness(self, hypothesis: Hypothesis) -> list[Array]:
        """Starts in which one coordinate gives the place a range of stiffnesses."""
        n = len(hypothesis.coordinates)
        if not n:
            return [np.zeros(0)]
        row = hypothesis.place.rows[int(np.argmax(hypothesis.place.share))]
        omega = float(np.median(2 * np.pi * self.fitting.forward.points.frequency))
        A = max(float(np.median(np.abs(self.base.z[:, row]))), 1e-12)

        def stiffness(u: Array) -> float:
            return float(np.real(hypothesis.joints(u)[row].first_harmonic(A, omega).gain))

        at = stiffness(np.zeros(n))
        slope = np.array([(stiffness(1e-4 * e) - at) / 1e-4 for e in np.eye(n)]) / (abs(at) or 1.0)
        i = int(np.argmax(np.abs(slope)))
        if abs(slope[i]) < 1e-3:
            return [np.zeros(n)]
        turned = hypothesis.coordinates.index(found) if (found := _of_rotation(hypothesis)) else None
        further = (0.0,) if turned is None else _TURNED
        first = [np.eye(n)[i] * f / slope[i] for f in _FACTORS]
        return [u + (0.0 if turned is None else np.eye(n)[turned] * f) for u in first for f in further]

    def alone(self, place: Place, family: Family, starts: Sequence[float]) -> Fitted:
        """One law added, the joint's own parameters held; ``starts`` are of its size."""
        hypothesis = family.at(self.machine, place, self.motion(place), alone=True)
        rest = [0.0] * (len(hypothesis.coordinates) - 1)
        return self.fitting.fit(hypothesis, [np.array([s, *rest]) for s in starts], blunt=False, rounds=_QUICK)

    def begun(self, place: Place, family: Family, own: Fitted, implied: Implied | None) -> Begun:
        """Where to begin with a law added and the joint refitted: what the records imply, else a grid."""
        motion = self.motion(place)
        hypothesis = family.at(self.machine, place, motion)
        found = [] if implied is None else implied.tried(hypothesis, family.linear, shapes_of(family, motion))
        n = len(own.u)
        starts = [v for _, u in found[:1] for v in (u, np.concatenate([np.zeros(n), u[n:]]))]
        if implied is None:
            starts = [np.concatenate([o, s]) for o in (np.zeros(n), own.u) for s in hypothesis.starts]
        elif not starts:
            # No size of the right sign: from a little of it beside the refit, should that be wrong.
            starts = [np.concatenate([own.u, hypothesis.starts[0]])]
        u, answer = self.fitting.begin(hypothesis, starts, 1)[0]
        return Begun(hypothesis, u, answer, self.fitting.cost(hypothesis, u, answer, True))

    def pointing(self, place: Place) -> dict[str, Fitted]:
        """What a change of one kind alone would do."""
        return {
            "stiffness": self.alone(place, STIFFNESS, _CHANGES),
            "damping": self.alone(place, DAMPING, (0.0,)),
            "amplitude": min(
                (self.alone(place, CUBIC, (-0.05, 0.05)), self.alone(place, COULOMB, (-5.0, -2.5))),
                key=lambda f: f.loss,
            ),
        }

    def run(self) -> tuple[list[Fitted], dict[str, dict[str, Fitted]]]:
        """Everything that competes, and what each place's changes of one kind do.

        Effects are tried where a joint of any amplitude dependence could come near the best explanation, and not
        where the refit leaves nothing but noise.
        """
        implied = {p.name: self.implied(p) for p in self.places}
        self.fitting.near.update({name: told.motion for name, told in implied.items() if told is not None})
        refits = {p.name: self.refit(p, implied[p.name]) for p in self.places}
        pointing = {} if self.at_floor(self.before) else {p.name: self.pointing(p) for p in self.places}
        out = list(refits.values())
        best = min(f.loss for f in out)
        open_ = (
            []
            if self.at_floor(best)
            else [self.begun(p, family, refits[p.name], implied[p.name]) for p in self.places for family in EFFECTS]
        )
        open_.sort(key=lambda b: b.cost)
        reach = {p.name: refits[p.name].loss for p in self.places}
        tried: dict[str, int] = {p.name: 0 for p in self.places}
        for begun in open_:
            name = begun.hypothesis.place.name
            if tried[name] >= _FEW and not self.near(reach[name], best):
                continue
            tried[name] += 1
            found = self.fitting.descend(begun.hypothesis, begun.u, begun.answer, _HOPELESS * best)
            out.append(found)
            best, reach[name] = min(best, found.loss), min(reach[name], found.loss)
        effects = sorted(out[len(refits) :], key=lambda f: f.loss)[:_JUDGED]
        return [*out[: len(refits)], *effects], pointing

    def at_floor(self, loss: float) -> bool:
        """Whether nothing but noise is left."""
        return excess(loss, len(self.residual)) == 0

    def near(self, loss: float, best: float) -> bool:
        """Whether a loss may yet compete with the best one."""
        n = len(self.residual)
        return loss <= n + _NEAR * max(best - n, 0.1 * n)
