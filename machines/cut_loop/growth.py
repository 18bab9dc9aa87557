"""How fast vibration grows from one tooth to the next: the largest multiplier of maps of many samples.

Small maps are raised to a high power. Of long ones a block of vectors is carried through the stretches (simultaneous
iteration, Bauer 1957; Golub & Van Loan, Matrix Computations, ch. 7.3), which costs nodes and not their cube; where it
does not settle the map is put together and raised as a small one.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from jointlib.arrays import Array

from ..indices import Index, Mask
from .passes import Single, map_of

_LONG = 56
"""States and nodes from which on vectors are carried."""
_VECTORS, _FIRST, _STRIDE, _TURNS = 8, 11, 3, 10
"""Vectors side by side, steps before the first look and, but for one, from one look to the next, and looks at most."""
_SHIFT = 1e-14
_SETTLED = 5e-4
"""By how much ln|μ| and arg μ change from one look to the next where they are believed."""
_SQUARED = 9
"""A small map is raised to two to this."""
_PIECE, _CARRIED = 64, 64
"""Samples whose powers, or steps, stay in the cache."""
_TINY = np.float32(1e-36)
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

    Powers of the map show how it grows, and two steps of what is left of a vector turn by its angle. The powers are
    of single precision, whose error in ln|μ| is a hundredth of what 512 steps leave where two multipliers are alike.
    """
    parts = [_raised(passing[begin : begin + _PIECE]) for begin in range(0, len(passing), _PIECE)]
    rate, vector, one, two = (np.concatenate(column) for column in zip(*parts, strict=True))
    aa, ab, bb = (np.sum(p * q, axis=1) for p, q in ((one, one), (one, vector), (vector, vector)))
    ca, cb = np.sum(two * one, axis=1), np.sum(two * vector, axis=1)
    full = aa * bb - ab**2
    flat = full < 1e-10 * aa * bb
    safe = np.where(flat, 1.0, full)
    alpha, beta = (ca * bb - cb * ab) / safe, (cb * aa - ca * ab) / safe
    root = np.sqrt((alpha / 2) ** 2 + beta + 0j)
    pair = np.stack([alpha / 2 + root, alpha / 2 - root])
    largest = np.take_along_axis(pair, np.argmax(np.abs(pair), axis=0)[None], axis=0)[0]
    return rate, np.abs(np.angle(np.where(flat, np.where(ab > 0, 1.0, -1.0), largest)))


def _raised(passing: Real) -> tuple[Array, Array, Array, Array]:
    """By how much a step grows in ln, (samples,), and what many of them leave of a vector with two steps from it."""
    size = _size(passing)
    passing = passing / size[:, None, None]
    power = passing.astype(np.float32)
    spare, grown = np.empty_like(power), np.log(size)
    before = grown
    for squared in range(1, _SQUARED + 1):
        power, spare = np.matmul(power, power, out=spare), power
        before, grown = grown, 2 * grown
        # Twice in a row it stays far above the smallest number of single precision.
        if squared % 2 == 0 or squared >= _SQUARED - 1:
            lost = _size(power)
            power /= lost[:, None, None]
            grown = grown + np.log(lost)
    rate = (grown - before) / 2 ** (_SQUARED - 1)
    vector = (power @ np.cos(np.arange(power.shape[2], dtype=np.float32) ** 1.5)).astype(float)
    one = np.einsum("sij,sj->si", passing, vector)
    return rate, vector, one, np.einsum("sij,sj->si", passing, one)


def _size(power: Real) -> Real:
    """Frobenius norm, (samples,)."""
    flat = power.reshape(len(power), -1)
    return np.asarray(np.sqrt(np.maximum(np.einsum("si,si->s", flat, flat), _TINY)))
