"""What is wrong with records before anything is computed from them: dead channels, flat tops, periods not whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.measurement import Measurement, Record

NEEDED = ("a1", "a2")
_REPEATS = 0.3
"""Correlation of one period with the next below which a record is not periodic at all."""
_EXPLAINED = 0.5
"""Share of the difference between periods that a shift must explain to be one."""
_AGREE = 0.25
"""Relative spread of the shifts of the channels: one clock drives them all."""
_LEAK = 0.01
"""Share of the amplitude between the lines beyond which no line can be trusted."""
_NOTHING = 5e-4
"""Share of the amplitude between the lines that is not worth a word."""
_NARROW = 0.1
"""Relative bandwidth below which a shift in time and a turn of the phase are the same."""


def dead_channels(record: Record, names: Sequence[str]) -> tuple[str, ...]:
    """The channels that stand still while others move."""
    still = {name: float(np.ptp(record.channels[name])) == 0 for name in names if name in record.channels}
    return tuple(name for name, dead in still.items() if dead) if not all(still.values()) else ()


def without_dead_channels(measurement: Measurement, records: Sequence[Record]) -> tuple[Measurement, tuple[str, ...]]:
    """The measurement without the channels that are dead in any of its records, and a sentence for each.

    What needs them cannot be decided any more; a rig without a1 or a2 is refused. Quiet records are not asked, where
    a good sensor may show nothing, nor are inputs, as a preload that is held.
    """
    names = [c.name for c in measurement.channels if c.quantity in ("acceleration", "force") and not c.is_input]
    dead: dict[str, str] = {}
    for record in records:
        if record.source.role != "quiet":
            dead |= {name: record.name for name in dead_channels(record, names) if name not in dead}
    for name in NEEDED:
        if name in dead:
            raise InputError(
                f"{dead[name]}: channel {name} is constant while others move; it is dead, and a rig needs a1 and a2"
            )
    said = tuple(
        f"{where}: channel {name} is constant while others move; it is dead and left out of all records."
        for name, where in dead.items()
    )
    if not dead:
        return measurement, ()
    channels = tuple(c for c in measurement.channels if c.name not in dead)
    corrections = tuple(c for c in measurement.corrections if c.channel not in dead)
    return replace(measurement, channels=channels, corrections=corrections), said


def flat_tops(x: Array) -> tuple[int, float] | None:
    """(samples, level) where the signal seems to be cut off, without knowing the range of its sensor.

    At least 5 samples and 0.05 % of all stand at an extreme, three of them in a row somewhere, and they outnumber
    those within 1 % beneath: a smooth peak spends ever less time nearer to its top.
    """
    found = 0, 0.0
    for top in (x, -x):
        level = float(top.max())
        at = top >= level - 1e-6 * abs(level)
        beneath = int(np.sum(top >= level - 0.01 * abs(level))) - int(at.sum())
        run = bool(np.any(at[2:] & at[1:-1] & at[:-2]))
        if run and at.sum() >= max(5, 5e-4 * len(x)) and at.sum() > 1.5 * beneath:
            found = found[0] + int(at.sum()), max(found[1], abs(level))
    return found if found[0] else None


@dataclass(frozen=True)
class Shift:
    """How a channel changes over a whole number of declared periods, read as a shift in time."""

    samples: float
    """What is missing to the lag after which it repeats."""
    explained: float
    """Share of the change that the shift explains."""
    turn: float
    """rms of its slope over its own rms, rad a sample."""
    bandwidth: float
    """Spread of its frequencies over their mean."""


def best_lag(channels: Sequence[Array], period: int) -> tuple[float, float]:
    """(lag, correlation) at which the channels together repeat best, between half and one and a half periods.

    The correlation is interpolated without error between the samples; where several lags are as good, as for a single
    sine, the one nearest to the declared period is meant.
    """
    n, fine = len(channels[0]), 8
    size = 1 << (2 * n - 1).bit_length()
    unit = [x / np.sqrt(np.sum(x**2)) for x in channels]
    power = np.sum([np.abs(np.fft.rfft(x, size)) ** 2 for x in unit], axis=0)
    lags = np.arange(fine * (period // 2), fine * min(n - period // 2, 3 * period // 2) + 1)
    product = fine * np.fft.irfft(power, fine * size)[lags]
    energy = np.concatenate([[0.0], np.cumsum(np.sum(np.square(unit), axis=0))])
    here, after = np.interp([n - lags / fine, lags / fine], np.arange(n + 1), energy)
    rho = product / np.sqrt(np.maximum(here * (energy[-1] - after), 1e-300))
    best = float(rho.max())
    good = lags[rho >= best - 0.02 * abs(1 - best) - 1e-9] / fine
    return float(good[np.argmin(np.abs(good - period))]), best


def shift_of(x: Array, declared: int, lag: float) -> Shift:
    """How far a channel that repeats after about ``lag`` samples explains what changes over the declared ones.

    x(t + L) = x(t + L − T) ≈ x(t) + (L − T)·x′(t), L the whole part of the lag and T the true one: what is missing
    to it comes from this regression.
    """
    whole = round(lag)
    inner = slice(2, len(x) - max(whole, declared) - 2)
    slope = np.convolve(x, np.array([-1, 8, 0, -8, 1]) / 12, mode="same")[inner]
    here, after, change = x[inner], x[whole:][inner], x[declared:][inner] - x[inner]
    rest = float(slope @ (after - here)) / max(float(slope @ slope), 1e-300)
    changed, left = float(change @ change), float(np.sum((after - here - rest * slope) ** 2))
    power = np.abs(np.fft.rfft(x)) ** 2
    power[power < 1e-4 * power.max()] = 0
    line = np.arange(len(power))
    mean = float(line @ power / power.sum())
    return Shift(
        whole - rest - declared,
        1 - left / changed if changed > 0 else 0.0,
        float(np.sqrt(slope @ slope / max(float(here @ here), 1e-300))),
        float(np.sqrt((line - mean) ** 2 @ power / power.sum())) / mean,
    )


def check_period(name: str, channels: Mapping[str, Array], period: int) -> str | None:
    """Refuse a steady record whose declared period is not the true one, or say that it leaks a little.

    Everything that varies in a joint or a sensor moves single channels or single lines. A period that is not whole
    shifts all channels alike, by δ samples a period; over n periods ω·δ·n/√12 of the amplitude at ω (rad a sample)
    leaks between the lines.
    """
    moving = {c: x - x.mean() for c, x in channels.items() if np.ptp(x) > 0}
    count = min(len(x) for x in channels.values()) // period
    if count < 2 or not moving:
        return None
    lag, correlation = best_lag(list(moving.values()), period)
    if correlation < _REPEATS:
        raise InputError(
            f"{name}: nothing repeats after {period} samples nor near that (correlation at most {correlation:.2f}), "
            "expected periodic excitation in steady state and its period in samples"
        )
    # A small shift adds up over the record, noise does not.
    stride = count - 1 if abs(lag - period) * (count - 1) < period / 2 else 1
    shifts = {c: shift_of(x, stride * period, stride * lag) for c, x in moving.items()}
    missed = np.array([s.samples for s in shifts.values()]) / stride
    middle = float(np.median(missed))
    together = np.all(np.abs(missed - middle) <= _AGREE * abs(middle))
    if not together or any(s.explained < _EXPLAINED for s in shifts.values()):
        return None
    leak = min(1.0, abs(middle) * float(np.median([s.turn for s in shifts.values()])) * count / np.sqrt(12))
    if leak < _NOTHING:
        return None
    found = (
        f"{name}: the period of {period} samples is not whole; the signals shift by {abs(middle):.3g} samples a "
        f"period, expected {period + middle:.7g}"
    )
    lost = f"{100 * leak:.1f} % of the amplitude leaks between the lines"
    if leak < _LEAK:
        return f"{found}. {lost}."
    if "P" not in shifts and max(s.bandwidth for s in shifts.values()) < _NARROW:
        return f"{found}, unless the joint changes during the record: in a narrow band and without P they look alike."
    raise InputError(f"{found}; {lost}. Drive the generator from the clock of the converter, or resample")
