"""At which amplitudes limits are computed first, and where more: near the lowest depth, and between lobes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

from ..process.chart import Integers
from ..process.cutting import Cutting
from .lobes_over_range import farthest

_CLOSE = 1.03
_LARGEST = 2e-4
_DECADES = 3.0
_COUNT, _FEWER = 31, 16


def amplitude_range(cutting: Cutting, count: int | None = None) -> Array:
    """Amplitudes in m over three decades up to the feed, or to 200 µm without: 31, in milling 16, which are dear."""
    largest = cutting.feed or _LARGEST
    return np.geomspace(largest * 10**-_DECADES, largest, count or (_FEWER if cutting.process == "milling" else _COUNT))


def far_apart_first(size: Array) -> list[float]:
    """All of them, ascending and above 0, in an order in which each is as far as can be from those before it."""
    order = [0]
    while len(order) < len(size):
        order.append(farthest(np.log(size), np.log(size[order])))
    return [float(one) for one in size[order]]


def near_lowest(depths: dict[float, Array]) -> list[float]:
    """At every speed the amplitude where a parabola through the lowest depth and its neighbours has its vertex."""
    x = np.log(sorted(depths))
    found = []
    for b in np.array([depths[size] for size in sorted(depths)]).T:
        k = int(np.argmin(b))
        if 0 < k < len(b) - 1 and np.all(np.isfinite(b[k - 1 : k + 2])):
            first, second = np.diff(b[k - 1 : k + 2]) / np.diff(x[k - 1 : k + 2])
            vertex = (
                (x[k - 1] + x[k]) / 2 - first * (x[k + 1] - x[k - 1]) / 2 / (second - first) if second > first else x[k]
            )
            found.append(float(np.exp(vertex)))
    return found


def between_lobes(sizes: Sequence[float], lobe: Integers) -> list[float]:
    """Half-way between any two with different lobes, (amplitudes, speeds), where b_lim peaks, until they are close."""
    changes = np.any(lobe[1:] != lobe[:-1], axis=1)
    pairs = zip(sizes[:-1], sizes[1:], changes, strict=True)
    return [float(np.sqrt(low * high)) for low, high, change in pairs if change and high > _CLOSE * low]
