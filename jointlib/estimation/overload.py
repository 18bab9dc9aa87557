"""Samples at the end of what a sensor or its amplifier shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jointlib.arrays import Array
from jointlib.measurement import Channel, Record

_FULL = 0.999
_OFTEN = 3
_STEP = 3.0


def full_scales(record: Record, channels: Sequence[Channel]) -> dict[str, float | None]:
    """Of every channel the full scale that is told, else the one that the record shows."""
    return {c.name: c.full_scale or full_scale_seen(record.channels[c.name]) for c in channels}


def overloaded(record: Record, ends: Mapping[str, float | None], part: slice = slice(None)) -> str:
    """That a part of a record lies at the full scale of channels, as words; empty where it does not."""
    over = [name for name, size in ends.items() if clipped(record.channels[name][part], size)]
    return f"clipped in {', '.join(over)}: the sensor or its amplifier was overloaded." if over else ""


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
