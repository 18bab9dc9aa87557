"""Noise floor from cycles that repeat: what no function of the motion can explain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.preparation import Run
from jointlib.loop.path.regression import Index
from jointlib.loop.path.strokes import Block, Division, strokes

_ALIKE = 0.02
"""Strokes repeat one another if travel and starting point agree to this fraction of the travel."""
_SAME_PATH = 0.01
"""… and their paths, laid over one another, to this rms fraction of it."""
_UNLIKE = 0.1
"""Of the force, by which repeated strokes that are such do not differ."""
_MOSTLY = 0.5
"""Less than this share of the variance left by differences of the motion, and it is no noise but theirs."""
_FULL = 0.8
"""A stroke of a record counts as one at full level from this fraction of the largest travel on."""
_SIGNALS: tuple[Callable[[Run], Array], ...] = (
    lambda run: run.force,
    lambda run: run.path.displacement,
    lambda run: run.path.velocity,
    lambda run: run.acceleration,
)


@dataclass(frozen=True)
class PathFloor:
    """Variance of the force over repetitions, in N² per block; zero where unknown."""

    power: Array
    source: str
    """``cycles``, ``band`` (the noise above the motion's band) or ``unknown``."""
    block_folds: Index
    """Blocks of one number are left out together to test the noise: the n-th cycle, else every block alone."""

    @property
    def known(self) -> bool:
        return self.source != "unknown"


def repeat_floor(runs: Sequence[Run], division: Division) -> PathFloor:
    """Mean variance of the filtered force over at least three repetitions of a stroke or of a declared period.

    A block that is no such stroke gets the mean of those of its record, one without any the mean of the others; with
    none the floor is unknown.
    """
    blocks = division.blocks
    power = np.full(len(blocks), np.nan)
    sets = _repeated_strokes(runs, blocks)
    folds = np.arange(len(power))
    if sum(len(s) for s in sets) == len(power):
        for s in sets:
            folds[s] = np.arange(len(s))
    for set_ in sets:
        variance = _variance(runs, [blocks[i] for i in set_])
        if variance is not None:
            power[set_] = variance
    for number, run in enumerate(runs):
        mine = [i for i, b in enumerate(blocks) if b.run == number]
        if mine and np.all(np.isnan(power[mine])):
            power[mine] = _record_variance(runs, number, run)
    if np.all(np.isnan(power)):
        return PathFloor(np.zeros(len(power)), "unknown", folds)
    return PathFloor(np.where(np.isnan(power), np.nanmean(power), power), "cycles", folds)


def _record_variance(runs: Sequence[Run], number: int, run: Run) -> float:
    """Of a record whose blocks are not strokes: over its periods, else over its full strokes; nan where none repeat."""
    edge, n = run.preparation.edge, run.period
    count = (len(run.force) - 2 * edge) // n if n else 0
    if n and count >= 3:
        forces, *motions = (signal(run)[edge : edge + count * n].reshape(count, n) for signal in _SIGNALS)
        return _beyond(forces, motions)
    own = strokes(number, run)
    full = [b for b in own if b.travel > _FULL * max(o.travel for o in own)]
    found = [(_variance(runs, [full[i] for i in s]), len(s)) for s in _repeated_strokes(runs, full)]
    known = [(v, n) for v, n in found if v is not None]
    return sum(v * n for v, n in known) / sum(n for _, n in known) if known else float("nan")


def _repeated_strokes(runs: Sequence[Run], blocks: Sequence[Block]) -> list[list[int]]:
    """Sets of at least three strokes of one condition, direction, travel and starting point."""
    sets: list[list[int]] = []
    for i, b in enumerate(blocks):
        if not b.is_stroke:
            continue
        for members in sets:
            a = blocks[members[0]]
            apart = abs(_start(runs, a) - _start(runs, b))
            same = (a.condition, a.direction) == (b.condition, b.direction)
            if same and abs(a.travel - b.travel) < _ALIKE * a.travel and apart < _ALIKE * a.travel:
                members.append(i)
                break
        else:
            sets.append([i])
    return [s for s in sets if len(s) >= 3]


def _start(runs: Sequence[Run], b: Block) -> float:
    return float(runs[b.run].path.displacement[b.first])


def _variance(all_runs: Sequence[Run], blocks: Sequence[Block]) -> float | None:
    """Variance of the force over strokes aligned where they pass the middle of the travel; None if paths differ."""
    runs = [all_runs[b.run] for b in blocks]
    ends = [r.path.displacement[[b.first, b.end - 1]] for r, b in zip(runs, blocks, strict=True)]
    middle = float(np.mean(ends))
    crossings = [_crossing(r, b, middle) for r, b in zip(runs, blocks, strict=True)]
    before = min(c - b.first for c, b in zip(crossings, blocks, strict=True))
    after = min(b.end - 1 - c for c, b in zip(crossings, blocks, strict=True))
    offsets = np.arange(-int(before), int(after) + 1)
    if len(offsets) < 3:
        return None
    at = [(c + offsets, run) for c, run in zip(crossings, runs, strict=True)]
    forces, paths, *moving = (
        np.array([np.interp(i, np.arange(len(run.force)), signal(run)) for i, run in at]) for signal in _SIGNALS
    )
    if np.sqrt(paths.var(axis=0, ddof=1).mean()) > _SAME_PATH * blocks[0].travel:
        return None
    if len({b.run for b in blocks}) == 1:
        # A zero that wanders is no noise: what it adds from one repetition to the next is taken out.
        when = np.array(crossings) - np.mean(crossings)
        forces, paths, *moving = (
            x - (when @ x.mean(axis=1) / (when @ when) * when)[:, None] for x in (forces, paths, *moving)
        )
    return _beyond(forces, (paths, *moving))


def _beyond(forces: Array, motions: Sequence[Array]) -> float:
    """Variance of forces over repetitions, (repetitions, samples), in N².

    Where forces differ much and motions that are only nearly the same explain most of it, it is what they leave.
    Near a resonance springs and inertia cancel, and a hundredth of the motion is as large as all of the force.
    """
    off = (forces - forces.mean(axis=0)).ravel()
    differences = np.array([(x - x.mean(axis=0)).ravel() for x in motions]).T
    left = off - differences @ np.linalg.lstsq(differences, off, rcond=None)[0]
    apart, explained = np.sum(off**2) > _UNLIKE**2 * np.sum(forces**2), np.sum(left**2) < _MOSTLY * np.sum(off**2)
    own = left if apart and explained else off
    free = float(forces.shape[1] * (forces.shape[0] - 1))
    return float(np.sum(own**2)) / free


def _crossing(run: Run, b: Block, level: float) -> float:
    """Sample number, with its fraction, at which a stroke passes a displacement."""
    z = run.path.displacement[b.first : b.end]
    rising = z if b.direction > 0 else -z
    return b.first + float(np.interp(level if b.direction > 0 else -level, rising, np.arange(len(z))))
