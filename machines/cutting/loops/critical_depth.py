"""The first crossing of the stability boundary where the cut varies in time, at one spindle speed.

Vibration e^(jωt)·(periodic with the tooth) keeps itself alive at depth w where

    1 + w·λ·(1 − e^(−jωτ)) = 0,   λ(ω) an eigenvalue of the loop over one tooth period.

Each λ is followed over ν = ωτ/2π in (0, 1/2]; w = −1/(λ(1 − e^(−2πjν))) belongs to the boundary where it is real and
positive. Inside the interval that is a Hopf crossing, at ν = 1/2 a flip (period doubling). The lowest w over all
branches is the first crossing from zero depth: no scan over depths is made, so islands and lenses do not hide it.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice
from math import isnan, nan

import numpy as np

from jointlib.arrays import Array, ComplexArray

from .beside_half import TURNED, parted
from .loop_branches import HALF, NONE, Bracket, Crossing, Iterated, Loop, brackets, closed, nearest, regeneration
from .loop_samples import samples

_LEVELS = (0.6, 0.3, 0.15, 0.07, 0.02, 0.004, 5e-4)
"""Shares of the strongest loop down to which branches are followed, one after the other until a crossing is found."""
_AT_ONCE = 0.02
"""Share of the strongest loop from which on branches are followed down to a ceiling at once."""
_ROUNDS = 10
_APART = 0.5
_REAL = 1e-8
_CLOSE = 1.1


def first_crossings(
    loop: Loop, fraction: Array, accepted: Callable[[Crossing], bool] | None = None, ceiling: float = np.inf
) -> list[Crossing]:
    """The lowest depth at which an eigenvalue of the loop closes on itself, and those up to a tenth above it.

    Only those that are ``accepted`` count, by default all; depths over a tenth above ``ceiling`` (m) are not searched.

    ``fraction`` are the ν to begin with, ascending, the last one 1/2; intervals over which an eigenvalue that may hold
    the lowest crossing turns by more than a third of itself, or is not told from its neighbour, are halved. Where a
    norm of the loop shows that no eigenvalue can matter, none is computed.
    """
    fraction = np.append(fraction[fraction < TURNED], [TURNED, 0.5])
    known = samples(loop, fraction)
    level = _LEVELS[0] * float(np.max(known.bound))
    known.know(fraction == fraction[-1], level)
    found = _flips(known.values[-1], accepted, max(level, 1 / (_CLOSE * ceiling)))
    closings: dict[Bracket, Crossing | None] = {}  # every level meets again most of those of the levels above it
    at_once = _CLOSE * ceiling * _AT_ONCE * float(np.max(known.bound)) <= 1
    for share in (0.0,) if at_once else _LEVELS:
        level = max(share * float(np.max(known.bound)), 1 / (_CLOSE * _lowest(found, ceiling)))
        for _ in range(_ROUNDS):
            matters = (known.bound[:-1] >= level) | (known.bound[1:] >= level)
            known.know(np.append(matters, True) | np.insert(matters, 0, False), level)
            matters[-1] = False  # branches that are real at 1/2 are not to be told from real next to it
            between, coarse = brackets(known.fraction, known.values, matters, level, known.looked)
            if not coarse.any():
                break
            known.halve(coarse, level)
        found = _flips(known.values[-1], accepted, level)
        for bracket in sorted(between, key=lambda one: one.floor):
            if bracket.floor > _CLOSE * _lowest(found, ceiling):
                break
            if bracket not in closings:
                closed_at = closed(loop, bracket)
                counts = closed_at is not None and (accepted is None or accepted(closed_at))
                closings[bracket] = closed_at if counts else None
            if (crossing := closings[bracket]) is not None:
                found.append(crossing)
        if 1 / (_CLOSE * _lowest(found, ceiling)) >= level:
            break
    found = found or _flips(known.values[-1], accepted, 1 / (_CLOSE * ceiling))
    lowest = _lowest(found, ceiling)
    return sorted({one for one in found if one.depth <= _CLOSE * lowest}, key=lambda one: one.depth)


def _lowest(found: list[Crossing], ceiling: float) -> float:
    return min([ceiling, *(one.depth for one in found)])


def near(loop: Loop, crossing: Crossing) -> Crossing:
    """The same crossing of a finer loop; a loop that does not have it near by gives `NONE`."""
    nu = crossing.fraction
    if crossing.kind == "flip":
        value, carried = nearest(loop, 0.5, crossing.eigenvalue)
        if abs(value.imag) > _REAL * abs(value) or value.real >= 0:
            return NONE
        return Crossing(-0.5 / value.real, 0.5, complex(value.real), carried)
    if isinstance(loop, Iterated) and (found := loop.crossing(crossing)) is not None:
        return found
    before, value, past = nan, crossing.eigenvalue, complex(nan)
    for _ in range(20):
        new, _ = nearest(loop, nu, value)
        if abs(new - value) > _APART * abs(value):
            return NONE
        turned = new * complex(regeneration(np.array(nu)))
        if abs(turned.imag) <= 1e-11 * abs(turned) or nu == before:
            # At 1/2 it has met its mirror image: flips from there on, of which it is not said which is lowest.
            return Crossing(-1 / turned.real, nu, new) if turned.real < 0 and nu < 0.5 - HALF else NONE
        if isnan(before):  # the slope of the first step, from close by
            before = nu * (1 - 1e-6)
            past = nearest(loop, before, value)[0] * complex(regeneration(np.array(before)))
        slope = (turned.imag - past.imag) / (nu - before)
        before, past, value = nu, turned, new
        nu = nu - turned.imag / slope if slope else nan
        if not 0 < nu < 0.5:
            return NONE
    return NONE


def lowest_near(finer: Loop, search: list[Crossing], fraction: Array, coarse: Loop) -> Crossing:
    """The lowest crossing of a finer loop, found from those of a coarser one.

    Where two crossings are about to meet, as two flips, or a flip and a Hopf crossing beside it, the finer loop may
    lack them: then it is searched itself. Or it has them where the coarser one does not: see `beside_half`.
    """
    found = [near(finer, one) for one in search]
    lowest = min(found, key=lambda one: one.depth, default=NONE)
    lost = any(not at.kind and one.depth < lowest.depth for one, at in zip(search, found, strict=True))
    again = first_crossings(finer, fraction, None, lowest.depth) if lost else parted(finer, coarse, lowest.depth)
    return min([lowest, *again], key=lambda one: one.depth)


def eigenvector(loop: Loop, crossing: Crossing) -> ComplexArray:
    """What the loop carries round at a crossing of its own, shape (m,)."""
    if isinstance(loop, Iterated) and crossing.carried is not None:
        return crossing.carried
    return nearest(loop, crossing.fraction, crossing.eigenvalue)[1]


def _flips(values: ComplexArray, accepted: Callable[[Crossing], bool] | None, level: float) -> list[Crossing]:
    """The two lowest period doublings, from the eigenvalues at ν = 1/2, down to the depth 1/``level`` in m."""
    real = values.real[(np.abs(values.imag) <= _REAL * np.max(np.abs(values))) & (values.real < -0.5 * level)]
    every = (Crossing(-0.5 / value, 0.5, complex(value)) for value in np.sort(real).tolist())
    return list(islice(every if accepted is None else filter(accepted, every), 2))
