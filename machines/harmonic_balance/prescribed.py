"""Several joints at a prescribed amplitude of the tool: the force is one more unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint

from ..deadline import in_time
from ..indices import Index, Mask, Reasons
from ..model.limits import Limit, past_limits
from ..solved import solve_each
from ..statics.bias import force_slopes
from .newton import Problem, own_slopes
from .secants import by_secants
from .view import View

_ITERATIONS = 25
_SETTLED = 1e-11
_RAMP = 12
_RISE = 10.0
_SHORTEST = 2.0**-6

_State = tuple[Array, ComplexArray, ComplexArray, ComplexArray, Index]
"""Residual, gains, slopes, motion of the leading axis of the tool and its index, see `_Tool.residual`."""


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Joint motions (nf, nj), gains (nf, nj), force magnitude (nf,) and what settled."""

    z: ComplexArray
    gain: ComplexArray
    force: Array
    converged: Mask

    def outcomes(self, limits: Sequence[Limit], slack: float = 0.0) -> Reasons:
        """Per line: converged, stalled, or the limit of a joint that is passed by more than a share of ``slack``."""
        out = np.array([Outcome.CONVERGED if c else Outcome.STALLED for c in self.converged], dtype=object)
        for wrong, outcome in past_limits(limits, self.z, self.gain, slack):
            out[self.converged & wrong] = outcome
        return out


def solve_prescribed(
    view: View,
    joints: Sequence[Joint],
    cap: Array,
    direct: ComplexArray,
    through: ComplexArray,
    amplitude: float,
    ramp: bool = True,
) -> Prescribed:
    """Solve q + Hzz Tᵀ g = Hzf F and max over the axes of abs(direct F − through Tᵀ g) = ``amplitude`` for q and F.

    ``direct`` (nf, axes) and ``through`` (nf, axes, r) are receptances to the tool. Folds in the force are no
    obstacle, as the force is not given. Starts from the machine at rest; a line that does not settle is tried again
    with the amplitude raised in steps (``ramp``).
    """
    tool = _Tool(Problem.of(view, joints, np.ones(len(view.omega)), cap), direct, through)
    z, force = tool.start(amplitude)
    held = by_secants(tool.problem, z, force, lambda lines, q, gain: tool.at(lines).held_force(q, gain, amplitude))
    z, gain, force, converged = held.q, held.gain, held.force, held.settled
    left = np.flatnonzero(~converged)
    if len(left):
        part = tool.at(left)
        z[left], gain[left], force[left], converged[left] = part.newton(*part.start(amplitude), amplitude)
    lost = np.flatnonzero(~converged) if ramp else left[:0]
    s, F = tool.at(lost).start(amplitude / _RAMP)
    for k in range(1, _RAMP + 1):
        if not len(lost):
            break
        s, G, F, done = tool.at(lost).newton(s, F, amplitude * k / _RAMP)
        if k == _RAMP:
            z[lost], gain[lost], force[lost], converged[lost] = s, G, F, done
        else:
            lost, s, F = lost[done], s[done] * (k + 1) / k, F[done] * (k + 1) / k
    return Prescribed(view.coordinates.motions(z), gain, force, converged)


