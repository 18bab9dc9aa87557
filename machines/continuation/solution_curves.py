"""Curves of solutions: where they turn, where a joint moves most, where they cross a line, where a limit ends them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..harmonic_balance.balance import excess
from ..harmonic_balance.harmonics import Forces
from ..indices import Index, Mask
from .arclength import Path, Stop, Trace
from .curve_points import Points

_ALONG = 1e-5
_PASSES = 40
_SETTLED = 1e-9
_STRAY = 0.6
_INSIDE = 1e-9
PARTS = ("z", "p", "line", "fold", "top", "close")  # what a curve has at every point


@dataclass(frozen=True, eq=False)
class Curve:
    """Solutions at one force (or one frequency) in the order in which a curve runs through them."""

    z: ComplexArray
    """m, (n, nh, nj)."""
    p: Array
    """What varies: rad/s or N."""
    line: Index
    """Index of the line that a point stands on, −1 for others."""
    fold: Mask
    """Where the curve turns back in p."""
    top: Index
    """Index of the motion that is largest there, −1 for none."""
    close: Mask
    """Whether points lie so close that tops follow from them."""
    ends: tuple[tuple[Stop, Outcome], tuple[Stop, Outcome]]

    @property
    def closed(self) -> bool:
        """An isola."""
        return self.ends[1][0] is Stop.CLOSED


@dataclass(frozen=True, eq=False)
class _Found:
    """Points between those of the traces: on which piece, how far along it, and what they are."""

    row: Index
    at: Array
    points: Points
    line: Index
    fold: Mask
    top: Index


@dataclass(frozen=True, eq=False)
class _Segments:
    """Pieces between neighbouring points: the first point, the step, the last point, and which trace and piece."""

    base: Points
    step: Array
    z: ComplexArray
    p: Array
    trace: Index
    place: Index

    @classmethod
    def of(cls, traces: list[Trace]) -> _Segments:
        bases, zs, ps, trace, place = [], [], [], [], []
        for i, t in enumerate(traces):
            n = len(t.steps)
            bases.append(t.points.at(np.arange(n)))
            last = [] if t.beyond is None else [t.beyond]
            zs += [t.points.z[1:], *(np.array([z]) for z, _ in last)]
            ps += [t.points.p[1:], *(np.array([p]) for _, p in last)]
            trace.append(np.full(n, i))
            place.append(np.arange(n))
        return cls(
            Points.joined(bases),
            np.concatenate([t.steps for t in traces]),
            np.concatenate(zs),
            np.concatenate(ps),
            np.concatenate(trace),
            np.concatenate(place),
        )

    def at(self, rows: Index) -> _Segments:
        return _Segments(
            self.base.at(rows), self.step[rows], self.z[rows], self.p[rows], self.trace[rows], self.place[rows]
        )

    def between(self, distance: Array) -> tuple[ComplexArray, Array]:
        """Motions and p at these distances along each piece, by the parabola through its ends."""
        end = self.base.change(self.z, self.p)
        bow = end - self.step[:, None] * self.base.tangent
        change = distance[:, None] * self.base.tangent + (distance / self.step)[:, None] ** 2 * bow
        return self.base.moved(change)

    def point(self, path: Path, distance: Array, start: tuple[ComplexArray, Array]) -> tuple[Points, Mask]:
        """The curve at these distances along each piece, from a start."""
        found, _, done = path.correct(self.base, self.base.tangent, distance, start)
        return found, done

    def root(
        self, path: Path, value: Callable[[Points, Index], Array], low: Array, high: Array
    ) -> tuple[Points, Array, Mask]:
        """Where a function of the points, given at both ends of every piece, is 0.

        Regula falsi, the value at an end that stays twice halved (Illinois: Dowell and Jarratt, BIT 11 (1971) 168).
        """
        a, b = np.zeros(len(self.step)), self.step.copy()
        fa, fb = low.copy(), high.copy()
        enough = _SETTLED * np.minimum(np.abs(low), np.abs(high))
        left, x = np.arange(len(a)), b.copy()
        points, fine, before = self.base, np.ones(len(a), dtype=bool), np.zeros(len(a), dtype=int)
        for round_ in range(_PASSES):
            if not len(left):
                break
            new = (a[left] * fb[left] - b[left] * fa[left]) / (fb[left] - fa[left])
            here, last = self.at(left), points.at(left)
            ahead = (new - x[left]) / np.sum(last.tangent * here.base.tangent, axis=1)
            start = here.between(new) if round_ == 0 else last.moved(ahead[:, None] * last.tangent)
            found, done = here.point(path, new, start)
            fine[left] &= done
            f = value(found, left)
            side = np.where((f > 0) == (fa[left] > 0), 1, -1)
            first, share = side > 0, np.where(side == before[left], 0.5, 1.0)
            a[left], b[left] = np.where(first, new, a[left]), np.where(first, b[left], new)
            fa[left], fb[left] = np.where(first, f, fa[left] * share), np.where(first, fb[left] * share, f)
            moved, x[left], before[left] = np.abs(new - x[left]), new, side
            points = points.put(left, found)
            left = left[done & (moved > _SETTLED * self.step[left]) & (np.abs(f) > enough[left])]
        return points, x, fine


def curves_of(path: Path, traces: list[Trace], lines: Array) -> list[Curve]:
    """Every trace with its folds, its largest motions, its crossings of ``lines`` and its limit put in.

    ``lines`` are values of p; one that coincides with the end of a range is met by the end of the curve.
    """
    if not traces:
        return []
    traces = _up_to_limits(path, traces)
    parts = _Segments.of(traces)
    every = Points.joined([t.points for t in traces])
    first = np.cumsum([0, *(len(t.points.p) for t in traces)])[parts.trace] + parts.place
    last = first + 1
    found: list[_Found] = []

    def add(rows: Index, value: Callable[[Points, Index], Array], ends: tuple[Array, Array], **mark: Index) -> None:
        if len(rows):
            points, x, fine = parts.at(rows).root(path, value, *ends)
            keep = np.flatnonzero(fine)
            none = np.full(len(keep), -1)
            line, top = (mark[name][keep] if name in mark else none for name in ("line", "top"))
            fold = np.full(len(keep), "fold" in mark)
            found.append(_Found(rows[keep], x[keep], points.at(keep), line, fold, top))

    along = every.tangent[:, -1]
    turned = np.flatnonzero(along[first] * along[last] < 0)
    add(turned, lambda q, _: q.tangent[:, -1], (along[first[turned]], along[last[turned]]), fold=turned)

    if path.over_frequency:
        rise = _growth(path, every)
        row, k = np.nonzero((rise[first] > 0) & (rise[last] <= 0))
        add(
            row,
            lambda q, left: _growth(path, q)[np.arange(len(left)), k[left]],
            (rise[first[row], k], rise[last[row], k]),
            top=k,
        )
    row, line = _crossed(parts, lines)
    if len(row):
        z, done = _on_lines(path, parts.at(row), lines[line])
        keep = np.flatnonzero(done)
        share = (lines[line] - parts.base.p[row]) / (parts.p[row] - parts.base.p[row])
        stand = parts.base.at(row[keep])
        points = Points(z[keep], lines[line[keep]], stand.other, stand.tangent, stand.scale, stand.pace)
        none = np.full(len(keep), -1)
        at = share[keep] * parts.step[row[keep]]
        found.append(_Found(row[keep], at, points, line[keep], none > 0, none))
        rest = np.flatnonzero(~done)
        add(
            row[rest],
            lambda q, left: q.p - lines[line[rest[left]]],
            (parts.base.p[row[rest]] - lines[line[rest]], parts.p[row[rest]] - lines[line[rest]]),
            line=line[rest],
        )
    return [_assembled(i, t, parts, found, lines) for i, t in enumerate(traces)]


def _up_to_limits(path: Path, traces: list[Trace]) -> list[Trace]:
    """Traces that a limit stopped, with the point at the limit as their last."""
    some = [i for i, t in enumerate(traces) if t.beyond is not None]
    out = list(traces)
    if not some:
        return out
    parts = _Segments.of([traces[i] for i in some])
    last = np.flatnonzero(np.append(np.diff(parts.trace) != 0, True))
    parts = parts.at(last)

    def over(points: Points) -> Array:
        forces = path.forces(points.z, points.p, points.other)
        past = excess(forces, path.assembly.coordinates.motions(points.z), path.harmonics, path.assembly.limits)
        return np.asarray(np.max(past, axis=1) + _INSIDE)

    low, high = over(parts.base), over(parts.point(path, parts.step, parts.between(parts.step))[0])
    apart = np.flatnonzero((low < 0) & (high > 0))
    points, x, fine = parts.at(apart).root(path, lambda q, _: over(q), low[apart], high[apart])
    for k, i in enumerate(some):
        t, place = traces[i], np.flatnonzero(apart == k)
        if len(place) and fine[place[0]]:
            end = Points.joined([t.points, points.at(place)])
            out[i] = Trace(end, np.append(t.steps[:-1], x[place]), t.stop, t.outcome)
        else:
            out[i] = Trace(t.points, t.steps[:-1], t.stop, t.outcome)
    return out


def _crossed(parts: _Segments, lines: Array) -> tuple[Index, Index]:
    """Pairs of a piece and a line strictly inside it."""
    low, high = np.minimum(parts.base.p, parts.p), np.maximum(parts.base.p, parts.p)
    begin, end = np.searchsorted(lines, low, side="right"), np.searchsorted(lines, high, side="left")
    count = np.maximum(end - begin, 0)
    row = np.repeat(np.arange(len(count)), count)
    offset = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return row, begin[row] + offset


def _on_lines(path: Path, parts: _Segments, line: Array) -> tuple[ComplexArray, Mask]:
    """Motions at fixed p from what lies between the ends of each piece; False where Newton strays from there."""
    share = (line - parts.base.p) / (parts.p - parts.base.p)
    guess = parts.base.z + share[:, None, None] * (parts.z - parts.base.z)
    settled = [path.balance(line[some], parts.base.other[some]).settle(guess[some]) for some in parts.base.blocks()]
    z, done = (np.concatenate(part) for part in zip(*settled, strict=True))
    strayed = np.max(np.abs(z - guess), axis=(1, 2))
    return z, done & (strayed <= _STRAY * np.max(np.abs(parts.z - parts.base.z), axis=(1, 2)))


def first_harmonics(path: Path, z: ComplexArray, p: Array, other: Array, forces: Forces | None = None) -> ComplexArray:
    """First harmonics in m of all joints and then of the outputs, (points, motions)."""
    omega, force = (p, other) if path.over_frequency else (other, p)
    forces = path.forces(z, p, other) if forces is None else forces
    coordinates = path.assembly.coordinates
    moved = path.assembly.moved(path.within(omega), force, coordinates.together(forces.force[:, 0]))
    moved[:, list(path.assembly.nonlinear)] = coordinates.motions(z[:, 0])
    return moved


def _growth(path: Path, points: Points) -> Array:
    """Relative growth of the amplitude of every joint along the curve, (n, joints)."""
    joints = len(path.assembly.joints)
    grown = [_grown(path, points.at(some)) for some in points.blocks()]
    return np.concatenate([np.empty((0, joints)), *grown])


def _grown(path: Path, points: Points) -> Array:
    """`_growth` for as many points as memory should hold at once."""
    n, joints = len(points.p), len(path.assembly.joints)
    sides = [points.moved(side * _ALONG * points.tangent) for side in (1.0, -1.0)]
    z, p = (np.concatenate(both) for both in zip(*sides, strict=True))
    size = np.abs(first_harmonics(path, z, p, np.tile(points.other, 2))[:, :joints]).reshape(2, n, joints)
    return np.asarray((size[0] - size[1]) / np.maximum(size[0] + size[1], 1e-300) / _ALONG)


def _assembled(
    i: int,
    trace: Trace,
    parts: _Segments,
    found: list[_Found],
    lines: Array,
) -> Curve:
    """Points of a trace with those found on its pieces, in order."""
    n = len(trace.points.p)
    matching = np.searchsorted(lines, trace.points.p)
    own = np.where(
        (matching < len(lines)) & (lines[np.minimum(matching, len(lines) - 1)] == trace.points.p), matching, -1
    )
    place, z, p = [np.arange(n, dtype=float)], [trace.points.z], [trace.points.p]
    line, fold, top = [own], [np.zeros(n, dtype=bool)], [np.full(n, -1)]
    for new in found:
        mine = np.flatnonzero(parts.trace[new.row] == i)
        rows = new.row[mine]
        place.append(parts.place[rows] + new.at[mine] / parts.step[rows])
        z.append(new.points.z[mine])
        p.append(new.points.p[mine])
        line.append(new.line[mine])
        fold.append(new.fold[mine])
        top.append(new.top[mine])
    order = np.argsort(np.concatenate(place), kind="stable")
    begin = (trace.stop, trace.outcome)
    join = [np.concatenate(part)[order] for part in (z, p, line, fold, top)]
    return Curve(join[0], join[1], join[2], join[3], join[4], order < 0, (begin, begin))
