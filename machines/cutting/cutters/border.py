"""The border of stability of any cutter at one speed: depths at which the number of growing vibrations changes.

Where the depth is inside the coefficients, as with helix, the border is no eigenvalue problem in depth: the depth is
walked through in steps, what grows is counted at each (`growing`), and every change is closed in on until an eigenvalue
of b·A(ν; b) is −1. So stable stretches above an unstable one, and islands, are found down to the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...deadline import in_time
from ..loops.loop_branches import NONE, Crossing, nearest_of
from .growing import growing

STEP = 1.04
"""Ratio of neighbouring depths that are looked at: an island narrower than this may be missed."""
_CLOSED, _OUTSIDE = 1e-3, 0.02
_NEWTON, _SETTLED = 30, 1e-11
_TRIED = 12
"""Places where the determinant is small that are tried for a crossing, the smallest first."""
_APART = 1e-6
_SERVES = 0.2
"""Share of the last step that one with slopes kept may have."""
_LOOSE = 1e-5
_TURNS, _MARGIN = 30, 1.05
"""Steps of a power iteration, and by how much the norm may be larger than what it comes to."""

Closed = Callable[[Array, float], ComplexArray]
"""b·A at ν, (g,), and a depth b in m: (g, m, m)."""


@dataclass(frozen=True)
class Change:
    """A depth in m at which ``below`` growing vibrations become ``above``, and the crossing there."""

    crossing: Crossing
    below: int
    above: int


def changes(closed: Closed, fraction: Array, low: float, high: float, first: bool = False) -> tuple[Change, ...]:
    """Every change between two depths in m, or the ``first`` alone; nothing grows at ``low``.

    ``fraction`` are the ν to begin with, from 0 to 1/2.
    """
    return walked(partial(_count, closed, fraction), partial(_between, closed, fraction), low, high, first)


def walked(
    count: Callable[[float], int],
    between: Callable[[tuple[float, int], tuple[float, int]], list[Change]],
    low: float,
    high: float,
    first: bool,
) -> tuple[Change, ...]:
    """Every change between two depths in m, in steps of `STEP` at most, or the ``first`` from stable alone.

    ``count`` tells what grows at a depth, ``between`` the changes between two depths with their counts.
    """
    grid = np.geomspace(low, high, max(2, int(np.ceil(np.log(high / low) / np.log(STEP))) + 1))
    found = list[Change]()
    before, at = low, count(low)
    for depth in grid[1:].tolist():
        in_time()
        grows = count(depth)
        if grows != at:
            found += between((before, at), (depth, grows))
            if first and any(one.below == 0 for one in found):
                break
        before, at = depth, grows
    return tuple(found)


def stable_below(closed: Closed, fraction: Array, depth: float) -> float:
    """A depth in m up to which nothing grows, by the size of the loop: lowered from ``depth`` until it is below 1 there
    and at the half and the quarter of it.

    The size is the norm of the loop with every line in a unit of its own, which leaves its eigenvalues as they are: a
    line on which the tool hardly moves weighs little.
    """
    for _ in range(60):
        sizes = (_largest(closed(fraction, share * depth)) for share in (1.0, 0.5, 0.25))
        too_large = next((size for size in sizes if size >= 1), None)
        if too_large is None:
            break
        depth *= 0.95 / too_large
    return depth


def _largest(matrices: ComplexArray) -> float:
    """The largest norm of some matrices, rows and columns scaled against each other.

    By power iteration, which needs no decomposition and comes to within a few percent of it from below.
    """
    unit = np.sqrt(np.linalg.norm(matrices, axis=1))
    unit = np.maximum(unit, 1e-9 * np.max(unit, initial=1e-300))
    scaled = matrices * (unit[:, :, None] / unit[:, None, :])
    back = np.swapaxes(scaled.conj(), 1, 2)
    x = np.random.default_rng(0).standard_normal((*scaled.shape[:2], 1)) + 0j
    size = np.zeros(len(x))
    for _ in range(_TURNS):
        x = back @ (scaled @ (x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)))
        size = np.sqrt(np.linalg.norm(x, axis=(1, 2)))
    return _MARGIN * float(np.max(size, initial=0.0))


def settled(closed: Closed, crossing: Crossing, within: float = _OUTSIDE) -> Crossing:
    """The crossing of another loop near by: ν and b at which −1 is an eigenvalue of b·A; `NONE` where it has none."""
    return zero_near(lambda nu, b: nearest_of(closed(np.array([nu]), b)[0], -1.0)[0] + 1, crossing, within)


def zero_near(value: Callable[[float, float], complex], crossing: Crossing, within: float) -> Crossing:
    """The crossing where a function of ν and b, such as the distance of an eigenvalue from −1, is zero, near another
    one; `NONE` where there is none within so much of its depth.
    """
    nu, b = crossing.fraction, crossing.depth
    fixed = crossing.kind in ("flip", "fold")
    J, before = np.zeros((2, 2)), np.inf
    for _ in range(_NEWTON):
        here = value(nu, b)
        if not before < np.inf:  # the slopes are kept while they serve
            along_depth = (value(nu, b * (1 + _APART)) - here) / (_APART * b)
            along = 1j
            if not fixed:
                beside = nu + (_APART if nu < 0.25 else -_APART)
                along = (value(beside, b) - here) / (beside - nu)
            J = np.array([[along.real, along_depth.real], [along.imag, along_depth.imag]])
        if fixed:
            step = np.array([0.0, -here.real / J[0, 1] if J[0, 1] else np.nan])
        else:
            try:
                step = -np.linalg.solve(J, [here.real, here.imag])
            except np.linalg.LinAlgError:
                return NONE
        length = max(abs(step[1]) / b, abs(step[0]))
        before = length if length < _SERVES * before else np.inf
        if not np.all(np.isfinite(step)) or abs(b + step[1] - crossing.depth) > within * crossing.depth:
            return NONE
        nu, b = nu + float(step[0]), b + float(step[1])
        if not 0 <= nu <= 0.5:
            return NONE
        if abs(step[1]) <= _SETTLED * b and abs(step[0]) <= _SETTLED:
            break
    else:
        if abs(step[1]) > _LOOSE * b:
            return NONE
    if fixed and abs(value(nu, b)) > _CLOSED:
        return NONE
    return Crossing(b, nu, complex(-1 / b))


def _count(closed: Closed, fraction: Array, depth: float) -> int:
    return growing(lambda nu: closed(nu, depth), fraction)[0]


def _between(closed: Closed, fraction: Array, low: tuple[float, int], high: tuple[float, int]) -> list[Change]:
    """The changes between two depths with different counts, by halving and then exactly."""
    (a, below), (b, above) = low, high
    in_time()
    if b / a - 1 > _CLOSED:
        middle = float(np.sqrt(a * b))
        count = _count(closed, fraction, middle)
        found = _between(closed, fraction, low, (middle, count)) if count != below else []
        return found + (_between(closed, fraction, (middle, count), high) if count != above else [])
    middle = (a + b) / 2
    _, nu, size = growing(lambda nu: closed(nu, middle), fraction)
    ends = [Crossing(middle, nu[i], complex(-1 / middle)) for i in (0, -1)]
    ends.sort(key=lambda one: size[0] if one.fraction == 0 else size[-1])
    # The determinant is small near a crossing, and may be smaller where something else nearly crosses.
    low_at = 1 + np.flatnonzero((size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]))
    inner = [Crossing(middle, float(nu[i]), complex(-1 / middle)) for i in low_at[np.argsort(size[low_at])][:_TRIED]]
    tried = [*ends, *inner] if (above - below) % 2 else [*inner, *ends]
    for guess in tried:
        exact = settled(closed, guess, 4 * _CLOSED)
        if exact.kind:
            return [Change(exact, below, above)]
    return [Change(tried[0], below, above)]
