"""Laws with memory along long paths: pieces stepped side by side until each begins as the one before it ended."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array

_SHORTEST = 128
"""Steps in a piece: most contacts forget within fewer how they were left."""
_WIDEST = 1024
"""Numbers side by side beyond which a step costs as much as they are many, so that pieces no longer pay."""
_SAME = 1e-12
"""States that differ by this fraction of the largest one are the same."""

Step = Callable[[Array, Array, Array], tuple[Array, Array]]
"""Displacement, velocity and state to what is wanted (the force, or the state itself) and the state after."""


def in_pieces(begin: Array, virgin: Callable[[Array], Array], step: Step, z: Array, v: Array) -> Array:
    """What ``step`` gives first along a path (time on the first axis) whose first step begins in the state ``begin``.

    A path of n steps is cut into pieces that are stepped together, first from guessed states, the virgin ones at the
    displacement before. A piece whose guess was not the end of the piece before it is stepped again from there, until
    none is left: contacts that slip forget their past, so that two rounds mostly do. The first piece is right at once
    and each round makes at least the next one right, so the result is that of one step after the other.
    """
    count = min(len(z) // _SHORTEST, _WIDEST // max(1, int(np.prod(z.shape[1:]))))
    if count < 2:
        return _one_by_one(step, begin, z, v)[0]
    length = -(-len(z) // count)
    pad = [(0, count * length - len(z))] + [(0, 0)] * (z.ndim - 1)
    Z, V = (np.pad(x, pad, mode="edge").reshape(count, length, *z.shape[1:]) for x in (z, v))
    start = np.concatenate([begin[None], virgin(Z[:-1, -1])])
    given, end = _one_by_one(step, start, np.moveaxis(Z, 0, 1), np.moveaxis(V, 0, 1))
    while (again := _elsewhere(start, begin, end)).size:
        start[again] = np.concatenate([begin[None], end[:-1]])[again]
        there = np.moveaxis(Z[again], 0, 1), np.moveaxis(V[again], 0, 1)
        given[:, again], end[again] = _one_by_one(step, start[again], *there)
    return np.moveaxis(given, 1, 0).reshape(count * length, *given.shape[2:])[: len(z)]


def _elsewhere(start: Array, begin: Array, end: Array) -> NDArray[np.int64]:
    """Pieces that did not start where the one before them has ended, but for rounding."""
    wanted = np.concatenate([begin[None], end[:-1]])
    apart = np.abs(wanted - start) > _SAME * np.max(np.abs(wanted), axis=0)
    return np.flatnonzero(apart.reshape(len(start), -1).any(axis=1))


def turns(z: Array) -> NDArray[np.int64]:
    """Samples between which no path turns: the first, the last, and each at which one of the paths does."""
    forward = np.sign(np.diff(z, axis=0)).reshape(len(z) - 1, -1)
    turned = (forward[1:] != forward[:-1]).any(axis=1)
    return np.concatenate([[0], np.flatnonzero(turned) + 1, [len(z) - 1]])


def _one_by_one(step: Step, state: Array, z: Array, v: Array) -> tuple[Array, Array]:
    """One step after the other: what each gives first, and the last state."""
    first, state = step(z[0], v[0], state)
    given = np.empty((len(z), *np.shape(first)))
    given[0] = first
    for i in range(1, len(z)):
        given[i], state = step(z[i], v[i], state)
    return given, state
