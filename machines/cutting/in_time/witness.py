"""The time-domain witness: a machine with its nonlinear joints is cut with in time, from vibrations of many sizes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError

from ...indices import Mask
from ...model.machine import Machine
from ...model.spindle_speed import at_speed
from ..amplitude.amplitude_limits import Cycle
from ..amplitude.sampled_amplitudes import amplitude_range
from ..amplitude.words import mm, story, um
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from ..process.passes import stretches
from .beginning import begins, ploughed, vibrating
from .delay_simulation import Chip, Cut, Run, settled, simulate
from .envelope import envelope, strongest_line
from .first_line import chatter_of, refuse_fold, stands
from .standing import repeated

_WAVES = 250
_FEWEST, _FEWEST_PATTERNS = 8, 48
"""Periods of a simulation; of patterns, what the flutes force is told from chatter in 16 of them."""
_STEPS = 60
_STARTS = 16
_REFINED = 6
_NEAR = 0.03
_TOGETHER = -0.5
_FAR = 1.5
_NARROW = 2e-3
_TINY = 1e-300
_REACH = 100.0
_WAVED, _ASIDE, _SHARE = np.array([1.0, 0.0, 0.0]), np.array([False, False, True]), np.array([1.0, 0.5, 0.0])
"""Ways to begin: height of the waves that are met, whether from rest, and the least share of the size that chatters. A
knock without the waves of an earlier pass becomes a vibration of half its size at least; one let go shares it among
all modes.
"""
_WINDOW, _BEATING = 12, 60
"""Waves in which an amplitude is read; the lines of milling beat."""


@dataclass(frozen=True, eq=False)
class Witness:
    """What became of vibrations of several sizes at one speed (rpm) and depth (m); arrays are (starts,)."""

    speed: float
    depth: float
    start: Array
    """Tool-point amplitude in m before time 0, ascending."""
    end: Array
    """Amplitude in m at the end; inf where it passed all bounds."""
    rate: Array
    """Growth in 1/s once the start has settled."""
    grows: Mask
    lost_contact: Mask
    """Whether an edge left the cut towards the end."""
    frequency: float
    """Of the vibration that lasts, else of the one that started, in Hz."""
    cycles: tuple[Cycle, ...]
    """Vibrations found to persist: thresholds, and amplitudes on which chatter settles."""
    duration: float
    """Simulated time in s."""
    least: Array | None = None
    """The smallest vibration in m that each may have become at once; None where all are of their ``start``."""

    def __str__(self) -> str:
        left = " The edge then leaves the cut once in a while." if np.any(self.lost_contact & self.grows) else ""
        low, high = self.start[0], self.start[-1]
        fate = story(bool(self.grows[0]), self.cycles, um(high), f"of {um(low)} to {um(high)}")
        return f"In time, at {self.speed:g} rpm and {mm(self.depth)}, {fate}.{left}"


def witness(
    machine: Machine,
    speed: float,
    depth: float,
    amplitude: ArrayLike | None = None,
    *,
    rounds: int = 5,
    waves: int = _WAVES,
    steps: int = _STEPS,
    frequency: float | None = None,
) -> Witness:
    """Simulate the cut from a batch of vibrations and tell which grow, and between which sizes the answer changes.

    The machine's state equations are integrated with its joints' laws in time, memory included, and with the delayed
    chip. With a ``feed`` in the cutting operation an edge that leaves the cut feels no force and next time meets the
    deepest of all earlier passes; without one the force is linear in the chip. Every change from dying to growing or
    back is closed in on by further batches, and its amplitude read where the growth vanishes. A flip has a fixed phase
    to the teeth: near one the vibrations start in two phases, a quarter wave apart, and those that lasted longer count.

    Parameters
    ----------
    speed, depth
        rpm and m.
    amplitude
        Tool-point amplitudes in m to start from, ascending; default: 16 over the range of `amplitude_limits`.
    rounds
        Batches; the second and later ones lie around the changes that the one before found.
    waves
        Length of a simulation in chatter periods.
    steps
        Steps per chatter period, at least.
    frequency
        Hz, of the starting vibration; default: the chatter frequency that the frozen joints predict.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], a simulation of the cut needs a cutting operation")
    if not (np.isfinite(speed) and speed > 0 and np.isfinite(depth) and depth > 0):
        raise InputError(f"witness: {speed!r} rpm and {depth!r} m, expected a speed and a depth above 0")
    machine, cutting = at_speed(machine, speed), Cutting(**dict(machine.cutting or {}))
    given = amplitude_range(cutting, _STARTS) if amplitude is None else np.atleast_1d(np.asarray(amplitude, float))
    if given.ndim != 1 or not np.all(np.isfinite(given)) or np.any(np.diff(given, prepend=0) <= 0):
        raise InputError("witness: amplitudes must be above 0 and ascending, in m")
    hertz = chatter_of(machine, speed, float(np.sqrt(given[0] * given[-1]))) if frequency is None else frequency
    phases = (0.0, np.pi / 2) if stands(cutting, speed, hertz) else (0.0,)
    kicked = [vibrate(machine, speed, depth, given, hertz, waves, steps, phase=phase) for phase in phases]
    batches = [max(kicked, key=lambda one: float(np.sum(np.log(np.maximum(one.early, _TINY)))))]
    phase = phases[kicked.index(batches[0])]
    reach = _REACH * float(given[-1])
    for _ in range(rounds - 1):
        closer = _between(batches[-1])
        if not len(closer):
            break
        batches.append(vibrate(machine, speed, depth, closer, hertz, waves, steps, reach, phase))
    first, last = batches[0], batches[-1]
    return Witness(
        speed,
        depth,
        first.start,
        first.end,
        first.rate,
        first.grows,
        first.lost,
        _lasting(first, hertz),
        _cycles(last) + _beyond(first),
        first.run.duration,
    )