@dataclass(frozen=True, eq=False)
class _Tool:
    problem: Problem
    direct: ComplexArray
    through: ComplexArray

    def at(self, lines: Index | Mask) -> _Tool:
        return _Tool(self.problem.at(lines), self.direct[lines], self.through[lines])

    def motion(self, z: ComplexArray, gain: ComplexArray, force: Array) -> ComplexArray:
        """Tool displacements in m, (lines, axes)."""
        c = self.problem.coordinates
        pull = c.together(gain * c.motions(z))
        return np.asarray(self.direct * force[:, None] - (self.through @ pull[:, :, None])[:, :, 0])

    def start(self, amplitude: float) -> tuple[ComplexArray, Array]:
        """Joint motions and force of the machine with its gains at rest."""
        force = self.held_force(self.problem.driven, self.problem.base, amplitude)
        return self.problem.driven * force[:, None], force

    def held_force(self, unit: ComplexArray, gain: ComplexArray, amplitude: float) -> Array:
        """The force in N that makes the amplitude where the joints are held, from their motions at a unit force."""
        return np.asarray(amplitude / np.max(np.abs(self.motion(unit, gain, np.ones(len(unit)))), axis=1))

    def residual(self, z: ComplexArray, force: Array, amplitude: float) -> _State:
        """Real residual (lines, 2nj + 1), gains, slopes, motion of the leading axis and its index."""
        r, gain, slope = self.problem.residual(z, self.problem.driven * force[:, None])
        every = self.motion(z, gain, force)
        axis = np.argmax(np.abs(every), axis=1)
        x = every[np.arange(len(axis)), axis]
        short = np.abs(x) / amplitude - 1
        size = np.maximum(np.max(np.abs(z), axis=1, keepdims=True), 1e-300)
        return np.concatenate([r.real / size, r.imag / size, short[:, None]], axis=1), gain, slope, x, axis

    @np.errstate(over="ignore", invalid="ignore")  # a motion beyond all bounds is one that is not kept
    def newton(self, z: ComplexArray, force: Array, amplitude: float) -> tuple[ComplexArray, ComplexArray, Array, Mask]:
        """Newton's method on [Re z, Im z, force]; lines drop out as they settle."""
        lines, nj = z.shape
        z, force, gain = z.copy(), force.copy(), np.zeros((lines, len(self.problem.joints)), dtype=complex)
        converged = np.zeros(lines, dtype=bool)
        left, part, x, F = np.arange(lines), self, z, force
        state = part.residual(x, F, amplitude)
        for _ in range(_ITERATIONS):
            in_time()
            r, G, slope, tip, axis = state
            if not np.all(sound := np.all(np.isfinite(r), axis=1)):
                if not np.any(sound):
                    break
                left, part, x, F = left[sound], part.at(sound), x[sound], F[sound]
                r, G, slope, tip, axis = r[sound], G[sound], slope[sound], tip[sound], axis[sound]
            J = part.jacobian(x, F, G, slope, tip, axis, amplitude)
            step = -solve_each(J, r[:, :, None])[:, :, 0]
            size = np.maximum(np.max(np.abs(x), axis=1), 1e-300)
            delta = (step[:, :nj] + 1j * step[:, nj:-1]) * size[:, None]
            small = np.max(np.abs(step), axis=1) <= _SETTLED
            z[left], gain[left], force[left] = x, G, F
            converged[left[small]] = True
            go = ~small & np.all(np.isfinite(step), axis=1)
            if not np.any(go):
                break
            left, part = left[go], part.at(go)
            x, F, state = part._step(x[go], F[go], delta[go], step[go, -1], r[go], amplitude)
        return z, gain, force, converged

    def jacobian(
        self,
        z: ComplexArray,
        F: Array,
        gain: ComplexArray,
        slope: ComplexArray,
        x: ComplexArray,
        axis: Index,
        amplitude: float,
    ) -> Array:
        """Over Re z and Im z relative to the largest joint motion and the force relative to itself."""
        lines, nj = z.shape
        J = np.zeros((lines, 2 * nj + 1, 2 * nj + 1))
        J[:, :-1, :-1] = self.problem.jacobian(z, gain, slope)
        size = np.maximum(np.max(np.abs(z), axis=1), 1e-300)
        by_force = -self.problem.driven * (F / size)[:, None]
        J[:, :nj, -1], J[:, nj:-1, -1] = by_force.real, by_force.imag
        c, motion = self.problem.coordinates, self.problem.coordinates.motions(z)
        path = self.through[np.arange(lines), axis][:, None, :]
        towards = (x.conj() / np.maximum(np.abs(x), 1e-300))[:, None] / amplitude
        if slope.ndim == 3:
            plus, minus = (c.across(path, part)[:, 0] for part in force_slopes(motion, gain, slope))
        else:
            own, crossed = own_slopes(motion, slope)
            plus, minus = c.through(path, gain + own)[:, 0], c.through(path, crossed)[:, 0]
        J[:, -1, :nj] = -(towards * (plus + minus)).real * size[:, None]
        J[:, -1, nj:-1] = -(towards * 1j * (plus - minus)).real * size[:, None]
        J[:, -1, -1] = (towards[:, 0] * self.direct[np.arange(lines), axis]).real * F
        return J

    def _step(
        self, z: ComplexArray, F: Array, delta: ComplexArray, change: Array, r: Array, amplitude: float
    ) -> tuple[ComplexArray, Array, _State]:
        """A capped step, halved where the residual grows tenfold, and its `residual`; the force keeps its sign."""
        motion = self.problem.coordinates.motions(delta)
        longest = np.maximum(np.max(np.abs(motion) / self.problem.cap, axis=1), np.abs(change) / 0.7)
        share = 1 / np.maximum(1.0, longest)
        before = np.linalg.norm(r, axis=1) + 1e-12
        new, force = z + share[:, None] * delta, F * (1 + share * change)
        state = self.residual(new, force, amplitude)
        while True:
            worse = (np.linalg.norm(state[0], axis=1) > _RISE * before) & (share > _SHORTEST)
            if not np.any(worse):
                return new, force, state
            share = np.where(worse, share / 2, share)
            new[worse] = z[worse] + share[worse, None] * delta[worse]
            force[worse] = F[worse] * (1 + share[worse] * change[worse])
            tried = self.at(worse).residual(new[worse], force[worse], amplitude)
            for part, found in zip(state, tried, strict=True):
                part[worse] = found
