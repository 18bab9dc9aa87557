"""Every crossing of the stability boundary up to a depth, and whether the cut above it is the worse or the better one.

Along a branch of the loop, with ν = ωτ/2π and W(ν) = −1/(λ(ν)·(1 − e^(−2πjν))) the depth that closes it, the multiplier
μ = e^(2πjν) leaves the unit circle as depth grows where Im dW/dν > 0, and comes back where it is negative. A Hopf
crossing moves a pair of multipliers, a flip one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import CheckFailed

from ...deadline import in_time
from ...indices import Mask
from . import crossing, loop_branches
from .crossing import Brackets
from .loop_branches import Bracket, Crossing, Loop, nearest, regeneration
from .loop_samples import samples
from .regeneration import Loops, Trace, limiting_depth

_PAST = 1.3
_ROUNDS = 16
_NEXT = 1e-6
_REAL = 1e-8
_SAME = 1e-7
_SLOPE = 1e-7


@dataclass(frozen=True)
class Edge:
    """A crossing of |μ| = 1: its depth in m, its ν, its kind, and whether it ends what is stable (as depth grows)."""

    depth: float
    fraction: float
    kind: str
    outwards: bool
    eigenvalue: complex = complex(np.nan)

    @property
    def moved(self) -> int:
        """By how many the multipliers outside the unit circle grow."""
        return (2 if self.kind == "hopf" else 1) * (1 if self.outwards else -1)

    @property
    def crossing(self) -> Crossing:
        """As the solver of one crossing takes it."""
        return Crossing(self.depth, self.fraction, self.eigenvalue)


def edges_of_loop(loop: Loop, fraction: Array, deepest: float) -> list[Edge]:
    """The crossings of a periodic cut up to ``deepest`` (m), by depth; ``fraction`` as in `first_crossings`."""
    level = 1 / (_PAST * deepest)
    nu = np.append(fraction[fraction < 0.5 - _NEXT], [0.5 - _NEXT, 0.5])
    known = samples(loop, nu)
    brackets: list[Bracket] = []
    for _ in range(_ROUNDS):
        in_time()
        matters = (known.bound[:-1] >= level) | (known.bound[1:] >= level)
        needed = np.append(matters, False) | np.insert(matters, 0, False)
        needed[-2:] = True
        known.know(needed, level)
        matters[-1] = False  # branches are real at 1/2, or not to be told from real next to it
        brackets, coarse = loop_branches.brackets(known.fraction, known.values, matters, level, known.looked)
        if not coarse.any():
            break
        known.halve(coarse, level)
    found = _flips(loop, known.values[-1], float(known.fraction[-2]))
    found += [edge for one in brackets if (edge := _hopf(loop, one)) is not None]
    return _distinct([edge for edge in found if edge.depth <= deepest])


def edges_of_trace(loops: Loops, traced: Trace, period: Array, deepest: Array) -> list[list[Edge]]:
    """The crossings of one cut that is the same at all times, turning or zero order, for every period τ in s."""
    within = crossing.brackets(traced, period[None], lambda passed: _within(traced, passed, deepest))
    frequency, value, _ = crossing.closed(loops, traced, within, period[None])
    depth = limiting_depth(value)
    kept = np.isfinite(depth) & (depth <= deepest[within.speed])
    frequency, value, depth, speed = frequency[kept], value[kept], depth[kept], within.speed[kept]
    found: list[list[Edge]] = [[] for _ in period]
    if not len(depth):
        return found
    inside = frequency * (1 - _SLOPE) > traced.frequency[0]
    near = frequency * np.where(inside, 1 - _SLOPE, 1 + _SLOPE)
    values = loops(near, np.zeros(len(near), dtype=np.intp))
    beside = values[np.arange(len(near)), np.argmin(np.abs(values - value[:, None]), axis=1)]
    slope = -(beside * regeneration(near * period[speed])).imag * np.where(inside, 1, -1)
    for i, d, f, s, v in zip(speed.tolist(), depth.tolist(), frequency.tolist(), slope, value.tolist(), strict=True):
        found[i].append(Edge(d, f * float(period[i]), "hopf", bool(s > 0), v))
    return [_distinct(edges) for edges in found]


def _within(traced: Trace, found: Brackets, deepest: Array) -> Mask:
    """Whether the lowest conceivable depth of a bracket is no deeper than ``deepest``."""
    before = traced.eigenvalue[found.row, found.branch]
    after = traced.eigenvalue[found.row + 1, found.branch]
    strongest = np.maximum(-before.real, -after.real) + np.abs(after - before)
    return np.asarray(2 * deepest[found.speed] * strongest >= 1)


def _hopf(loop: Loop, bracket: Bracket) -> Edge | None:
    found = loop_branches.closed(loop, bracket)
    if found is None:
        return None
    rising = _turned(bracket.end, bracket.right) > _turned(bracket.start, bracket.left)
    return Edge(found.depth, found.fraction, "hopf", rising, found.eigenvalue)


def _turned(value: complex, fraction: float) -> float:
    return float((value * complex(regeneration(np.array(fraction)))).imag)


def _flips(loop: Loop, values: ComplexArray, beside: float) -> list[Edge]:
    """Period doublings, from the eigenvalues at ν = 1/2; the sign from the branch just below it."""
    real = values.real[(np.abs(values.imag) <= _REAL * np.max(np.abs(values))) & (values.real < 0)]
    real = real[np.abs(real) > _REAL * np.max(np.abs(values))]
    if not len(real):
        return []
    found = []
    for v in real.tolist():
        before, _ = nearest(loop, beside, complex(v))
        found.append(Edge(-0.5 / v, 0.5, "flip", _turned(before, beside) < 0, complex(v)))
    return found


def _distinct(edges: list[Edge]) -> list[Edge]:
    """By depth, a crossing that was closed from both sides once."""
    kept: list[Edge] = []
    for edge in sorted(edges, key=lambda one: one.depth):
        twin = (
            abs(one.depth - edge.depth) <= _SAME * edge.depth and abs(one.fraction - edge.fraction) <= _SAME
            for one in kept
        )
        if not any(twin):
            kept.append(edge)
    return kept


def outside(edges: list[Edge]) -> list[int]:
    """How many multipliers are outside the unit circle above each crossing."""
    count = np.cumsum([edge.moved for edge in edges], dtype=int).tolist()
    if min(count, default=0) < 0:
        raise CheckFailed("lobes: a crossing of the stability boundary was missed")
    return list(count)
