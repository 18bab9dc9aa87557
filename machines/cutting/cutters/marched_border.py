"""The border of stability at one slow speed, by the multipliers of the march over one pattern.

The depths are those of `border`: walked through in steps, what grows is counted at each, and every change is closed in
on. What closes is a multiplier of size 1: the k-th largest one is continuous in the depth, so that between a depth at
which k grow and one at which more do it has a root.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np
import scipy

from ...deadline import in_time
from ..loops.loop_branches import NONE, Crossing
from .border import Change, walked
from .march import Marcher

_LOOK, _EXACT = 1e-5, 1e-12
"""Relative error in depth of a crossing that is looked for, and of one that is settled."""
_NEWTON, _BESIDE = 30, 1e-5
_REAL = 1e-9
_COUNTED, _NOTHING = 6, 1e-6
_TOLD = 1e-6
"""Relative error of multipliers that only tell whether something grows."""
_NEAR, _SOME = 0.98, 4
"""Size down to which multipliers may be the one that is settled, and how many beyond the rank of one are asked for."""


def changes(marcher: Marcher, low: float, high: float, first: bool = False) -> tuple[Change, ...]:
    """Every change between two depths in m, or the ``first`` from stable alone; ``low`` is halved where it grows."""
    count = lru_cache(maxsize=1)(partial(_count, marcher))
    while count(low) and low > _NOTHING * high:
        low /= 2
    return walked(count, partial(_between, marcher), low, high, first)


def settled(marcher: Marcher, crossing: Crossing, within: float) -> Crossing:
    """The same crossing with other nodes or modes, `NONE` where it is not within so much of the depth."""
    multiplier = np.exp(2j * np.pi * crossing.fraction)
    b, ends = crossing.depth, list[tuple[float, float]]()
    for _ in range(_NEWTON):
        in_time()
        every = marcher.at(b).multipliers(_NEAR)
        multiplier = every[np.argmin(np.abs(every - multiplier))]
        ends.append((b, float(np.log(abs(multiplier)))))
        if len(ends) == 1:
            b *= 1 + _BESIDE
            continue
        (a, of_a), (c, of_c) = ends[-2:]
        step = -of_c * (c - a) / (of_c - of_a) if of_c != of_a else np.nan
        b = c + step
        if not abs(b / crossing.depth - 1) <= within:
            return NONE
        if abs(step) <= _EXACT * b or abs(of_c) <= _EXACT:
            return _crossing(b, multiplier)
    return NONE


def _count(marcher: Marcher, depth: float) -> int:
    """How many grow, `_COUNTED` where more do: deep inside an unstable stretch it matters to nobody."""
    return int(np.count_nonzero(np.abs(marcher.at(depth).multipliers(tolerance=_TOLD)[:_COUNTED]) > 1))


def _between(marcher: Marcher, low: tuple[float, int], high: tuple[float, int]) -> list[Change]:
    """The changes between two depths with different counts, each where the multiplier of its rank passes the circle."""
    (a, below), (b, above) = low, high
    found, at = list[Change](), min(below, above)
    while at < max(below, above):
        depth = float(scipy.optimize.brentq(_size_of(marcher, at), a, b, xtol=_LOOK * a, rtol=_LOOK))
        crossing = _crossing(depth, marcher.at(depth).multipliers(count=at + _SOME)[at])
        more = 2 if crossing.kind == "hopf" else 1
        ends = (at, at + more) if above > below else (at + more, at)
        found.append(Change(crossing, *ends))
        at += more
    return sorted(found, key=lambda one: one.crossing.depth)


def _size_of(marcher: Marcher, rank: int) -> Callable[[float], float]:
    """ln of the size of the multiplier of a rank, by depth in m."""

    def size(depth: float) -> float:
        return float(np.log(abs(marcher.at(depth).multipliers(count=rank + _SOME)[rank])))

    return size


def _crossing(depth: float, multiplier: complex) -> Crossing:
    """A crossing at a depth in m, of a multiplier next to the unit circle."""
    nu = abs(float(np.angle(multiplier))) / (2 * np.pi)
    if abs(multiplier.imag) <= _REAL * abs(multiplier):
        nu = 0.0 if multiplier.real > 0 else 0.5
    return Crossing(depth, nu, complex(-1 / depth))
