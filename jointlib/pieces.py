"""Laws with memory along long paths: pieces stepped side by side until each begins as the one before it ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array

Index: TypeAlias = NDArray[np.int64]

_SHORTEST = 64
"""Steps in a piece: most contacts forget within fewer how they were left."""
_WIDEST = 1024
"""Numbers side by side beyond which a step costs as much as they are many, so that pieces no longer pay."""
_SAME = 1e-12
"""States that differ by this fraction of the largest one are the same."""
_TOLD = 1e-9
"""Of the largest state; a beginning that moves by less does not tell by how much the end follows."""

_MOST_KNOWN = 16
_KNOWN: dict[tuple[object, ...], tuple[Array, Turns]] = {}
"""Paths whose turns were found last, by where they lie; a trace steps hundreds of laws along the same ones."""

Step = Callable[[Array, Array, Array], tuple[Array, Array]]
"""Displacement, velocity and state to what is wanted (the force, or the state itself) and the state after."""


def in_pieces(begin: Array, virgin: Callable[[Array], Array], step: Step, z: Array, v: Array) -> Array:
    """What ``step`` gives first along a path (time on the first axis) whose first step begins in the state ``begin``.

    A path of n steps is cut into pieces that are stepped together, first from guessed states, the virgin ones at the
    displacement before. A piece whose guess was not the end of the piece before it is stepped again from there.
    Contacts that slip forget their past, and of those that do not, or slowly, the state at the end of a piece is as
    good as linear in that at its beginning: two rounds tell the slope, and with it where all pieces after begin. The
    first piece is right at once and each round makes at least the next one right, so the result is that of one step
    after the other.
    """
    count = min(len(z) // _SHORTEST, _WIDEST // max(1, int(np.prod(z.shape[1:]))))
    if count < 2:
        return _one_by_one(step, begin, z, v)[0]
    length = -(-len(z) // count)
    pad = [(0, count * length - len(z))] + [(0, 0)] * (z.ndim - 1)
    Z, V = (np.pad(x, pad, mode="edge").reshape(count, length, *x.shape[1:]) for x in (z, v))
    start = np.concatenate([begin[None], virgin(Z[:-1, -1])])
    given, end = _one_by_one(step, start, np.moveaxis(Z, 0, 1), np.moveaxis(V, 0, 1))
    slope, known = np.zeros_like(end), np.zeros(end.shape, dtype=bool)
    while (behind := _elsewhere(start, np.concatenate([begin[None], end[:-1]]))).size:
        wanted = _beginnings(start, end, slope, int(behind[0]))
        again = np.union1d(behind[:1], _elsewhere(start, wanted))
        there = np.moveaxis(Z[again], 0, 1), np.moveaxis(V[again], 0, 1)
        moved, before = wanted[again] - start[again], end[again]
        start[again] = wanted[again]
        given[:, again], end[again] = _one_by_one(step, start[again], *there)
        told = np.abs(moved) > _TOLD * np.max(np.abs(wanted), axis=0)
        found = np.clip((end[again] - before) / np.where(told, moved, 1.0), -1.0, 1.0)
        slope[again], known[again] = np.where(told, found, slope[again]), known[again] | told
        slope[~known] = 1.0  # a piece that nothing told about may have been at rest
    return np.moveaxis(given, 1, 0).reshape(count * length, *given.shape[2:])[: len(z)]


def chained(factor: Array, added: Array, first: Array) -> Array:
    """x[i] = factor[i]·x[i − 1] + added[i] along the first axis, x[−1] = ``first``: pieces side by side, each as what
    it makes of its beginning, and then the beginnings one after the other."""
    length = max(1, int(np.sqrt(len(factor))))
    count = -(-len(factor) // length)
    pad = [(0, count * length - len(factor))] + [(0, 0)] * (factor.ndim - 1)
    shape = (count, length, *factor.shape[1:])
    a, x = (np.pad(y, pad, constant_values=value).reshape(shape) for y, value in ((factor, 1.0), (added, 0.0)))
    for i in range(1, length):
        x[:, i] += a[:, i] * x[:, i - 1]
        a[:, i] *= a[:, i - 1]
    begin = np.empty((count, *factor.shape[1:]))
    begin[0] = first
    for i in range(1, count):
        begin[i] = a[i - 1, -1] * begin[i - 1] + x[i - 1, -1]
    x += a * begin[:, None]
    return x.reshape(count * length, *factor.shape[1:])[: len(factor)]


def _beginnings(start: Array, end: Array, slope: Array, first: int) -> Array:
    """Where pieces from the ``first`` on begin if those before end as far from where they did as ``slope`` says.

    Never beyond all states that were met: no law answers for those that it does not reach.
    """
    wanted, met = start.copy(), np.concatenate([start, end])
    low, high = np.min(met, axis=0), np.max(met, axis=0)
    off = np.zeros_like(start[0])
    for i in range(first, len(start)):
        wanted[i] = np.clip(end[i - 1] + slope[i - 1] * off, low, high)
        off = wanted[i] - start[i]
    return wanted


def _elsewhere(start: Array, wanted: Array) -> NDArray[np.int64]:
    """Pieces that did not start where they should have, but for rounding."""
    apart = np.abs(wanted - start) > _SAME * np.max(np.abs(wanted), axis=0)
    return np.flatnonzero(apart.reshape(len(start), -1).any(axis=1))


@dataclass(frozen=True)
class Turns:
    """Where paths turn, each by itself; a path that many columns share has one that they broadcast from."""

    at: Index
    """Samples between which a path does not turn: the first, each at which it does, the last; (turn, *columns), those
    of a path with fewer turns filled up with its last sample."""
    since: Index
    """Which of them is the last one at or before each sample, (sample, *columns)."""

    def spread(self, values: Array, samples: slice) -> Array:
        """Values at the turns, (turn, *columns, …), at each of some samples the one at the turn before it."""
        since = self.since[samples]
        while since.ndim > 1 and since.shape[-1] == 1:
            since = since[..., 0]
        columns, inner = since.shape[1:], values.shape[since.ndim :]
        if values.shape[1 : since.ndim] != columns:
            return np.take_along_axis(values, since.reshape(*since.shape, *(1,) * len(inner)), axis=0)
        count = int(np.prod(columns))
        rows = values.reshape(len(values) * count, -1)
        flat = since.reshape(len(since), count) * count + np.arange(count)
        return np.take(rows, flat, axis=0).reshape(*since.shape, *inner)


def turns(z: Array) -> Turns:
    """Where paths turn (time on the first axis); of an array that nobody can write to it is remembered."""
    own = z[tuple(slice(0, 1) if step == 0 else slice(None) for step in (1, *z.strides[1:]))]
    fixed = not (own.flags.writeable or (isinstance(own.base, np.ndarray) and own.base.flags.writeable))
    key = (own.__array_interface__["data"][0], own.shape, own.strides)
    if fixed and (known := _KNOWN.get(key)) is not None:
        return known[1]
    found = _turns(own)
    if fixed:
        for old in list(_KNOWN)[: max(0, len(_KNOWN) + 1 - _MOST_KNOWN)]:
            _KNOWN.pop(old, None)  # another thread may have been faster
        _KNOWN[key] = own, found  # with the array, so that no other one has its place
    return found


def _turns(z: Array) -> Turns:
    columns, last = z.reshape(len(z), -1), len(z) - 1
    forward = np.sign(np.diff(columns, axis=0))
    turned = np.zeros(columns.shape, dtype=bool)
    turned[1:-1] = forward[1:] != forward[:-1]
    turned[[0, last]] = True
    since = np.cumsum(turned, axis=0) - 1
    at = np.full((int(since[-1].max()) + 1, columns.shape[1]), last)
    for column, out in zip(turned.T, at.T, strict=True):
        found = np.flatnonzero(column)
        out[: len(found)] = found
    return Turns(at.reshape(-1, *z.shape[1:]), since.reshape(z.shape))


def dragged(z: Array, reach: Array | float, first: Array) -> Array:
    """Where a slider stands after each step of a path, that the path drags along once it is farther than ``reach``.

    A step puts the slider at clip(s, z − reach, z + reach). One such step after another is such a step again, so the
    steps up to each sample are put together two by two, then four by four, until none remembers ``first``, or all are.
    """
    low, high = z - reach, z + reach
    done = 1
    while done < len(z) and np.any(low[done - 1 :] < high[done - 1 :]):
        floor, ceiling = low[done:], high[done:]
        low[done:], high[done:] = (np.minimum(np.maximum(x[:-done], floor), ceiling) for x in (low.copy(), high.copy()))
        done *= 2
    return np.minimum(np.maximum(first, low), high)


def _one_by_one(step: Step, state: Array, z: Array, v: Array) -> tuple[Array, Array]:
    """One step after the other: what each gives first, and the last state."""
    first, state = step(z[0], v[0], state)
    given = np.empty((len(z), *np.shape(first)))
    given[0] = first
    for i in range(1, len(z)):
        given[i], state = step(z[i], v[i], state)
    return given, state
