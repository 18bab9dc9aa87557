"""How fast vibration grows from one tooth to the next: the largest multiplier of maps of many samples.

Small maps are raised to a power and move a vector. Of long ones a block of vectors is carried through the stretches
(simultaneous iteration, Bauer 1957; Golub & Van Loan, Matrix Computations, ch. 7.3), which costs nodes and not their
cube; where it does not settle the map is put together and raised as a small one.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from jointlib.arrays import Array, ComplexArray

from ..indices import Index, Mask
from .passes import Single

_LONG = 56
"""States and nodes from which on vectors are carried."""
_VECTORS, _FIRST, _STRIDE, _TURNS = 8, 11, 3, 10
"""Vectors side by side, steps before the first look and, but for one, from one look to the next, and looks at most."""
_SHIFT = 1e-14
_SETTLED = 5e-4
"""By how much ln|μ| and arg μ change from one look to the next where they are believed."""
_SQUARED = 3
"""Squarings of a small map between two looks."""
_TIMES = 2**_SQUARED
"""By which a map so raised moves a vector before a look."""
_FLAT, _OVER = 1e-7, 3e-4
"""Square of the angle below which a vector and the next one are one, and by how much a map may be off, in parts of its
largest eigenvalue, for two vectors to stay among themselves where they are believed."""
_CARRIED = 64
"""Samples whose steps stay in the cache."""
_TINY = np.float32(1e-36)
FAR = 3.0
"""ln of depths beyond which nobody asks how far."""
_NEXT, _LEAST = 1.25, 0.3
"""Times a depth that stands alone, where the slope is looked at; share of the damping that the slope has at least."""
Real = npt.NDArray[np.floating[Any]]
"""Of single or double precision."""


def growth(steps: Sequence[Single], states: int) -> tuple[Array, Array]:
    """ln|μ| and |arg μ| in rad of the steps of a `passes.Pass`, one after the other, (samples,)."""
    if states + sum(step.shape[1] - states for step in steps) < _LONG:
        return multiplier(map_of(steps, states))
    pieces = range(0, len(steps[0]), _CARRIED)
    parts = [_carried([step[begin : begin + _CARRIED] for step in steps], states) for begin in pieces]
    rate, angle, sure = map(np.concatenate, zip(*parts, strict=True))
    left = np.flatnonzero(~sure)
    if len(left):
        rate[left], angle[left] = multiplier(map_of([step[left] for step in steps], states))
    return rate, angle


def map_of(steps: Sequence[Single], states: int) -> Single:
    """Steps one after the other: states and x over a tooth period of those before, (samples, rows, rows)."""
    if len(steps) == 1:
        return steps[0]
    size, begin = states + sum(step.shape[1] - states for step in steps), steps[0].shape[1]
    out = np.zeros((len(steps[0]), size, size), dtype=np.float32)
    out[:, :begin, :begin] = steps[0]
    for step in steps[1:]:
        end = begin + step.shape[1] - states
        out[:, begin:end, :begin] = step[:, states:, :states] @ out[:, :states, :begin]
        out[:, begin:end, begin:end] = step[:, states:, states:]
        out[:, :states, :begin] = step[:, :states, :states] @ out[:, :states, :begin]
        out[:, :states, begin:end] = step[:, :states, states:]
        begin = end
    return out


@np.errstate(over="ignore", invalid="ignore")
def _carried(steps: Sequence[Real], states: int) -> tuple[Array, Array, Mask]:
    """`growth` by a block of vectors, and of which samples it is believed."""
    left, rate, angle = np.arange(len(steps[0])), *np.zeros((2, len(steps[0])))
    sure = np.zeros(len(left), dtype=bool)
    edges = np.cumsum([0, steps[0].shape[1], *(step.shape[1] - states for step in steps[1:])])
    start = np.cos(np.arange(edges[-1] * _VECTORS).reshape(-1, _VECTORS) ** 1.5).astype(np.float32)
    block: Real = np.broadcast_to(start, (len(left), *start.shape)).copy()
    before = np.full((2, len(left)), np.inf)
    for turn in range(_TURNS):
        block = _after(steps, states, edges, block, _STRIDE if turn else _FIRST)
        fine = np.isfinite(np.max(np.abs(block), axis=(1, 2)))
        block = _upright(np.where(fine[:, None, None], block, 0.0))
        after = _after(steps, states, edges, block.astype(np.float32), 1)
        value = np.linalg.eigvals(block.swapaxes(1, 2) @ after)
        largest = np.take_along_axis(value, np.argmax(np.abs(value), axis=1)[:, None], axis=1)[:, 0]
        now = np.array([np.log(np.maximum(np.abs(largest), 1e-300)), np.abs(np.angle(largest))])
        rate[left], angle[left] = now
        done = (np.max(np.abs(now - before), axis=0) < _SETTLED) | ~fine
        sure[left[done & fine]] = True
        left, before, block = left[~done], now[:, ~done], after[~done]
        if not len(left):
            break
        steps = [step[~done] for step in steps]
    return rate, angle, sure


def _after(steps: Sequence[Real], states: int, edges: Index, block: Real, periods: int) -> Real:
    """Vectors, (samples, states + n, vectors), some tooth periods later."""
    parts = [block[:, begin:end] for begin, end in pairwise(edges)]
    parts[1:] = [np.concatenate([block[:, :states], part], axis=1) for part in parts[1:]]
    state = parts[0][:, :states]
    for _ in range(periods):
        for k, step in enumerate(steps):
            parts[k][:, :states] = state
            parts[k] = step @ parts[k]
            state = parts[k][:, :states]
    parts[1:] = [part[:, states:] for part in parts[1:]]
    out = np.concatenate(parts, axis=1)
    out[:, :states] = state
    return out


def _upright(block: Real) -> Real:
    """An orthonormal basis of vectors, (samples, n, vectors), by the Cholesky factor of their products.

    What of a vector is lost in those before it stays short, and adds no multiplier.
    """
    block = block.astype(float)
    block /= np.maximum(np.max(np.abs(block), axis=(1, 2), keepdims=True), 1e-300)
    products = block.swapaxes(1, 2) @ block
    size = np.trace(products, axis1=1, axis2=2)[:, None, None]
    root = np.linalg.cholesky(products + _SHIFT * (size + _SHIFT) * np.eye(block.shape[2]))
    return np.asarray(block @ np.linalg.inv(root).swapaxes(1, 2))


def multiplier(passing: Real) -> tuple[Array, Array]:
    """ln|μ| and |arg μ| in rad of the largest eigenvalue of maps, (samples, n, n) → (samples,).

    After many steps what grows most is left of a vector, and two steps more tell the largest eigenvalue, or the pair.
    Where they leave something over it takes many more steps; where that does not help, more than two are alike, and how
    much longer the vector became in them is believed.
    """
    power, grown = _raised(passing)
    start = np.cos(np.arange(passing.shape[2], dtype=np.float32) ** 1.5)[:, None]
    vector = _moved(power, np.broadcast_to(start, (len(passing), *start.shape)))[0]
    value, sure = _largest(passing, vector)
    rate, left = np.log(np.abs(value) + _TINY), np.flatnonzero(~sure)
    if len(left):
        power, by_power = _raised(power[left])
        vector, by_vector = _moved(power, vector[left])
        value[left], sure[left] = _largest(passing[left], vector)
        by_length = (_TIMES * grown[left] + by_power + by_vector / _TIMES) / _TIMES**2
        rate[left] = np.where(sure[left], np.log(np.abs(value[left]) + _TINY), by_length)
    return rate, np.abs(np.angle(value))


def _raised(power: Real) -> tuple[Real, Array]:
    """Maps squared a few times, of size 1, and ln of their size, (samples,)."""
    power, grown = _sized(power @ power)
    for _ in range(_SQUARED - 1):
        power = power @ power
    power, more = _sized(power)
    return power, _TIMES // 2 * grown + more


def _sized(power: Real) -> tuple[Real, Array]:
    """Maps or vectors made of size 1, in place, and ln of their size, (samples,)."""
    size = _size(power)
    power *= (1 / size)[:, None, None]
    return power, np.log(size)


def _moved(power: Real, vector: Real) -> tuple[Real, Array]:
    """Vectors after some steps, of length 1, and ln of how much longer they became, (samples, n, 1), (samples,)."""
    grown = -np.log(_size(vector))
    for _ in range(_TIMES // 2):
        vector, longer = _sized(power @ (power @ vector))
        grown += longer
    return vector, grown


def _largest(passing: Real, vector: Real) -> tuple[ComplexArray, Mask]:
    """The largest eigenvalue of maps, and whether they move the vector by it and no more than one other."""
    one = passing @ vector
    moved = np.concatenate([vector, one, passing @ one], axis=2).astype(float)
    products = moved.swapaxes(1, 2) @ moved
    bb, ab, cb, aa, ca, cc = (products[:, i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
    full = aa * bb - ab**2
    flat = full < _FLAT * aa * bb
    safe = np.where(flat, 1.0, full)
    alpha, beta = (ca * bb - cb * ab) / safe, (cb * aa - ca * ab) / safe
    root = np.sqrt((alpha / 2) ** 2 + beta + 0j)
    largest = alpha / 2 + np.where(alpha < 0, -root, root)
    over = cc - alpha * ca - beta * cb
    sure = flat | (over * bb < _OVER**2 * full * np.abs(largest) ** 2)
    return np.where(flat, ab / np.maximum(bb, _TINY), largest), sure


def asked_of(ladder: Array) -> Array:
    """Depths in m at which growth is looked at for `to_border`: one that stands alone has another beside it."""
    return np.append(ladder, _NEXT * ladder[0]) if len(ladder) == 1 else ladder


def to_border(grown: Array, ladder: Array, poles: ComplexArray, tooth_frequency: float) -> Array:
    """ln(b_lim/b) at depths in m from ln|μ| at those `asked_of` them, by the slope towards where it is zero.

    The slope is believed down to a share of what the least damped of ``poles`` in rad/s, (samples, modes), loses in a
    tooth period.
    """
    least = _LEAST * np.min(-poles.real, axis=1) / tooth_frequency
    slope = np.diff(grown, axis=1) / np.diff(np.log(asked_of(ladder)))
    up = np.concatenate([slope, slope[:, -1:]], axis=1)
    down = np.concatenate([slope[:, :1], slope], axis=1)
    toward = np.maximum(np.where(grown < 0, up, down), least[:, None])
    return np.asarray(np.clip(-grown / toward, -FAR, FAR))[:, : len(ladder)]


def _size(power: Real) -> Real:
    """Frobenius norm, (samples,)."""
    flat = power.reshape(len(power), -1)
    return np.asarray(np.sqrt(np.maximum(np.einsum("si,si->s", flat, flat), _TINY)))
