"""Strokes between reversals, and the conditions they were made under: what is held out together."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.preparation import Run
from jointlib.loop.path.regression import Index

_REST = 0.005
"""A stroke lasts while the speed exceeds this fraction of the largest one."""
_MOST_BLOCKS, FEWEST_BLOCKS = 60, 8
_MOSTLY = 0.5
"""Share of the way that strokes have to be; of a random motion only the slowest are long enough to be one."""


@dataclass(frozen=True)
class Block:
    """A piece of one record that is held out as a whole."""

    run: int
    first: int
    """First and last-but-one sample of the full-rate record."""
    end: int
    peak_speed: float
    """m/s."""
    travel: float
    """m, peak to peak."""
    direction: int
    """1 or −1 for a stroke, 0 for a piece with reversals in it."""
    condition: str = ""

    @property
    def is_stroke(self) -> bool:
        return self.direction != 0


@dataclass(frozen=True)
class Division:
    """The blocks of all records; ``conditions`` are the distinct ones, a single one where none can be told apart."""

    blocks: tuple[Block, ...]
    grouped_by: str

    @property
    def conditions(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(b.condition for b in self.blocks))

    def rows(self, runs: Sequence[Run]) -> tuple[Index, ...]:
        """Indices of the samples of every block in the thinned records laid end to end."""
        found, start = [], 0
        for number, run in enumerate(runs):
            sample = np.arange(len(run.force))[run.keep]
            for b in (b for b in self.blocks if b.run == number):
                found.append(start + np.flatnonzero((sample >= b.first) & (sample < b.end)))
            start += len(sample)
        return tuple(found)


def divide(runs: Sequence[Run]) -> Division:
    """Whole records where there are 8 or more, complete strokes where there are between 8 and 60 and these are most of
    the motion in each, else equal pieces; conditions as declared, or found."""
    if len(runs) >= FEWEST_BLOCKS:
        blocks = [_block(i, run, run.begin, len(run.force) - run.preparation.edge, 0) for i, run in enumerate(runs)]
    else:
        blocks = [b for i, run in enumerate(runs) for b in strokes(i, run)]
        whole = all(_held(i, run, blocks) >= _MOSTLY for i, run in enumerate(runs))
        if not FEWEST_BLOCKS <= len(blocks) <= _MOST_BLOCKS or not whole:
            blocks = [b for i, run in enumerate(runs) for b in _pieces(i, run, len(runs))]
    labels = [run.condition for run in runs]
    if len({label for label in labels if label}) > 1:
        return Division(tuple(replace(b, condition=labels[b.run] or "none") for b in blocks), "declared conditions")
    told = []
    for name, unit, values in (
        ("peak speed", "m/s", np.array([b.peak_speed for b in blocks])),
        ("travel", "m", np.array([b.travel for b in blocks])),
    ):
        groups = _clusters(values)
        if groups is not None:
            named = [f"{name} {np.mean(values[groups == g]):.3g} {unit}" for g in groups]
            told.append(Division(tuple(replace(b, condition=n) for b, n in zip(blocks, named, strict=True)), name))
    if told:  # tones of one speed and several travels are several conditions
        return max(told, key=lambda division: len(division.conditions))
    if len(runs) > 1:
        return Division(tuple(replace(b, condition=runs[b.run].name) for b in blocks), "record")
    speeds = np.array([b.peak_speed for b in blocks])
    if speeds.max() > 1.5 * speeds.min():
        third = np.searchsorted(np.quantile(speeds, [1 / 3, 2 / 3]), speeds)
        words = ("slow third", "middle third", "fast third")
        return Division(
            tuple(replace(b, condition=words[t]) for b, t in zip(blocks, third, strict=True)), "thirds of peak speed"
        )
    return Division(tuple(replace(b, condition="one trajectory") for b in blocks), "none found")


def _held(number: int, run: Run, blocks: Sequence[Block]) -> float:
    """Share of the way of one record that lies in its blocks: those that are too short to be one may be most of it."""
    way = np.abs(run.path.velocity)
    kept = float(way[run.begin : len(way) - run.preparation.edge].sum())
    return sum(float(way[b.first : b.end].sum()) for b in blocks if b.run == number) / max(kept, 1e-300)


def strokes(number: int, run: Run) -> list[Block]:
    """Strokes that begin and end within the kept part, so that what went before them is known."""
    v = run.path.velocity
    sign = np.where(np.abs(v) > _REST * np.max(np.abs(v)), np.sign(v), 0).astype(int)
    bounds = np.flatnonzero(np.diff(sign)) + 1
    first, end = np.concatenate([[0], bounds]), np.concatenate([bounds, [len(v)]])
    edge, least = run.preparation.edge, 5 * run.preparation.stride
    return [
        _block(number, run, int(a), int(b), int(sign[a]))
        for a, b in zip(first, end, strict=True)
        if sign[a] and a >= run.begin and b <= len(v) - edge and b - a >= least
    ]


def _pieces(number: int, run: Run, runs: int) -> list[Block]:
    """Equal pieces of a record, about forty in all; periods of excitation are not cut."""
    edge = run.preparation.edge
    count = max(2, -(-FEWEST_BLOCKS // runs), 40 // runs)
    cuts = np.linspace(run.begin, len(run.force) - edge, count + 1).round().astype(int)
    if run.period and len(run.force) // run.period >= 3:
        least = max(5 * run.preparation.stride, len(run.force) // _MOST_BLOCKS)
        cuts = np.arange(run.begin, len(run.force) - edge + 1, run.period * -(-least // run.period))
    return [_block(number, run, int(a), int(b), 0) for a, b in itertools.pairwise(cuts)]


def _block(number: int, run: Run, first: int, end: int, direction: int) -> Block:
    z, v = run.path.displacement[first:end], run.path.velocity[first:end]
    return Block(number, first, end, float(np.max(np.abs(v))), float(np.ptp(z)), direction)


def _clusters(values: Array) -> Index | None:
    """Group numbers split where sorted values jump by more than 15 %; None without 2 to 8 groups.

    A group of one joins its nearer neighbour. Where one holds less than a tenth of all, or spans more than half of its
    lowest value, the values wander and do not fall into groups.
    """
    order = np.argsort(values, kind="stable")
    logs = np.log(np.maximum(values[order], 1e-300))
    groups = np.concatenate([[0], np.cumsum(np.diff(logs) > np.log(1.15))])
    while True:
        sizes = np.bincount(groups)
        lone = np.flatnonzero(sizes == 1)
        if not lone.size or len(sizes) == 1:
            break
        at = int(np.flatnonzero(groups == lone[0])[0])
        below = logs[at] - logs[at - 1] if at > 0 else np.inf
        above = logs[at + 1] - logs[at] if at + 1 < len(logs) else np.inf
        groups[at] = groups[at - 1] if below < above else groups[at + 1]
        groups = np.unique(groups, return_inverse=True)[1]
    sizes = np.unique(groups, return_counts=True)[1]
    spans = [float(np.ptp(logs[groups == g])) for g in np.unique(groups)]
    if not 2 <= len(sizes) <= 8 or sizes.min() < 0.1 * len(values) or max(spans) > np.log(1.5):
        return None
    out = np.empty(len(values), dtype=int)
    out[order] = groups
    return out
