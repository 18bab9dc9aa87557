"""Samples at the end of what a sensor or its amplifier shows."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

_FULL = 0.999
_RUN = 3
_STEP = 3.0


def clipped(x: Array, full_scale: float | None) -> bool:
    """Whether samples lie at the full scale; where that is not known, whether the extreme is a flat top.

    A flat top is three or more equal extreme samples that the signal enters in a step of more than three of its
    smallest steps: the top of a slow signal that was rounded is entered in one.
    """
    if full_scale is not None:
        return bool(np.max(np.abs(x), initial=0.0) >= _FULL * full_scale)
    return any(_flat(side) for side in (x, -x))


def _flat(x: Array) -> bool:
    top = np.max(x, initial=0.0)
    at = np.flatnonzero(x == top)
    if len(at) < _RUN or top <= 0:
        return False
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    longest = max(runs, key=len)
    if len(longest) < _RUN or longest[0] == 0 or longest[-1] == len(x) - 1:
        return False
    steps = np.abs(np.diff(x))
    quantum = np.min(steps[steps > 0], initial=np.inf)
    return bool(max(top - x[longest[0] - 1], top - x[longest[-1] + 1]) > _STEP * quantum)
