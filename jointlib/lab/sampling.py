"""The rate of samples from their times."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

_EVEN = 0.25
"""How far a time may be from where even samples would be, in steps: what rounding does, and no more."""
_AHEAD, _MISSING, _SELDOM = 20, 0.75, 100
"""Samples behind a jump within which times may come back, steps by which a jump is longer than one, and samples of
which at most one may jump: more often it is the clock, not samples that are missing."""
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
    refuse_gap(time, what)
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


def refuse_gap(time: Array, what: str) -> None:
    """`InputError` where samples are missing: the times jump a few times and do not come back to where even ones are.

    Times that are late now and then, or rounded to several samples, are no gap.
    """
    window = min(_AHEAD, len(time) // 2)
    if window < 1 or not np.all(np.isfinite(time)):
        return
    step = float(np.median(time[window:] - time[:-window])) / window
    jumps = np.flatnonzero(np.diff(time) > (1 + _MISSING) * step)
    if step <= 0 or len(jumps) > max(1, len(time) // _SELDOM):
        return
    for i in jumps.tolist():
        last = min(i + 1 + window, len(time) - 1)
        if time[last] - time[i] > (last - i + _MISSING) * step:
            missing = max(1, round((time[i + 1] - time[i]) / step) - 1)
            raise InputError(
                f"{what} jumps from {time[i]:.6g} to {time[i + 1]:.6g} s after sample {i + 1}, where {missing} "
                f"sample{'s are' if missing > 1 else ' is'} missing, expected a record without a gap: cut it in two "
                "there, or fill it before"
            )
