"""By how much the tops of a curve stand out: above the higher of the two lowest points between them and what is higher.

As `scipy.signal` has it, whose import takes as long as all else of a comparison.
"""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

from ..indices import Index


def prominent(values: Array, least: float) -> Index:
    """Places of the tops, in the middle of level ones, that stand out by at least so much; ends are none."""
    change = np.flatnonzero(np.diff(values) != 0)
    first, last = np.append(0, change + 1), np.append(change, len(values) - 1)
    level = values[first]
    inside = np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])) + 1
    tops = (first[inside] + last[inside]) // 2
    return np.asarray(tops[prominences(values)[tops] >= least])


def prominences(values: Array) -> Array:
    """Of every place, as if it were a top."""
    before, after = _lowest(values), _lowest(values[::-1])[::-1]
    return np.asarray(values - np.maximum(before, after))


def _lowest(values: Array) -> Array:
    """The lowest value from each place back to where the curve was higher."""
    found, hills = list[float](), list[tuple[float, float]]()
    for value in values.tolist():
        lowest = value
        while hills and hills[-1][0] <= value:
            lowest = min(lowest, hills.pop()[1])
        hills.append((value, lowest))
        found.append(lowest)
    return np.array(found)
