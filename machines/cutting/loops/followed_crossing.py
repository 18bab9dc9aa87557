"""One crossing of a loop of many lines: the strong lines are solved for, the weak ones follow them.

Newton's method in the vector x, ν and the depth w of

    F = x + w·(1 − e^(−2πjν))·A(ν)·x = 0,   |x| = 1.

A step is solved for on the strong lines alone, where the gain round the loop, w·|1 − e^(−2πjν)|·|H|·|G|, is about 1 or
more; the others only follow and take one product A·x a round. A(ν) is straight in ν until it is asked for again.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import zgetrf, zgetrs

from jointlib.arrays import ComplexArray

from .loop_branches import Crossing, regeneration
from .multi_frequency import HarmonicLoop, stiffest_direction
from .strong_lines import StrongLines

Product = Callable[[ComplexArray], ComplexArray]

_FOLLOWS = 0.35
"""Gain round the loop up to which a line follows the others."""
_ROUNDS, _STRAIGHT = 60, 6
"""Steps along one straight A(ν), and how often that is drawn."""
_BESIDE = 1e-5
"""Share of ν within which A is taken as straight for its slope."""
_SETTLED, _DRAWN = 1e-13, 1e-8
"""|F| of a crossing, and of one from which A is asked for again."""
_STAYS = 1e-9
"""Move of ν from where A was asked for up to which its bend is nothing."""
_CLOSE = 0.05
"""Share of the depth, and of a tooth frequency, within which a crossing is the one that was meant."""


def followed_crossing(
    loop: HarmonicLoop, product: Callable[[ComplexArray], Product], crossing: Crossing
) -> Crossing | None:
    """The Hopf crossing of a loop close to a guess, with its vector; None where the weak lines do not just follow.

    ``product`` makes x → A·x of G on the lines, (lines, n, n).
    """
    nu, depth = crossing.fraction, crossing.depth
    lines, turn = loop.lines(np.array([nu]))[0], _turn(nu)
    stiffest = stiffest_direction(loop.cutting, loop.axes)
    strong = depth * abs(turn) * stiffest * np.linalg.norm(lines, axis=1) >= _FOLLOWS
    if not 0 < np.count_nonzero(strong) <= strong.size / 2:
        return None
    rows, among = strong.ravel(), StrongLines(loop, strong)(np.array([nu]))[0]
    factors, pivots, _ = zgetrf(np.eye(len(among)) + depth * turn * among)

    def step(left: ComplexArray) -> ComplexArray:
        solved = left.copy()
        solved[rows] = zgetrs(factors, pivots, left[rows])[0]
        return solved

    x = np.zeros(len(rows), dtype=complex)
    x[rows] = np.exp(1j * np.arange(len(among)) ** 2)
    for _ in range(2):
        x = step(x)
        x /= np.linalg.norm(x)
    for _ in range(_STRAIGHT):
        origin, beside = nu, nu * (1 + _BESIDE)
        slope = (loop.lines(np.array([beside]))[0] - lines) / (beside - origin)
        for first in range(_ROUNDS):
            turn = _turn(nu)
            carried = product(lines + slope * (nu - origin))(x)
            left = x + depth * turn * carried
            if not first:
                steeper = 2j * np.pi * (1 - turn) * carried + turn * product(slope)(x)
                along = step(depth * steeper), step(turn * carried)
            size, back = float(np.linalg.norm(left)), step(left)
            a, b, c = (complex(np.vdot(x, part)) for part in (back, *along))
            area = b.real * c.imag - b.imag * c.real
            if not area:
                return None
            further, deeper = (a.imag * c.real - a.real * c.imag) / area, (a.real * b.imag - a.imag * b.real) / area
            nu, depth = nu + further, depth + deeper
            if not (abs(nu - crossing.fraction) <= _CLOSE and abs(depth - crossing.depth) <= _CLOSE * crossing.depth):
                return None
            x = x - back - further * along[0] - deeper * along[1]
            x /= np.linalg.norm(x)
            if size <= (_SETTLED if abs(nu - origin) <= _STAYS else _DRAWN):
                break
        else:
            return None
        if abs(nu - origin) <= _STAYS:
            return Crossing(depth, nu, -1 / (depth * _turn(nu)), x)
        lines = loop.lines(np.array([nu]))[0]
    return None


def _turn(fraction: float) -> complex:
    return complex(regeneration(np.array(fraction)))
