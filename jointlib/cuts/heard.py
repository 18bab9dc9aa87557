"""What the record of a cut tells: stable or chatter, and at which frequency.

A stable cut repeats with the revolution, run-out and all, so what one revolution differs from the one before is noise.
Chatter does not repeat with it (Schmitz's once-per-revolution sampling); a flip repeats with every second tooth, and is
told from run-out only by its size where the number of teeth is even.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

_FEWEST = 12
"""Revolutions."""
_WITHIN = 0.01
"""Share of the nominal speed within which the true one is looked for."""
_STABLE, _CHATTER = 0.1, 0.3
"""Shares of the vibration that does not repeat: below the one stable, from the other on chatter."""
_STANDS_OUT = 10.0
"""Times the middle of the spectrum from which on a line is one."""
_AWAY = 3.0
"""Widths of a line of the spectrum that a line of chatter stands from those of the spindle, at least."""
_PADDED = 4


@dataclass(frozen=True)
class Heard:
    """What a record tells of its cut.

    Parameters
    ----------
    verdict
        ``"stable"``, ``"chatter"`` or ``"marginal"``; ``"unknown"`` where noise hides it.
    chatter_frequency
        Hz of the strongest line away from those of the spindle; None where none stands out.
    kind
        ``"hopf"`` or ``"flip"``; empty without chatter.
    share
        Effective value of what does not repeat with the revolution, over that of the vibration.
    speed
        rpm as the record has it.
    """

    verdict: str
    chatter_frequency: float | None
    kind: str
    share: float
    speed: float


def heard(signal: Array, rate: float, speed: float, teeth: int, where: str) -> Heard:
    """Judge a cut by its record, (samples,), at a nominal speed in rpm; ``where`` begins what is refused."""
    x = np.asarray(signal, dtype=float) - np.mean(signal)
    nominal = speed / 60
    if len(x) / rate * nominal < _FEWEST:
        turns = len(x) / rate * nominal
        raise InputError(f"{where}: holds {turns:.3g} revolutions, expected at least {_FEWEST} to tell a cut by")
    if not np.any(x):
        raise InputError(f"{where}: never changes, expected the sound or vibration of a cut")
    size = _PADDED * 2 ** int(np.ceil(np.log2(len(x))))
    spectrum = np.abs(np.fft.rfft(x * np.hanning(len(x)), size)) ** 2
    step, width = rate / size, 2 * rate / len(x)
    frequency = np.arange(len(spectrum)) * step
    turning = _turning(spectrum, step, nominal, teeth, rate / 2)
    order = frequency / turning
    apart = np.abs(order - np.round(order)) * turning
    half = np.abs(order / teeth - 0.5 - np.round(order / teeth - 0.5)) * teeth * turning
    of_teeth = np.abs(order / teeth - np.round(order / teeth)) * teeth * turning
    audible = (frequency > 0.5 * turning) & (frequency < 0.8 * rate / 2)
    away = audible & (apart > _AWAY * width)
    floor = float(np.median(spectrum[away])) if np.any(away) else 0.0
    share = _unrepeated(x, rate / turning)
    peak = int(np.argmax(np.where(away, spectrum, 0.0)))
    flip = int(np.argmax(np.where(audible & (half < _AWAY * width), spectrum, 0.0)))
    tooth = float(np.max(np.where(audible & (of_teeth < _AWAY * width), spectrum, 0.0)))
    if teeth % 2 == 0 and spectrum[flip] > max(tooth, spectrum[peak]):  # repeats with the revolution, yet too large
        return Heard("chatter", float(_refined(spectrum, flip) * step), "flip", share, 60 * turning)
    stands_out = spectrum[peak] > _STANDS_OUT**2 * floor
    if share < _STABLE or (share < _CHATTER and not stands_out):
        return Heard("stable", None, "", share, 60 * turning)
    if not stands_out:
        return Heard("unknown", None, "", share, 60 * turning)
    found = _refined(spectrum, peak) * step
    kind = "flip" if half[peak] < _AWAY * width else "hopf"
    return Heard("chatter" if share >= _CHATTER else "marginal", float(found), kind, share, 60 * turning)


def _turning(spectrum: Array, step: float, nominal: float, teeth: int, highest: float) -> float:
    """Revolutions per second at which the harmonics of the teeth hold most, evenly weighed so that none decides."""
    orders = teeth * np.arange(1, 7)
    orders = orders[orders * nominal < 0.8 * highest]
    if not len(orders):
        return nominal
    fine = step / orders[-1]
    tried = nominal + fine * np.arange(-int(_WITHIN * nominal / fine), int(_WITHIN * nominal / fine) + 1)
    level = np.log(np.maximum(spectrum, 1e-12 * np.max(spectrum)))
    held = np.sum(np.interp(orders[:, None] * tried, np.arange(len(level)) * step, level), axis=0)
    return float(tried[np.argmax(held)])


def _unrepeated(x: Array, period: float) -> float:
    """Effective value of half of what one revolution, of ``period`` samples, differs from the next, over the whole."""
    at = np.arange(len(x), dtype=float)
    later = np.interp(at + period, at, x, right=np.nan)
    inside = np.isfinite(later)
    differs = float(np.mean((later[inside] - x[inside]) ** 2)) / 2
    return float(np.sqrt(differs / np.mean(x**2)))


def _refined(spectrum: Array, line: int) -> float:
    """The top of a line by a parabola through the logarithms around it, in lines."""
    if not 0 < line < len(spectrum) - 1 or np.any(spectrum[line - 1 : line + 2] <= 0):
        return float(line)
    a, b, c = np.log(spectrum[line - 1 : line + 2])
    bend = a - 2 * b + c
    return float(line + (0.5 * (a - c) / bend if bend < 0 else 0.0))
