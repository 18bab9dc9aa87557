"""One crossing of a loop of many lines: the strong lines are solved for, the weak ones follow them.

Newton's method in the vector x, ν and the depth w of

    F = x + w·(1 − e^(−2πjν))·A(ν)·x = 0,   c·x = 1.

A step is solved for on the strong lines alone, where the gain round the loop, w·|1 − e^(−2πjν)|·|H|·|G|, is about 1 or
more; the others only follow and take one product A·x a round. A(ν) is straight in ν until it is asked for again.
Rounds are mixed, so that few are taken.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .folded_lines import TURNED, first_vector, strong_step
from .loop_branches import HALF, NONE, Crossing, regeneration
from .mixing import mixed
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

    Where it has met its mate, which is its mirror image in ν = 1/2, they are flips from there on, and it is `NONE`. A
    guess may carry the vector of fewer lines.

    ``product`` makes x → A·x of G on the lines, (lines, n, n).
    """
    nu, depth = crossing.fraction, crossing.depth
    lines, beside = loop.lines(nu * np.array([1, 1 + _BESIDE]))
    slope, turn = (beside - lines) / (_BESIDE * nu), _turn(nu)
    stiffest = stiffest_direction(loop.cutting, loop.axes)
    strong = depth * abs(turn) * stiffest * np.linalg.norm(lines, axis=1) >= _FOLLOWS
    if not 0 < np.count_nonzero(strong) <= strong.size / 2:
        return None
    rows, among = strong.ravel(), StrongLines(loop, strong)(np.array([nu]))[0]
    step = strong_step(np.eye(len(among)) + depth * turn * among, rows)
    known = crossing.carried
    x = first_vector(step, rows) if known is None else np.pad(known, (len(rows) - len(known)) // 2)
    of = x.conj()
    steep = product(slope)
    for _ in range(_STRAIGHT):
        origin, places, moves = nu, list[Array](), list[Array]()
        for _ in range(_ROUNDS):
            turn = _turn(nu)
            carried = product(lines + slope * (nu - origin))(x)
            left = x + depth * turn * carried
            size = float(np.linalg.norm(left) / np.linalg.norm(x))
            if size <= (_SETTLED if abs(nu - origin) <= _STAYS else _DRAWN):
                break
            if not moves:
                steeper = 2j * np.pi * (1 - turn) * carried + turn * steep(x)
                along = step(depth * steeper), step(turn * carried)
            back = step(left)
            a, b, c = (complex(of @ part) for part in (back, *along))
            area = b.real * c.imag - b.imag * c.real
            if not area:
                return None
            further, deeper = (a.imag * c.real - a.real * c.imag) / area, (a.real * b.imag - a.imag * b.real) / area
            places.append(np.append(x.view(float), [nu, depth / crossing.depth]))
            move = -back - further * along[0] - deeper * along[1]
            moves.append(np.append(move.view(float), [further, deeper / crossing.depth]))
            new = mixed(places, moves)
            x, nu, depth = new[:-2].view(complex), float(new[-2]), float(new[-1]) * crossing.depth
            if not (abs(nu - crossing.fraction) <= _CLOSE and abs(depth - crossing.depth) <= _CLOSE * crossing.depth):
                return None
        else:
            return None
        if np.linalg.norm(x) > TURNED:
            return None
        if abs(nu - origin) <= _STAYS:
            if abs(nu - 0.5) <= HALF:
                return NONE
            if nu > 0.5:
                nu, x = 1 - nu, x.reshape(len(lines), -1)[::-1].conj().ravel()
            return Crossing(depth, nu, -1 / (depth * _turn(nu)), x / np.linalg.norm(x))
        lines = loop.lines(np.array([nu]))[0]
    return None


def _turn(fraction: float) -> complex:
    return complex(regeneration(np.array(fraction)))
