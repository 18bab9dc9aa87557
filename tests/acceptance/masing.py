"""A hysteresis loop after Masing: branches of one smooth backbone, with return-point memory.

Masing 1926: a branch that starts at a turning point (x_r, f_r) is the first-loading curve stretched by two,
f = f_r + 2 g((x − x_r)/2); where it meets the turning point before, the inner loop closes and the outer branch goes on.
Backbone here g(x) = x/(reach^p + |x|^p)^(1/p), between −1 and 1. Branches are evaluated whole, no element is stepped.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def backbone(x: Array, reach: float, exponent: float) -> Array:
    """First loading, relative to the slip force."""
    return np.asarray(x / (reach**exponent + np.abs(x) ** exponent) ** (1 / exponent))


def masing(x: Array, reach: float, exponent: float) -> Array:
    """Loop force over slip force along periodic paths x (records, points) in their steady state."""
    return np.array([_along(path, reach, exponent) for path in x])


def _along(x: Array, reach: float, exponent: float) -> Array:
    """One path. It is begun at its largest value, where all memory is wiped out."""
    first = int(np.argmax(x))
    path = np.append(np.roll(x, -first), x[first])
    step = np.sign(np.diff(path))
    moving = np.maximum.accumulate(np.where(step != 0, np.arange(len(step)), 0))
    step = step[moving]
    turning = np.flatnonzero(step[1:] * step[:-1] < 0) + 1
    ends = [*turning.tolist(), len(path) - 1]
    low = float(path.min())

    def g(distance: float) -> float:
        return float(distance / (reach**exponent + abs(distance) ** exponent) ** (1 / exponent))

    top = (float(path[0]), g((float(path[0]) - low) / 2))
    memory: list[tuple[float, float]] = [top]
    pieces: list[tuple[int, float, float]] = []
    at = 0
    for end in ends:
        x_end, rising = float(path[end]), float(path[end]) > float(path[at])
        run = path[at : end + 1] if rising else -path[at : end + 1]
        begun = at
        while True:
            x_r, f_r = memory[-1]
            pieces.append((begun, x_r, f_r))
            # The branch closes the loop at the turning point before the one it started from.
            if len(memory) < 2:
                break
            goal = memory[-2][0]
            if (x_end <= goal) if rising else (x_end >= goal):
                break
            begun = at + int(np.searchsorted(run, goal if rising else -goal, side="right"))
            del memory[-2:]
            if not memory:
                memory = [top]
                break
        x_r, f_r = pieces[-1][1:]
        memory.append((x_end, f_r + 2 * g((x_end - x_r) / 2)))
        at = end
    starts = np.array([p[0] for p in pieces])
    # A later piece that begins at the same point replaces the earlier one.
    which = np.searchsorted(starts, np.arange(len(path)), side="right") - 1
    from_x, from_f = np.array([p[1] for p in pieces])[which], np.array([p[2] for p in pieces])[which]
    loop = from_f + 2 * backbone((path - from_x) / 2, reach, exponent)
    return np.asarray(np.roll(loop[:-1], first))
