"""Strokes one after the other in one record, each with a decay of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array
from jointlib.measurement import Record
from jointlib.ringdown.decay import envelope_of, in_motion, strongest
from jointlib.ringdown.hum import without_hum

_BESIDE = 5
"""Cycles before and after a stroke, of which the amplitude is compared."""
_RISES = 4.0
"""Times the largest amplitude before, that the middle one after a stroke is. Two modes that beat come to 2.8."""
_SMALL = 0.1
"""Of the largest amplitude, which a stroke at least makes."""
_IN_A_CYCLE = 8
"""Amplitudes that are looked at."""


def strokes(record: Record, channel: str, band: Sequence[float] | None) -> list[Record]:
    """A record from stroke to stroke; as it is where there is one."""
    x, rate = record.channels[channel], record.sample_rate
    if not np.ptp(x) > 0:
        return [record]
    x, _ = without_hum(x, rate)
    step = max(1, round(rate / strongest(x[in_motion(x)], rate, band) / _IN_A_CYCLE))
    size = envelope_of(x - np.median(x), step * _IN_A_CYCLE)[::step]
    ends = [0, *_rises(size), len(size)]
    parts = [(a, b) for a, b in pairwise(ends) if np.max(size[a : b - _IN_A_CYCLE], initial=0) > _SMALL * np.max(size)]
    return [record] if len(parts) < 2 else [_part(record, a * step, min(b * step, len(x))) for a, b in parts]


def _rises(size: Array) -> list[int]:
    """Places up to two cycles before the amplitude rises by much and stays there."""
    some = _BESIDE * _IN_A_CYCLE
    apart = some + 2 * _IN_A_CYCLE
    if len(size) <= apart + some:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(size, some)
    before, after = np.max(windows[:-apart], axis=1), np.mean(windows[apart:], axis=1)
    ratio = np.where(after > _SMALL * np.max(size), after / np.maximum(before, 1e-300), 0.0)
    found = list[int]()
    for k in np.argsort(-ratio):
        if ratio[k] < _RISES:
            break
        if all(abs(k - other) > 2 * apart for other in found):
            found.append(int(k))
    return sorted(k + some for k in found)


def _part(record: Record, first: int, last: int) -> Record:
    before = record.source.rows[0] if record.source.rows else 0
    source = replace(record.source, rows=(before + first, before + last))
    return replace(record, source=source, channels={name: x[first:last] for name, x in record.channels.items()})