def begun_in_every_way(
    machine: Machine, speed: float, depth: float, amplitude: Array, frequency: float | None = None, waves: int = _WAVES
) -> Witness:
    """As `witness`, each size over the waves that it would have left and, as knocks, over a smooth surface.

    A knock either sets the machine into the harmonic motion of the chatter or bends it aside by a force at the tool and
    lets go, which its other modes feel as well. All side by side; near a flip each in two phases. Which chatter a cut
    settles on, where several last, depends on how it begins.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    hertz = frequency or chatter_of(machine, speed, float(np.sqrt(amplitude[0] * amplitude[-1])))
    sizes = np.repeat(amplitude, len(_WAVED))
    waved, aside = np.tile(_WAVED, len(amplitude)), np.tile(_ASIDE, len(amplitude))
    phases = (0.0, np.pi / 2) if stands(cutting, speed, hertz) else (0.0,)
    batches = [
        vibrate(machine, speed, depth, sizes, hertz, waves, phase=phase, waved=waved, aside=aside) for phase in phases
    ]
    start, end, rate, grows, lost = (
        np.concatenate([getattr(one, name) for one in batches]) for name in ("start", "end", "rate", "grows", "lost")
    )
    order, least = np.argsort(start, kind="stable"), np.tile(np.outer(amplitude, _SHARE).ravel(), len(phases))
    start, end, rate, least = (part[order] for part in (start, end, rate, least))
    grows, lost = grows[order], lost[order]
    line, duration = _lasting(batches[0], hertz), batches[0].run.duration
    return Witness(speed, depth, start, end, rate, grows, lost, line, (), duration, least)


@dataclass(frozen=True, eq=False)
class Batch:
    """Vibrations simulated side by side, see `Witness`; ``typical`` is the amplitude in m that ``rate`` belongs to."""

    start: Array
    end: Array
    rate: Array
    early: Array
    typical: Array
    grows: Mask
    lost: Mask
    run: Run
    milled: bool
    forced: bool


def vibrate(
    machine: Machine,
    speed: float,
    depth: ArrayLike,
    start: Array,
    hertz: float,
    waves: int = _WAVES,
    steps: int = _STEPS,
    reach: float | None = None,
    phase: float = 0.0,
    waved: Array | None = None,
    aside: Mask | None = None,
) -> Batch:
    """Simulate one batch: ``depth`` in m may differ from motion to motion, and ``start`` holds their amplitudes in m.

    ``hertz`` is the frequency of the starting vibrations and ``phase`` in rad their angle at time 0; motions that
    exceed what the teeth force by ``reach`` (m) are stopped, by default by a hundred times the largest start. ``waved``
    is the height of the waves that they meet as a share of those that they would have left: 1, 0 for a knock over a
    smooth surface. Those ``aside`` are bent by a force at the tool and let go.
    """
    cutting = Cutting(**dict(machine.cutting or {}))
    cutter = Cutter.of(cutting, runout=cutting.feed is not None)
    refuse_fold(cutter, speed, hertz)
    axes = machine.tool_axes
    parts, state, joints, tool = vibrating(machine, cutting, hertz, start, phase, aside)
    depths = np.array(np.broadcast_to(np.asarray(depth, dtype=float), len(start)))
    uneven = len(cutter.flutes) > 1
    if (cutter.twisted or uneven) and np.ptp(depths) > 0:
        raise InputError("simulated cut: several depths at once, expected one with helix or unequal pitches")
    cut = stretches(cutting, axes, speed, hertz * steps, float(depths[0]))
    earlier = tool if waved is None else waved * tool
    surfaces = [ploughed(s, at, earlier, hertz) for s, at in zip(cut, begins(cut), strict=True)]
    memories = parts.memories(joints, 2 * np.pi * hertz)
    chip = Chip(cutting.feed, cutting.exponent)
    milled = cutting.process == "milling"
    forced = milled and cutting.feed is not None
    fewest = _FEWEST_PATTERNS if uneven and forced else _FEWEST
    periods = max(fewest, int(np.ceil(waves * cutter.frequency(speed) / hertz)))
    if forced:
        alike = 1 if uneven else len(start)
        still = [part.initial_state(np.zeros(alike)) for part in parts.rest]
        with np.errstate(over="ignore", invalid="ignore"):  # a joint that gives way under it holds nothing
            moved, memories, left = settled(parts, Cut(cut, chip, depths[:alike]), still, periods)
            if uneven:
                moved, memories, left = repeated(parts, Cut(cut, chip, depths[:1]), moved, memories, left)
                memories = [np.repeat(memory, len(start), axis=0) for memory in memories]
        state = state + moved
        surfaces = [a + b for a, b in zip(surfaces, left, strict=True)]
    bound = _REACH * float(np.max(start)) if reach is None else reach
    bound += 2 * max(float(np.max(np.abs(one.height), initial=0.0)) for one in left) if forced else 0.0
    run = simulate(parts, Cut(cut, chip, depths), state, memories, surfaces, periods, bound)
    sizes = envelope(run, hertz, _BEATING if milled else _WINDOW, forced)
    end = np.where(run.escaped, np.inf, sizes.amplitude[-1])
    change = np.log(np.maximum(end, _TINY) / np.maximum(sizes.early, _TINY))
    moved = np.log(np.clip(end, _TINY, 1e9 * start) / start)
    # What went far, or to where its neighbours went, is judged by where that is; any other by how it goes on.
    together = np.zeros(len(start), dtype=bool)
    if len(start) > 1 and np.all(np.diff(start) > 0):
        together = np.gradient(moved, np.log(start)) < _TOGETHER
    there = (np.abs(moved) > _FAR) | together
    grows = (there & (moved > 0)) | (~there & (change > 0))
    tail = np.asarray(np.any(run.lost[-max(1, len(run.lost) // 10) :], axis=0), dtype=np.bool_)
    rate = np.where(run.escaped, np.inf, sizes.rate)
    return Batch(start, end, rate, sizes.early, sizes.typical, grows, tail, run, milled, forced)


def _lasting(batch: Batch, hertz: float) -> float:
    """Frequency in Hz of the largest vibration that lasts; where none does, of the one that started."""
    largest = int(np.argmax(np.where(np.isfinite(batch.end), batch.end, 0.0)))
    return strongest_line(batch.run, largest, batch.forced) if batch.grows[largest] else hertz


def _between(batch: Batch) -> Array:
    """Amplitudes around every change from dying to growing or back that is not yet narrow."""
    found = []
    for i in np.flatnonzero(batch.grows[1:] != batch.grows[:-1]):
        found.append(np.geomspace(batch.start[i], batch.start[i + 1], _REFINED))
    if not found or all(np.log(part[-1] / part[0]) < _NARROW for part in found):
        return np.empty(0)
    return np.unique(np.concatenate(found))


def _cycles(batch: Batch) -> tuple[Cycle, ...]:
    """The amplitude at each change: where both neighbours grow at no rate, or what both settled on, or their middle."""
    found = []
    for i in np.flatnonzero(batch.grows[1:] != batch.grows[:-1]):
        pair = slice(i, i + 2)
        rate, size, end = batch.rate[pair], np.log(batch.typical[pair]), batch.end[pair]
        stable = bool(batch.grows[i])
        at = float(np.mean(np.log(batch.start[pair])))
        if np.all(np.isfinite(end)) and np.all(np.abs(np.log(end / batch.start[pair])) < _NEAR):
            if (rate[1] - rate[0]) * (-1 if stable else 1) > 0 and rate[0] * rate[1] < 0:
                at = float((rate[1] * size[0] - rate[0] * size[1]) / (rate[1] - rate[0]))
            if stable and abs(np.log(end[1] / end[0])) < _NARROW:
                at = float(np.mean(np.log(end)))
        early = batch.early[pair]
        if not stable and batch.milled and abs(np.log(early[1] / early[0])) < _NEAR:
            # A start of one line is not the shape of a cycle in milling; two motions that part late both followed it.
            at = float(np.mean(np.log(early)))
        found.append(Cycle(float(np.exp(at)), strongest_line(batch.run, int(i), batch.forced), stable))
    return tuple(found)


def _beyond(batch: Batch) -> tuple[Cycle, ...]:
    """Chatter larger than all starts, if the largest of them settled there."""
    end, start = batch.end[-1], batch.start[-1]
    if not batch.grows[-1] or not np.isfinite(end) or end < (1 + _NEAR) * start:
        return ()
    if abs(batch.rate[-1]) * batch.run.duration > _NEAR:
        return ()
    return (Cycle(float(end), strongest_line(batch.run, -1, batch.forced), True),)
