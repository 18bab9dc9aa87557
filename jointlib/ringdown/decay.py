"""The free decay in a record: where it begins, what it is worth, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.measurement import MOTIONS, Channel, Measurement, Record
from jointlib.ringdown.hum import without_hum

_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
_TOP = 0.98
"""Of the largest amplitude; what comes before it falls below is still being driven."""
_FALL = 0.7
"""Of the first amplitude; a decay falls below it."""
_CYCLES, _SAMPLES = 8.0, 6.0
"""Least cycles of a decay, and samples of a cycle."""
_FLAT = 3
"""Samples of one value at the top that make a flat one."""
_END, _STILL = 0.02, 1e-3
"""Share of a record that is its end, and share of its swing that never stands out of that."""
_STANDS_OUT, _LARGER = 6.0, 2.0
"""Deviations by which a sample stands out of a beginning, and a part is larger than an end."""
_BETWEEN = 4
"""Lines told for one that a record resolves."""
_HEARD = 1e-3
"""Of the largest motion, hum from which on is worth a word."""
_QUIET = 0.02
"""Of the largest force; below it the force is off."""


@dataclass(frozen=True)
class Decay:
    """Free motion from its first sample on, in the unit of its channel."""

    name: str
    condition: str
    signal: Array
    rate: float
    """Hz."""
    order: int
    """0 displacement, 1 velocity, 2 acceleration."""
    frequency: float
    """Hz, of the largest line."""
    first: int
    """Sample of the record at which it begins."""
    noise: float
    """Standard deviation of the noise, as it would be if it were white."""
    messages: tuple[str, ...]

    @property
    def moving(self) -> Array:
        """The signal until it is no more than what the record ends with."""
        return self.signal[: in_motion(self.signal).stop]


def motion_of(measurement: Measurement) -> Channel:
    """The one channel that tells the motion."""
    return next(c for quantity in MOTIONS for c in measurement.of(quantity))


def free_decay(measurement: Measurement, record: Record) -> Decay:
    """The decay in a record; refused in a sentence where there is none."""
    channel = motion_of(measurement)
    raw, rate, where = record.channels[channel.name], record.sample_rate, record.name
    if len(raw) < _CYCLES * _SAMPLES or not np.ptp(raw) > 0:
        raise InputError(f"{where}: {len(raw)} samples that tell no motion, expected a free decay")
    x, hum = without_hum(raw, rate)
    moves = in_motion(x)
    frequency = strongest(x[moves], rate, measurement.band)
    if rate < _SAMPLES * frequency:
        raise InputError(
            f"{where}: {rate / frequency:.2g} samples in a cycle of {frequency:.4g} Hz, expected at least {_SAMPLES:g}"
        )
    envelope = envelope_of(x - np.mean(x), rate / frequency)
    begin, messages = _begin(measurement, record, envelope, moves.start, rate / frequency)
    messages += [
        f"{where}: hum of {f:.4g} Hz, {100 * size / np.ptp(x) * 2:.2g} % of the largest motion, does not decay and is "
        "taken out."
        for f, size in hum
        if size > _HEARD * np.ptp(x) / 2
    ]
    after_clip = _unclipped(raw, channel)
    if after_clip > begin:
        messages.append(
            f"{where}: clipped until {after_clip / rate:.3g} s; the decay is taken from there on, and larger "
            "amplitudes are not told."
        )
        begin = after_clip
    signal = x[begin:]
    _refuse_growth(where, envelope, rate / frequency)
    if len(signal) < _CYCLES * rate / frequency:
        count = len(signal) * frequency / rate
        raise InputError(f"{where}: {count:.1f} cycles of free motion, expected at least {_CYCLES:g}")
    _refuse_steady(where, envelope[begin:], rate / frequency)
    return Decay(
        where,
        record.source.condition or where,
        signal,
        rate,
        _ORDER[channel.quantity],
        strongest(signal[: in_motion(signal).stop], rate, measurement.band),
        begin,
        white_noise(signal, 6 * frequency / rate),
        tuple(messages),
    )


def in_motion(x: Array) -> slice:
    """From the first sample that stands out of a record's beginning to the last part that is larger than its end."""
    some, least = max(8, round(_END * len(x))), _STILL * float(np.ptp(x))
    begin, end = x[:some], x[-some:]
    away = np.abs(x - np.mean(begin)) > max(_STANDS_OUT * float(np.std(begin)), least)
    first = int(np.argmax(away))
    parts = (x[::-1][: len(x) // some * some] - np.mean(end)).reshape(-1, some)
    larger = np.sqrt(np.mean(parts**2, axis=1)) > max(_LARGER * float(np.std(end)), least)
    last = len(x) - some * int(np.argmax(larger))
    return slice(first, last) if last - first > some else slice(0, len(x))


def spectrum(x: Array, rate: float, times: int = 1) -> tuple[Array, Array]:
    """Frequencies in Hz and the size of the windowed (Hann) spectrum of a record without its mean.

    Zeros make it ``times`` as long, which tells between its lines.
    """
    n = times * len(x)
    return np.fft.rfftfreq(n, 1 / rate).astype(float), np.abs(np.fft.rfft((x - np.mean(x)) * np.hanning(len(x)), n))


def strongest(x: Array, rate: float, band: Sequence[float] | None) -> float:
    """Hz of the largest line, in the band where there is one."""
    f, size = spectrum(x, rate, _BETWEEN)
    inside = (f > 1.5 * rate / len(x)) if band is None else (f >= band[0]) & (f <= band[1])
    if not np.any(inside):
        raise InputError(f"band {band}: {len(x) / rate:.3g} s of record resolve no line in it")
    return float(f[inside][np.argmax(size[inside])])


def white_noise(x: Array, above: float) -> float:
    """Deviation of white noise with the middle of the spectrum above a frequency (cycles per sample, at most 0.3)."""
    window = np.hanning(len(x))
    power = np.abs(np.fft.rfft((x - np.mean(x)) * window)) ** 2 / np.sum(window**2)
    first = int(min(above, 0.3) * len(x))
    return float(np.sqrt(np.median(power[first:]) / np.log(2)))


def envelope_of(x: Array, cycle: float) -> Array:
    """Amplitude as the root mean square of one cycle."""
    n = max(2, round(cycle))
    power = np.convolve(np.square(x), np.ones(n) / n, mode="same")
    edge = n // 2
    power[:edge], power[len(x) - edge :] = power[edge], power[len(x) - edge - 1]
    return np.asarray(np.sqrt(2 * power))


def _begin(
    measurement: Measurement, record: Record, envelope: Array, start: int, cycle: float
) -> tuple[int, list[str]]:
    """The first sample of free motion: the end of the force where it was measured, else the end of the top, or half a
    cycle after the start where a stroke or a release starts it at once."""
    forces = measurement.of("force")
    if forces:
        force = np.abs(record.channels[forces[0].name])
        on = np.flatnonzero(force > _QUIET * np.max(force)) if np.any(force) else np.zeros(0, dtype=int)
        begin = int(on[-1]) + 1 if len(on) else 0
        if begin < len(force):
            return begin, []
        raise InputError(
            f"{record.name}: the force {forces[0].name} acts until the end, expected a free decay after it"
        )
    top = int(np.flatnonzero(envelope >= _TOP * np.max(envelope))[-1])
    if top <= cycle and start <= cycle / 2:
        return 0, []
    at_once = top - start < cycle
    begin = start + round(cycle / 2) if at_once else min(top + round(cycle), len(envelope) - 1)
    return begin, [
        f"{record.name}: the free decay begins at {begin / record.sample_rate:.4g} s, found from the record."
    ]


def _unclipped(x: Array, channel: Channel) -> int:
    """The sample after the last that is clipped; 0 where none is."""
    size = np.abs(x)
    largest = float(np.max(size))
    if channel.full_scale is not None:
        at = np.flatnonzero(size >= 0.999 * channel.full_scale)
        return int(at[-1]) + 1 if len(at) else 0
    at = np.flatnonzero(size >= (1 - 1e-9) * largest)
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    flat = [run for run in runs if len(run) >= _FLAT]
    return int(flat[-1][-1]) + 1 if len(flat) > 1 else 0


def _refuse_growth(where: str, envelope: Array, cycle: float) -> None:
    """Refuse a record that ends as large as it ever was."""
    first, last = _ends(envelope, cycle)
    if last > 0.9 * np.max(envelope) and last > 1.2 * first:
        raise InputError(f"{where}: the motion grows from {first:.3g} to {last:.3g}, expected a free decay")
    if last > 0.9 * np.max(envelope):
        _refuse_steady(where, envelope, cycle)


def _refuse_steady(where: str, envelope: Array, cycle: float) -> None:
    first, last = _ends(envelope, cycle)
    if last > _FALL * first:
        raise InputError(
            f"{where}: the amplitude only goes from {first:.3g} to {last:.3g}, one amplitude tells nothing over "
            f"amplitude; expected a decay below {_FALL:g} of its beginning"
        )


def _ends(envelope: Array, cycle: float) -> tuple[float, float]:
    n = max(1, round(2 * cycle))
    return float(np.median(envelope[:n])), float(np.median(envelope[-n:]))
