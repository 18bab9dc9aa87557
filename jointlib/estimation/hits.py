"""Hammer hits in a force record: where each begins and ends, and which of them are no single clean hit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

_WEAK = 0.1
"""Share of the largest hit below which a force is none."""
_SECOND = 0.1
"""Share of the first lobe above which a second one makes a double hit."""
_NOISE = 8.0
_FOOT = 0.01
_APART = 0.1
"""s, between lobes that belong to two hits."""


@dataclass(frozen=True)
class Hit:
    """One hit; indices count samples of the record."""

    start: int
    """First sample of the pulse."""
    end: int
    """The one after its last."""
    peak: float
    """N."""
    second: float
    """Largest rise of the force after the first lobe, as a share of the peak; 0 where there is none."""


def find_hits(force: Array, sample_rate: float, length: float | None) -> list[Hit]:
    """Hits in ascending order of time; the hammer's sign is that of its largest excursion.

    What exceeds a tenth of the largest force, and eight standard deviations of the noise, is a lobe. Lobes closer than
    0.1 s, or than a block where that is shorter, are one hit; its second lobe counts from a tenth of its first on.
    """
    zero = float(np.median(force))
    f = force - zero
    noise = 1.4826 * float(np.median(np.abs(f)))
    f = f if np.max(f) >= -np.min(f) else -f
    level = max(_WEAK * float(np.max(f)), _NOISE * noise)
    above = np.flatnonzero(f > level)
    if not len(above) or not level > 0:
        return []
    gap = round(min(length or _APART, _APART) * sample_rate)
    firsts: list[int] = []
    for k in above.tolist():
        if not firsts or (k - firsts[-1] > gap):
            firsts.append(k)
    ends = [*firsts[1:], len(f)]
    return [_hit(f, first, min(first + gap, end), noise) for first, end in zip(firsts, ends, strict=True)]


def _hit(f: Array, first: int, until: int, noise: float) -> Hit:
    top = first
    while top + 1 < until and f[top + 1] >= f[top]:
        top += 1
    # Noise may dent the flank: the peak of the first lobe is the highest before the force falls to half of it.
    k = top
    while k < until and f[k] > 0.5 * f[top]:
        top = k if f[k] > f[top] else top
        k += 1
    peak = float(f[top])
    foot = max(_FOOT * peak, 2 * noise)
    start, end = top, top
    while start > 0 and f[start - 1] > foot:
        start -= 1
    while end < until and f[end] > foot:
        end += 1
    rest = f[k:until]
    rise = float(np.max(rest - np.minimum.accumulate(np.maximum(rest, 0.0)), initial=0.0))
    return Hit(start, end, peak, rise / peak if rise > max(_SECOND * peak, _NOISE * noise) else 0.0)


def common_length(hits: Sequence[Sequence[Hit]], samples: Sequence[int], before: int) -> int:
    """Samples of a block that fits between every hit and the next, or the end of its record."""
    room = []
    for found, count in zip(hits, samples, strict=True):
        room += np.diff([hit.start for hit in found] + [count]).tolist()
    return int(min(room)) if room else before
