"""Arc length: solutions followed as a curve over frequency or force, round every fold, many curves side by side."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..deadline import in_time
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.balance import Balance, acting, excess, reason
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.frequency_reach import held
from ..harmonic_balance.harmonics import Forces
from ..harmonic_balance.newton import Jacobian
from ..harmonic_balance.view import View
from ..indices import Index, Mask
from .curve_points import Points

_DIFFERENCE = 1e-6
_ITERATIONS = 8
_SETTLED = 3e-7
_LONGEST, _FIRST, _SHORTEST = 0.25, 0.02, 1e-7
SHARE = {True: 0.1, False: 0.5}
"""Share of the frequency or of the force that counts as much as the motion itself."""
_ANGLE, _SHARP = 0.2, 0.5
_STEPS = 20_000
_FARTHEST = 0.5  # relative change of p within a step at which it is given up


class Stop(Enum):
    """Why a curve ends."""

    RANGE = "edge of the range"
    LIMIT = "limit of a joint"
    GAVE_UP = "no step was short enough"
    CLOSED = "back at its start"


@dataclass(frozen=True, eq=False)
class Trace:
    """One curve from its start: points, the step from each to the next, and why it stopped."""

    points: Points
    steps: Array
    stop: Stop
    outcome: Outcome
    beyond: tuple[ComplexArray, float] | None = None
    """Where a limit stopped it: the first point past the limit, one step on."""


@dataclass(frozen=True, eq=False)
class Path:
    """What varies, over which range, for which harmonics."""

    assembly: Assembly
    harmonics: Harmonics
    low: float
    high: float
    over_frequency: bool = True
    held: View | None = None  # where the force varies: the machine at the frequencies held, ascending

    def within(self, omega: Array) -> Array:
        """Frequencies in rad/s, held where a measured receptance ends."""
        return held(self.assembly.machine, omega, self.harmonics[-1])

    def balance(self, p: Array, other: Array) -> Balance:
        """The equations at these values."""
        omega, force = (self.within(p), other) if self.over_frequency else (other, p)
        return Balance.of(self.assembly, omega, force, self.harmonics, self.held)

    def system(
        self, z: ComplexArray, p: Array, other: Array, scale: Array, pace: Array
    ) -> tuple[Array, Jacobian, Array]:
        """Residual over scale (n, 2m) and its derivatives by u: by the motions, and by p (n, 2m)."""
        balance, aside = self._with_neighbours(p, other)
        forces = balance.forces(z)
        left = balance.residual(z, forces.force).reshape(len(p), -1) / scale[:, None]
        by_p = self._slope(z, p, balance, aside, forces) * (pace / scale)[:, None]
        residual, column = (np.concatenate([part.real, part.imag], axis=1) for part in (left, by_p))
        return residual, balance.tangent(forces), column

    def forces(self, z: ComplexArray, p: Array, other: Array) -> Forces:
        """Joint forces at motions z, without their slopes."""
        return acting(self.assembly, self.within(p) if self.over_frequency else other, self.harmonics, z)

    def by_p(self, z: ComplexArray, p: Array, other: Array, balance: Balance, forces: Forces) -> ComplexArray:
        """Derivative of the residual by what varies, (n, m); beside the equations there, forces with their slopes."""
        aside = self.balance(*_aside(p, other)) if self.over_frequency else None
        return self._slope(z, p, balance, aside, forces)

    def _with_neighbours(self, p: Array, other: Array) -> tuple[Balance, Balance | None]:
        """The equations at these values, and a little above and below them where their derivative is a difference."""
        if not self.over_frequency:
            return self.balance(p, other), None
        n, (further, others) = len(p), _aside(p, other)
        every = self.balance(np.concatenate([p, further]), np.concatenate([other, others]))
        return every.at(slice(n)), every.at(slice(n, None))

    def _slope(
        self, z: ComplexArray, p: Array, balance: Balance, aside: Balance | None, forces: Forces
    ) -> ComplexArray:
        n = len(p)
        if aside is None:
            out = np.zeros((n, z[0].size), dtype=complex)
            out[:, : balance.driven.shape[1]] = -balance.driven
            return out
        d, both = _DIFFERENCE * p, np.concatenate([z, z])
        apart = self.within(p + d) - self.within(p - d)
        g, change, moved = forces.force, forces.by_omega, (aside.omega.reshape(2, n) - balance.omega)[:, :, None, None]
        beside = aside.forces(both, slopes=False).force if change is None else np.concatenate(g + moved * change)
        up, down = aside.residual(both, beside).reshape(2, n, -1)
        return np.asarray((up - down) / np.maximum(apart, d)[:, None])

    def correct(
        self, base: Points, plane: Array, distance: Array, start: tuple[ComplexArray, Array]
    ) -> tuple[Points, Index, Mask]:
        """Where the curves meet the planes plane·(u − u_base) = distance: points, iterations, and whether they do."""
        z, p = start
        met = [self._met(base.at(some), plane[some], distance[some], (z[some], p[some])) for some in base.blocks()]
        if len(met) < 2:
            return met[0] if met else (base, np.zeros(0, dtype=int), np.zeros(0, dtype=bool))
        points, count, done = zip(*met, strict=True)
        return Points.joined(points), np.concatenate(count), np.concatenate(done)

    def _met(
        self, base: Points, plane: Array, distance: Array, start: tuple[ComplexArray, Array]
    ) -> tuple[Points, Index, Mask]:
        """`correct` for as many points as memory should hold at once."""
        z, p = start
        n = len(p)
        tangent, count, done = base.tangent.copy(), np.zeros(n, dtype=int), np.zeros(n, dtype=bool)
        z, p, left = z.copy(), p.copy(), np.arange(n)
        last = np.zeros((n, plane.shape[1], 1))
        last[:, -1] = 1.0
        for k in range(_ITERATIONS):
            here = base.at(left)
            r, tangents, by_p = self.system(z[left], p[left], here.other, here.scale, here.pace)
            short = distance[left] - np.sum(plane[left] * here.change(z[left], p[left]), axis=1)
            right = np.concatenate([-r, short[:, None]], axis=1)[:, :, None]
            both = tangents.bordered(by_p, plane[left], np.concatenate([right, last[left]], axis=2))
            step, along = both[:, :, 0], both[:, :, 1]
            length = np.linalg.norm(step, axis=1)
            fine = np.isfinite(length) & (length < 2.0)
            now = left[fine]
            z[now], p[now] = replace(here.at(fine), z=z[now], p=p[now]).moved(step[fine])
            tangent[now] = along[fine] / np.linalg.norm(along[fine], axis=1, keepdims=True)
            count[now] = k + 1
            fine &= np.abs(p[left] / here.p - 1) < _FARTHEST
            done[left] = fine & (length <= _SETTLED)
            left = left[fine & (length > _SETTLED)]
            if not len(left):
                break
        # The plane's side is kept: a fold turns p round, never the direction of travel.
        tangent *= np.where(np.sum(tangent * base.tangent, axis=1) < 0, -1.0, 1.0)[:, None]
        return replace(base, z=z, p=p, tangent=tangent), count, done

    def begin(self, z: ComplexArray, p: Array, other: Array, upward: Mask) -> Points:
        """Starts on solutions, headed for rising or falling p."""
        scale, pace = self.metric(z, p)
        _, tangents, by_p = self.system(z, p, other, scale, pace)
        tangent = tangents.along(by_p)
        tangent *= np.where((tangent[:, -1] > 0) == upward, 1.0, -1.0)[:, None]
        return Points(z, p, other, tangent, scale, pace)

    def metric(self, z: ComplexArray, p: Array) -> tuple[Array, Array]:
        """Scale of the motion and pace of p at points: what counts as a change of order one there."""
        size = np.sqrt(np.sum(np.abs(z) ** 2, axis=(1, 2)))
        return np.maximum(size, 1e-15), SHARE[self.over_frequency] * p

    def rescaled(self, points: Points) -> Points:
        """The same points and directions in the metric of where they are now."""
        scale, pace = self.metric(points.z, points.p)
        t = points.tangent.copy()
        t[:, :-1] *= (points.scale / scale)[:, None]
        t[:, -1] *= points.pace / pace
        t /= np.linalg.norm(t, axis=1, keepdims=True)
        return replace(points, tangent=t, scale=scale, pace=pace)


def _aside(p: Array, other: Array) -> tuple[Array, Array]:
    """A little above all values and then a little below."""
    d = _DIFFERENCE * p
    return np.concatenate([p + d, p - d]), np.concatenate([other, other])


def march(path: Path, start: Points) -> list[Trace]:
    """Follow every start until its curve leaves the range or a joint its limits, closes, or cannot be followed."""
    n = len(start.p)
    kept: list[list[Points]] = [[start.at(np.array([i]))] for i in range(n)]
    steps: list[list[float]] = [[] for _ in range(n)]
    ends: list[tuple[Stop, Outcome, tuple[ComplexArray, float] | None] | None] = [None] * n
    active, here = np.arange(n), start
    ds, bend = np.full(n, _FIRST), np.zeros_like(start.tangent)
    for _ in range(_STEPS):
        in_time()
        if not len(active):
            break
        guess = here.moved(ds[:, None] * here.tangent + 0.5 * ds[:, None] ** 2 * bend)
        new, count, done = path.correct(here, here.tangent, ds, guess)
        angle = np.arccos(np.clip(np.sum(new.tangent * here.tangent, axis=1), -1, 1))
        ahead = path.over_frequency & (path.within(new.p) != new.p)  # the tangent is not that of the curve there
        done &= (angle < _SHARP) | ahead
        ds_used = ds.copy()
        ds = np.where(done, ds * _factor(count, angle), ds / 2)
        for k in np.flatnonzero(~done & (ds < _SHORTEST)):
            ends[active[k]] = (Stop.GAVE_UP, Outcome.STEP_TOO_SMALL, None)
        out = np.flatnonzero(done & ((new.p > path.high) | (new.p < path.low)))
        if len(out):
            _to_the_edge(path, here, new, out, active, kept, steps, ends)
        settled = path.rescaled(new)
        inside = np.setdiff1d(np.flatnonzero(done), out)
        past = _past(path, new.at(inside))
        for k, over in zip(inside, past, strict=True):
            i = int(active[k])
            if np.max(over) > 0:
                ends[i] = (Stop.LIMIT, reason(over, path.assembly.limits), (new.z[k], float(new.p[k])))
                steps[i].append(float(ds_used[k]))
                continue
            if _closes(start, i, here, int(k), float(ds_used[k]), len(steps[i])):
                ends[i] = (Stop.CLOSED, Outcome.CONVERGED, None)
                kept[i].append(start.at(np.array([i])))
            else:
                kept[i].append(settled.at(np.array([k])))
            steps[i].append(float(ds_used[k]))
        before = path.rescaled(replace(new, tangent=_in(new, here)))
        bend = np.where(done[:, None], (settled.tangent - before.tangent) / ds_used[:, None], bend * 0)
        here = here.put(np.flatnonzero(done), settled.at(done))
        ds = np.clip(ds, 0, _LONGEST)
        go = np.array([ends[i] is None for i in active], dtype=bool)
        active, here, ds, bend = active[go], here.at(go), ds[go], bend[go]
    traces = []
    for i in range(n):
        stop, outcome, beyond = ends[i] or (Stop.GAVE_UP, Outcome.STEP_TOO_SMALL, None)
        traces.append(Trace(Points.joined(kept[i]), np.array(steps[i]), stop, outcome, beyond))
    return traces


def _in(new: Points, old: Points) -> Array:
    """Tangents of ``old`` in the scales of ``new``."""
    t = old.tangent.copy()
    t[:, :-1] *= (old.scale / new.scale)[:, None]
    t[:, -1] *= old.pace / new.pace
    return t


def _factor(count: Index, angle: Array) -> Array:
    """How much longer the next step may be."""
    by_count = np.array([1.0, 1.8, 1.6, 1.3, 0.9, 0.6, 0.5, 0.5, 0.5])[count]
    return np.asarray(np.minimum(by_count, _ANGLE / np.maximum(angle, 1e-9)))


def _past(path: Path, new: Points) -> Array:
    """`excess` at points, (n, 2 nj)."""
    if not len(new.p):
        return np.zeros((0, 2 * len(path.assembly.nonlinear)))
    forces = path.forces(new.z, new.p, new.other)
    return excess(forces, path.assembly.coordinates.motions(new.z), path.harmonics, path.assembly.limits)


def _to_the_edge(
    path: Path,
    here: Points,
    new: Points,
    out: Index,
    active: Index,
    kept: list[list[Points]],
    steps: list[list[float]],
    ends: list[tuple[Stop, Outcome, tuple[ComplexArray, float] | None] | None],
) -> None:
    """End the curves that leave the range on its edge exactly."""
    base, target = here.at(out), np.clip(new.p[out], path.low, path.high)
    plane = np.zeros_like(base.tangent)
    plane[:, -1] = 1.0
    share = (target - base.p) / np.where(new.p[out] != base.p, new.p[out] - base.p, 1.0)
    z = base.z + share[:, None, None] * (new.z[out] - base.z)
    last, _, done = path.correct(base, plane, (target - base.p) / base.pace, (z, target.copy()))
    past = _past(path, last)
    for k, i in enumerate(active[out]):
        ends[i] = (Stop.RANGE, Outcome.CONVERGED, None)
        if done[k] and np.max(past[k]) <= 0 and abs(share[k]) > 1e-9:
            kept[i].append(replace(last.at(np.array([k])), p=target[k : k + 1]))
            along = np.sum(base.tangent[k] * base.change(last.z, last.p)[k])
            steps[i].append(float(along))


def _closes(start: Points, i: int, here: Points, k: int, ds: float, count: int) -> bool:
    """Whether the step from row k of ``here`` passes the start of curve i."""
    if count < 8:
        return False
    row, first = here.at(np.array([k])), start.at(np.array([i]))
    gap = row.change(first.z, first.p)[0]
    along = float(np.sum(gap * row.tangent[0]))
    aside = float(np.linalg.norm(gap - along * row.tangent[0]))
    alike = float(np.sum(row.tangent[0] * first.tangent[0]))
    return 0 < along <= ds and aside <= 0.3 * ds + 1e-6 and alike > 0.5
