"""The rate of samples from their times."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

_EVEN = 0.25
"""How far a time may be from where even samples would be, in steps: what rounding does, and no more."""
_SNAP = 5e-6
"""Times and steps are written in six digits or more."""


def rate_of_times(time: Array, what: str) -> float:
    """Samples per second of times in s that rise evenly but for their rounding.

    Raises `InputError` (half a sentence about ``what``) where they go backwards or are uneven.
    """
    steps = np.diff(time)
    if not np.all(np.isfinite(time)) or len(steps) < 1:
        raise InputError(f"{what} has no value in some rows, expected one in each")
    if np.any(steps < 0):
        row = int(np.argmax(steps < 0)) + 1
        raise InputError(f"{what} goes backwards at sample {row} ({time[row - 1]:g} s, then {time[row]:g} s)")
    step = float(time[-1] - time[0]) / len(steps)
    if step <= 0:
        raise InputError(f"{what} stands still, expected times that rise")
    away = np.max(np.abs(time - time[0] - step * np.arange(len(time)))) / step
    if away > _EVEN:
        raise InputError(
            f"{what} is uneven (steps of {np.min(steps):.6g} to {np.max(steps):.6g} s), expected samples at one rate"
        )
    return rounded_rate(1 / step)


def rounded_rate(rate: float) -> float:
    """The whole number of Hz that a rate is but for the digits of its step, else the rate; `InputError` without end."""
    if not np.isfinite(rate):
        raise InputError(f"the sample rate is {rate:g} Hz, expected a number of samples a second that has an end")
    whole = round(rate)
    return float(whole) if whole and abs(rate / whole - 1) < _SNAP else float(f"{rate:.9g}")
