"""A measured path made ready: one zero-phase filter, derivatives after it, edges dropped, thinned last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, detrend, medfilt, sosfiltfilt, welch

from jointlib.arrays import Array
from jointlib.effect import Path
from jointlib.errors import InputError
from jointlib.measurement import Measurement, Record

ORDER = 4


@dataclass(frozen=True)
class Preparation:
    """How every record of a measurement is filtered and thinned; chosen once, on the fit records."""

    sample_rate: float
    """Hz."""
    cutoff: float
    """Hz; Butterworth of order 4, forward and backward."""
    edge: int
    """Samples dropped at each end: 25 periods of the cutoff frequency, at most 5 % of the shortest record."""
    stride: int
    """One sample is kept of so many: two per period of the cutoff frequency."""
    derivative: str
    """``central`` differences where they are within 3 % at the cutoff frequency, else ``spectral``."""
    rule: str
    """Where the cutoff comes from."""

    def filtered(self, x: Array) -> Array:
        """𝓕x along the last axis, without phase shift."""
        sections = butter(ORDER, self.cutoff / (self.sample_rate / 2), output="sos")
        return np.asarray(sosfiltfilt(sections, x, axis=-1))

    def slope(self, x: Array) -> Array:
        """Time derivative of a filtered signal."""
        if self.derivative == "central":
            return np.asarray(np.gradient(x) * self.sample_rate)
        return _spectral_slope(x, self.sample_rate)


@dataclass(frozen=True)
class Run:
    """One record, filtered at the full rate; ``keep`` are the samples that enter the fit."""

    name: str
    condition: str | None
    sha256: str
    path: Path
    acceleration: Array
    """m/s²."""
    force: Array
    """N."""
    preparation: Preparation
    period: int | None

    @property
    def keep(self) -> slice:
        edge = self.preparation.edge
        return slice(edge, len(self.force) - edge, self.preparation.stride)

    @property
    def time(self) -> Array:
        """s since the first sample of the record, of the samples that are kept."""
        return np.asarray(np.arange(len(self.force))[self.keep] * self.path.time_step)

    def stepped(self, has_memory: bool) -> Path:
        """The path at the full rate; for laws with memory, which are stepped one by one, at five samples per period
        of the cutoff frequency: their force depends on where the path turns, not on how densely it is sampled."""
        every = max(1, int(self.preparation.sample_rate / (5 * self.preparation.cutoff))) if has_memory else 1
        z, v = self.path.displacement[::every], self.path.velocity[::every]
        return Path(z, v, self.path.time_step * every)

    def spread(self, stepped: Array) -> Array:
        """Values along :meth:`stepped` at the full rate again."""
        count, full = stepped.shape[-1], len(self.force)
        if count == full:
            return stepped
        at = np.arange(count) * -(-full // count)
        rows = [np.interp(np.arange(full), at, row) for row in stepped.reshape(-1, count)]
        return np.array(rows).reshape(*stepped.shape[:-1], full)

    def column(self, full: Array) -> Array:
        """A nonlinear function of the full-rate path: through the filter that the force went through, then thinned."""
        return np.asarray(self.preparation.filtered(full)[..., self.keep])


def choose_preparation(measurement: Measurement, records: Sequence[Record]) -> Preparation:
    """Settings from sample rate and spectra of the fit records.

    The upper end of ``band`` is the cutoff where the file gives one. Else it is √2 times the frequency below which
    99.9 % of the force power above its noise lies, but no more than where the displacement sinks to ten times its
    noise, and 0.4 of the sample rate; then the nearest of 1, 1.5, 2, 3, 4, 5, 7,
    times a power of ten. Noise is the median density in the top quarter of the spectrum.
    """
    rate = measurement.sample_rate or 0.0
    shortest = min(len(r) for r in records)
    if shortest < 256:
        raise InputError(f"{measurement.source}: a record has {shortest} samples, expected at least 256 for a trace")
    if measurement.band is not None:
        cutoff, rule = measurement.band[1], "upper end of the band in the measurement file"
    else:
        force, where = _force_channel(measurement), _displacement_channel(measurement)
        needed = max(_power_frequency(r.channels[force], rate) for r in records)
        seen = max(_signal_frequency(r.channels[where], rate) for r in records)
        cutoff = min(np.sqrt(2) * needed, seen, 0.4 * rate)
        cutoff = _round_number(max(cutoff, 10 * rate / shortest))
        rule = "99.9 % of the force power times 1.4, within the band where displacement exceeds its noise"
    cutoff = min(cutoff, 0.45 * rate)
    edge = min(round(25 * rate / cutoff), shortest // 20)
    stride = max(1, int(rate / (2 * cutoff)))
    derivative = "central" if (2 * np.pi * cutoff / rate) ** 2 / 6 < 0.03 else "spectral"
    return Preparation(rate, cutoff, edge, stride, derivative, rule)


def prepare(measurement: Measurement, record: Record, preparation: Preparation) -> Run:
    """Filter force and displacement alike; velocity and acceleration as measured, or derived after the filter."""
    filtered = preparation.filtered
    z = filtered(record.channels[_displacement_channel(measurement)])
    if not np.ptp(z) > 0:
        raise InputError(f"{record.source.file}: the displacement does not move, expected a path")
    speed, acceleration = measurement.of("velocity"), measurement.of("acceleration")
    v = filtered(record.channels[speed[0].name]) if speed else preparation.slope(z)
    a = filtered(record.channels[acceleration[0].name]) if acceleration else preparation.slope(v)
    return Run(
        name=record.name,
        condition=record.source.condition,
        sha256=record.sha256,
        path=Path(z, v, 1 / preparation.sample_rate),
        acceleration=a,
        force=filtered(record.channels[_force_channel(measurement)]),
        preparation=preparation,
        period=record.period,
    )


def _force_channel(measurement: Measurement) -> str:
    return measurement.of("force")[0].name


def _displacement_channel(measurement: Measurement) -> str:
    """The displacement; the position where there is no other (beside a displacement it is the feed)."""
    return (measurement.of("displacement") or measurement.of("position"))[0].name


def _round_number(x: float) -> float:
    """The nearest of the preferred numbers, so that a slightly different record is filtered alike."""
    decade = 10.0 ** np.floor(np.log10(x))
    preferred = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0]) * decade
    return float(preferred[np.argmin(np.abs(np.log(preferred / x)))])


def _density(x: Array, rate: float) -> tuple[Array, Array, float]:
    """Power density over frequency and the noise level of its top quarter."""
    n = min(4096, 2 ** int(np.log2(len(x) / 6)))
    f, P = welch(detrend(x), rate, nperseg=n)
    return np.asarray(f), np.asarray(P), float(np.median(P[f > 3 * rate / 8]))


def _power_frequency(x: Array, rate: float) -> float:
    f, P, noise = _density(x, rate)
    power = np.cumsum(np.maximum(P - 3 * noise, 0.0))
    return float(f[np.searchsorted(power, 0.999 * power[-1])]) if power[-1] > 0 else rate


def _signal_frequency(x: Array, rate: float) -> float:
    f, P, noise = _density(x, rate)
    above = np.flatnonzero(medfilt(P, 5) > 10 * noise)
    return float(f[above[-1]]) if above.size else rate


def _spectral_slope(x: Array, rate: float) -> Array:
    """Derivative by the spectrum of the odd extension, the line between the ends taken out and put back."""
    n = len(x)
    line = np.linspace(x[0], x[-1], n)
    y = x - line
    spectrum = np.fft.rfft(np.concatenate([y, -y[-2:0:-1]]))
    omega = 2 * np.pi * np.fft.rfftfreq(2 * (n - 1), 1 / rate)
    slope = np.fft.irfft(1j * omega * spectrum, 2 * (n - 1))[:n]
    return np.asarray(slope + (x[-1] - x[0]) / (n - 1) * rate)
