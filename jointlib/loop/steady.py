"""Periodic steady state of laws with memory, many segments of the period stepped at once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.law import JointLaw, MemorylessLaw, Motion

_Index: TypeAlias = NDArray[np.intp]
_SEGMENTS = 96
_FEWEST_STEPS = 8
_SAMPLES_AT_ONCE = 4_000_000
_TOLERANCE = 1e-10
_FORGOTTEN = 0.99
"""A period that keeps more than this share of a change of its start is no contraction to extrapolate by."""


def steady_force(law: JointLaw, displacement: Array, velocity: Array, time_step: float) -> Array:
    """Force in N of a law along periodic paths, time on the first axis, every internal state periodic too.

    Displacement in m and velocity in m/s broadcast; parameters of the law may be arrays that broadcast against the
    further axes of the paths. ``time_step`` in s.
    """
    z, v = np.broadcast_arrays(displacement, velocity)
    if isinstance(law, MemorylessLaw) or not law.states:
        return np.asarray(law.step(Motion(z, v, time_step), law.initial_state(z))[0])
    T, shape = len(z), np.broadcast_shapes(z.shape[1:], *(np.shape(x) for x in _values(law)))
    z, v = (np.broadcast_to(x, (T, *shape)) for x in (z, v))
    count = int(np.prod(shape))
    out = np.empty((T, count))
    width = max(1, _SAMPLES_AT_ONCE // T)
    for first in range(0, count, width):
        cases = np.arange(first, min(first + width, count))
        here, moving = (
            np.moveaxis(x, 0, -1)[np.unravel_index(cases, shape)].T if shape else x[:, None] for x in (z, v)
        )
        out[:, cases] = _settled(_chosen(law, cases, shape), here, moving, time_step)
    return out.reshape(z.shape)


def _settled(law: JointLaw, z: Array, v: Array, time_step: float) -> Array:
    """Steady force along paths (time, cases); array parameters of the law have one entry a case.

    The period is cut into segments that are stepped side by side. Each takes over the state in which the one before
    it ended, the first that of the last; only segments whose start has moved are stepped again, until none has. How
    far the end of a segment follows its start, seen from its last two runs, carries a change through the rest of the
    period at once: a law that forgets slowly (Dahl) settles in a handful of sweeps. Clamps (Jenkins) hand a change
    on from slip to slip, by few segments at a time.
    """
    T, cases = z.shape
    segments = max(k for k in range(1, min(_SEGMENTS, T // _FEWEST_STEPS or 1) + 1) if T % k == 0)
    steps = T // segments
    zs, vs = (_side_by_side(x, segments) for x in (z, v))
    # Virgin in the middle of the path: contacts that never slip then stay at rest from the first sweep on.
    start = np.tile(law.initial_state((z.max(axis=0) + z.min(axis=0)) / 2), (segments, 1))
    case = np.tile(np.arange(cases), segments)
    force, end = _stepped(_chosen(law, case), zs, vs, time_step, start)
    slope = np.where(end == start, 1.0, 0.0)
    target = np.roll(end, cases, axis=0)
    for _ in range(2 * segments):
        moved = np.flatnonzero(np.any(np.abs(target - start) > _TOLERANCE * np.abs(end).max(axis=0), axis=1))
        if not len(moved):
            break
        before, start = start, start.copy()
        start[moved] = target[moved]
        force[:, moved], after = _stepped(
            _chosen(law, case[moved]), zs[:, moved], vs[:, moved], time_step, start[moved]
        )
        change = start[moved] - before[moved]
        followed = (after - end[moved]) / np.where(change == 0, 1.0, change)
        slope[moved] = np.where(change == 0, slope[moved], np.clip(followed, 0.0, 1.0))
        end[moved] = after
        target = _handed_on(start, end, slope, segments)
    return np.moveaxis(force.reshape(steps, segments, cases), 0, 1).reshape(T, cases)


def _side_by_side(x: Array, segments: int) -> Array:
    """Paths (time, cases) as (steps, segments · cases): step i of every segment lies together in memory."""
    cut = np.moveaxis(x.reshape(segments, len(x) // segments, x.shape[1]), 1, 0)
    return np.ascontiguousarray(cut).reshape(len(x) // segments, -1)


def _stepped(law: JointLaw, z: Array, v: Array, time_step: float, state: Array) -> tuple[Array, Array]:
    force = np.empty(z.shape)
    for i in range(len(z)):
        force[i], state = law.step(Motion(z[i], v[i], time_step), state)
    return force, state


def _handed_on(start: Array, end: Array, slope: Array, segments: int) -> Array:
    """Starts of a periodic chain in which every end is end + slope · (change of start)."""
    S, E, m = (x.reshape(segments, -1) for x in (start, end, slope))
    rest = E - m * S
    offset, kept = np.zeros_like(rest[0]), np.ones_like(rest[0])
    for k in range(segments):
        offset, kept = rest[k] + m[k] * offset, m[k] * kept
    chain = np.empty_like(rest)
    chain[0] = np.where(kept < _FORGOTTEN, offset / np.where(kept < _FORGOTTEN, 1 - kept, 1.0), E[-1])
    for k in range(segments - 1):
        chain[k + 1] = rest[k] + m[k] * chain[k]
    return chain.reshape(start.shape)


def _values(law: JointLaw) -> Iterator[Any]:
    """Every parameter of a law, lists of them entry by entry."""
    for f in fields(law):  # type: ignore[arg-type]
        value = getattr(law, f.name)
        yield from value if isinstance(value, tuple) else (value,)


def _chosen(law: JointLaw, cases: _Index, shape: tuple[int, ...] | None = None) -> JointLaw:
    """The law with its array parameters (or arrays in lists of them) at some cases, after broadcasting to ``shape``."""

    def at(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(at(entry) for entry in value)
        if not isinstance(value, np.ndarray) or not value.ndim:
            return value
        return (value if shape is None else np.broadcast_to(value, shape).reshape(-1))[cases]

    return replace(law, **{f.name: at(getattr(law, f.name)) for f in fields(law)})  # type: ignore[arg-type, type-var]
