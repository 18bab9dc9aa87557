"""Samples at the end of what a sensor or its amplifier shows."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array

_FULL = 0.999
_OFTEN = 3
_STEP = 3.0


def clipped(x: Array, full_scale: float | None) -> bool:
    """Whether samples lie at the full scale."""
    return full_scale is not None and bool(np.max(np.abs(x), initial=0.0) >= _FULL * full_scale)


def full_scale_seen(x: Array) -> float | None:
    """The size at which a whole record is cut off, if it seems so: its extreme stands there three times or more.

    The samples beside the extreme must on the whole lie more than three of the smallest steps of the signal below it:
    the top of a slow signal that was rounded is entered in one step.
    """
    size = np.abs(x)
    top = float(np.max(size, initial=0.0))
    at = np.flatnonzero(size == top)
    if len(at) < _OFTEN or top == 0:
        return None
    steps = np.abs(np.diff(x))
    quantum = float(np.min(steps[steps > 0], initial=np.inf))
    beside = np.concatenate([at - 1, at + 1])
    fall = top - size[beside[(beside >= 0) & (beside < len(x))]]
    outside = fall[fall > 0]
    return top if len(outside) and float(np.median(outside)) > _STEP * quantum else None
