"""Several harmonics where branches fold here and there: carried over where there is one, followed where it folds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import with_mean
from ..indices import Mask
from ..operating.branches import Branch, End
from .all_curves import follow, from_branches
from .arclength import Path, Stop
from .carried import Carried, Strayed
from .curve_results import Followed, followed
from .solution_curves import PARTS, Curve, first_harmonics
from .windows import stretches

_SAME = 1e-6
_LITTLE, _STILL = 0.25, 1e-9
_LEAST = 5
"""Points of a piece that is carried over."""


def pieced(
    assembly: Assembly, force: float, lines: Array, harmonics: Harmonics, branches: Sequence[Branch]
) -> Followed | None:
    """Solutions in several harmonics beside branches in one; None where arc length is to follow the whole range.

    Windows hold every frequency at which there is not one solution alone, or at which what lies beside it is not sure.
    A window that a curve leaves away from what is carried over beside it is widened. A single solution is carried over
    as it is: a curve apart from it that only further harmonics make is not looked for there.
    """
    if not branches:
        return None
    grid = np.unique(np.concatenate([b.frequency for b in branches]))
    path = Path(assembly, with_mean(harmonics, assembly.biased is not None), 2 * np.pi * grid[0], 2 * np.pi * grid[-1])
    carried = Carried(path, force, harmonics, lines)
    bad, known = _not_one(grid, branches), dict[tuple[int, int], list[Curve]]()
    if len(grid) > 1 and not np.any(bad):
        try:
            return followed(path, force, [carried.curve(*_single(grid, branches))], lines)
        except Strayed as where:
            _mark(bad, grid, where.omega)
    while 0 < np.sum(bad) < len(grid):
        windows = stretches(bad)
        edges = [0, *(i for window in windows for i in window), len(grid) - 1]
        curves, before = list[Curve](), np.sum(bad)
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            if 0 < b - a < _LEAST:
                bad[a : b + 1] = True
            elif a < b:
                try:
                    curves.append(carried.curve(*_single(grid[a : b + 1], branches)))
                except Strayed as where:
                    _mark(bad, grid, where.omega)
        if np.sum(bad) > before:
            continue
        wide = np.zeros((len(windows), 2), dtype=int)
        for n, (i, j) in enumerate(windows):
            if (i, j) not in known:
                known[i, j] = _followed(path, force, lines, harmonics, grid[[i, j]], branches)
            for side, k in enumerate((i, j)):
                if k not in (0, len(grid) - 1):
                    leaves = _wider(path, force, known[i, j], curves, 2 * np.pi * grid[[i, j]], side)
                    wide[n, side] = leaves * max((j - i) // 2, 4)
            curves += known[i, j]
        if not np.any(wide):
            return followed(path, force, _spliced(curves), lines)
        for (i, j), (below, above) in zip(windows, wide.tolist(), strict=True):
            bad[max(i - below, 0) : j + above + 1] |= below + above > 0
    return None


def _mark(bad: Mask, grid: Array, omega: Array) -> None:
    """Doubt the frequencies (Hz) of a grid that are these (rad/s), or that lie on both sides of one of them."""
    above = np.searchsorted(2 * np.pi * grid, omega)
    bad[above] = True
    between = 2 * np.pi * grid[above] != omega
    bad[above[between] - 1] = True


def _single(grid: Array, branches: Sequence[Branch]) -> tuple[Array, ComplexArray]:
    """Frequencies (Hz) and motions of all joints (m) of the branch from the first to the last of a grid."""
    low, high = grid[[0, -1]]
    branch = next(b for b in branches if b.frequency[0] <= high and b.frequency[-1] >= low)
    frequency, rows = np.unique(branch.frequency, return_index=True)
    inside = (frequency >= low) & (frequency <= high)
    return frequency[inside], branch.joint[rows[inside]]


def _not_one(grid: Array, branches: Sequence[Branch]) -> Mask:
    """Where not one branch alone runs on to both sides, on a grid of all their frequencies."""
    count = np.zeros(len(grid), dtype=int)
    bad = np.zeros(len(grid), dtype=bool)
    for b in branches:
        first, last = np.searchsorted(grid, b.frequency[[0, -1]])
        count[first : last + 1] += 1
        bad[[first for end in b.ends[:1] if end is not End.RANGE]] = True
        bad[[last for end in b.ends[1:] if end is not End.RANGE]] = True
    return np.asarray(bad | (count != 1))


def _followed(
    path: Path, force: float, lines: Array, harmonics: Harmonics, edges: Array, branches: Sequence[Branch]
) -> list[Curve]:
    """All curves between two frequencies (Hz) from a point of every branch there and those on the edges."""
    low, high = edges
    cut = []
    for b in branches:
        rows = np.flatnonzero((b.frequency >= low) & (b.frequency <= high))
        if len(rows):
            f, (first, last) = b.frequency[rows], b.ends
            ends = (End.RANGE if f[0] == low else first, End.RANGE if f[-1] == high else last)
            cut.append(replace(b, frequency=f, joint=b.joint[rows], ends=ends))
    inside = replace(path, low=2 * np.pi * low, high=2 * np.pi * high)
    return follow(inside, np.array([force]), from_branches(path.assembly, [cut], harmonics), 2 * np.pi * lines)[0]


def _wider(path: Path, force: float, found: Sequence[Curve], beside: Sequence[Curve], edges: Array, side: int) -> float:
    """By how much of its half a window is to grow on a side, 0 where the curve beside it goes on in it alone.

    A little where a joint moves most on the edge itself, so that neither side shows its top.
    """
    inner = [end for curve in found for end in _ends(curve) if np.argmin(np.abs(end.p[-1] - edges)) == side]
    outer = [end for curve in beside for end in _ends(curve) if end.p[-1] == edges[side]]
    if len(inner) != 1 or len(outer) != 1 or not _same(inner[0], outer[0]):
        return 1.0
    three = [(inner[0], -1), *((end, -2) for end in (inner[0], outer[0]) if len(end.p) > 1)]
    z, p = np.array([end.z[at] for end, at in three]), np.array([end.p[at] for end, at in three])
    size = np.abs(first_harmonics(path, z, p, np.full(len(p), force))[:, : len(path.assembly.joints)])
    top = (size[0] > np.max(size[1:], axis=0, initial=0.0)) & (size[0] > _STILL * np.max(size))
    return _LITTLE if len(p) > 2 and np.any(top) else 0.0


def _ends(curve: Curve) -> list[Curve]:
    """The curve with each of its ends on an edge as its last point."""
    if curve.closed:
        return []
    return [c for c in (curve, _turned(curve)) if c.ends[1][0] is Stop.RANGE]


def _turned(curve: Curve) -> Curve:
    return replace(curve, **{n: getattr(curve, n)[::-1] for n in PARTS}, ends=(curve.ends[1], curve.ends[0]))


def _same(a: Curve, b: Curve) -> bool:
    """Whether the last points of two curves are one."""
    apart = np.max(np.abs(a.z[-1] - b.z[-1]))
    return bool(a.p[-1] == b.p[-1] and apart <= _SAME * np.max(np.abs(b.z[-1])))


def _spliced(curves: Sequence[Curve]) -> list[Curve]:
    """Curves that meet at their ends as one."""
    done, left = list[Curve](), list(curves)
    while left:
        curve = left.pop(0)
        while True:
            meeting = [
                (k, a, b) for k, other in enumerate(left) for a in _ends(curve) for b in _ends(other) if _same(a, b)
            ]
            if not meeting:
                break
            k, a, b = meeting[0]
            left.pop(k)
            parts = {n: np.concatenate([getattr(a, n), getattr(b, n)[-2::-1]]) for n in PARTS}
            curve = replace(curve, **parts, ends=(a.ends[0], b.ends[0]))
            curve.close[len(a.p) - 1] |= b.close[-1]
        done.append(curve if curve.closed or curve.p[0] <= curve.p[-1] else _turned(curve))
    return done
