"""Periodic steady state of laws with memory, many segments of the period stepped at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.law import JointLaw, MemorylessLaw, Motion

_Index: TypeAlias = NDArray[np.intp]
_SEGMENTS = 160
_FEWEST_STEPS = 8
_SAMPLES_AT_ONCE = 4_000_000
_TOLERANCE = 1e-10
_FORGOTTEN = 1 - _TOLERANCE
"""A period that keeps more than this share of a change of its start keeps it all: nothing to extrapolate by."""
_MOST_RUNS = 24
"""Our laws settle in a dozen at most, but for a contact that all but never slips: what drifts on is its mean alone."""
_CARRIED = 1e-3
"""Of the travel: a state that goes with the joint within this share is taken to keep what it was before."""


def steady_force(law: JointLaw, displacement: Array, velocity: Array, time_step: float) -> Array:
    """Force in N of a law along periodic paths, time on the first axis, every internal state periodic too.

    Displacement in m and velocity in m/s broadcast; parameters of the law may be arrays that broadcast against the
    further axes of the paths. ``time_step`` in s.
    """
    z, v = np.broadcast_arrays(displacement, velocity)
    if law.linear and not isinstance(law, MemorylessLaw):
        # Line by line, since a steady state is all that is asked for: exact, where steps err by the square of ω·step.
        omega = 2 * np.pi * np.fft.rfftfreq(len(z), time_step).reshape(-1, *(1,) * (z.ndim - 1))
        gain = law.describing_function(1.0, omega)
        return np.fft.irfft(gain * np.fft.rfft(z, axis=0), len(z), axis=0)
    if not law.states:
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
    it ended, the first that of the last; only segments whose start has moved are stepped again, until none has. What
    is known of how the end of a segment follows its start carries a change through the rest of the period at once:
    the slope seen from its last two runs, so that a law that forgets slowly (Dahl) settles in a handful of sweeps,
    or for sliders (Jenkins) the places to which the segment pushes them.
    """
    T, cases = z.shape
    segments = max(k for k in range(1, min(_SEGMENTS, T // _FEWEST_STEPS or 1) + 1) if T % k == 0)
    steps = T // segments
    zs, vs = (_side_by_side(x, segments) for x in (z, v))
    case = np.tile(np.arange(cases), segments)
    every = _chosen(law, case)
    # Virgin in the middle of the path and moved straight to where a segment begins: contacts that never slip then stay
    # at rest from the first sweep on.
    virgin = np.tile(law.initial_state((z.max(axis=0) + z.min(axis=0)) / 2), (segments, 1))
    before, coming = (np.roll(x[-1], cases) for x in (zs, vs))
    start = every.step(Motion(before, coming, time_step), virgin)[1]
    force, end = _stepped(every, zs, vs, time_step, start)
    known = _Known.of(law, start, end, zs[-1], zs[-1] - before)
    target = known.handed_on(start, end, segments)
    for _ in range(_MOST_RUNS):
        moved = np.flatnonzero(np.any(np.abs(target - start) > _TOLERANCE * np.abs(end).max(axis=0), axis=1))
        if not len(moved):
            break
        earlier, start = start, start.copy()
        start[moved] = target[moved]
        force[:, moved], after = _stepped(
            _chosen(law, case[moved]), zs[:, moved], vs[:, moved], time_step, start[moved]
        )
        known.learn(moved, earlier[moved], end[moved], start[moved], after)
        end[moved] = after
        target = known.handed_on(start, end, segments)
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


class _Known(ABC):
    """What the runs of the segments told of how their ends follow their starts, (segments · cases, states)."""

    @staticmethod
    def of(law: JointLaw, start: Array, end: Array, place: Array, move: Array) -> _Known:
        """After the first run, which ended at ``place`` after moving by ``move`` in m."""
        if all(name.startswith("slider") for name in law.states):
            known = _Pushed(np.full(end.shape, -np.inf), np.full(end.shape, np.inf))
            known.learn(np.arange(len(end)), start, start, start, end)
            return known
        # A state that stays, or goes with the joint as a whole, hands a change on; the place of the joint itself none.
        place, move = place[:, None], move[:, None]
        carried = (end != place) & (np.abs(end - start - move) <= _CARRIED * np.abs(move))
        return _Followed(np.where((end == start) | carried, 1.0, 0.0))

    @abstractmethod
    def learn(self, moved: _Index, earlier: Array, ended: Array, start: Array, end: Array) -> None:
        """From segments run again: before from ``earlier`` to ``ended``, now from ``start`` to ``end``."""

    @abstractmethod
    def handed_on(self, start: Array, end: Array, segments: int) -> Array:
        """Starts of the periodic chain, were what is known all there is to know."""


@dataclass(frozen=True)
class _Followed(_Known):
    """Every end is end + slope · (change of start)."""

    slope: Array

    def learn(self, moved: _Index, earlier: Array, ended: Array, start: Array, end: Array) -> None:
        change = start - earlier
        followed = (end - ended) / np.where(change == 0, 1.0, change)
        self.slope[moved] = np.where(change == 0, self.slope[moved], np.clip(followed, 0.0, 1.0))

    def handed_on(self, start: Array, end: Array, segments: int) -> Array:
        S, E, m = (x.reshape(segments, -1) for x in (start, end, self.slope))
        rest = E - m * S
        offset, kept = np.zeros_like(rest[0]), np.ones_like(rest[0])
        for k in range(segments):
            offset, kept = rest[k] + m[k] * offset, m[k] * kept
        chain = np.empty_like(rest)
        chain[0] = np.where(kept < _FORGOTTEN, offset / np.where(kept < _FORGOTTEN, 1 - kept, 1.0), E[-1])
        for k in range(segments - 1):
            chain[k + 1] = rest[k] + m[k] * chain[k]
        return chain.reshape(start.shape)


@dataclass(frozen=True)
class _Pushed(_Known):
    """A slider stays where it is unless a segment pushes it up to its ``low`` or down to its ``high`` place."""

    low: Array
    high: Array

    def learn(self, moved: _Index, earlier: Array, ended: Array, start: Array, end: Array) -> None:
        # Steps round: a slider that is not pushed does not end exactly where it began.
        pushed, least = end - start, _TOLERANCE * np.abs(end).max(axis=0)
        self.low[moved] = np.where(pushed > least, end, self.low[moved])
        self.high[moved] = np.where(pushed < -least, end, self.high[moved])

    def handed_on(self, start: Array, end: Array, segments: int) -> Array:
        low, high = (x.reshape(segments, -1) for x in (self.low, self.high))
        chain = np.empty_like(low)
        here = end.reshape(segments, -1)[-1]
        # Pushed once round the period, a slider comes back to where it is.
        for _ in range(2):
            for k in range(segments):
                chain[k] = here
                here = np.minimum(np.maximum(here, low[k]), high[k])
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
