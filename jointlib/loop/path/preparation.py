"""A measured path made ready: one zero-phase filter, derivatives after it, edges dropped, thinned last."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.effect import Path
from jointlib.identification.path_record import low_pass, slope
from jointlib.loop.answer.following import followed
from jointlib.loop.path.force.kept_low_pass import low_pass_kept
from jointlib.measurement import Measurement, Record
from jointlib.modulation import CONDITION_OF
from jointlib.path_fault import PathFault, PathRecord

_CLOSE = 1e-3
_STEPS = 5
_SAMPLES = 32
"""In a period of the cutoff frequency, of records that are sampled more than twice as densely."""


@dataclass(frozen=True)
class Preparation:
    """How every record of a measurement is filtered and thinned; chosen once, on the fit records."""

    sample_rate: float
    """Hz, of the records as they are used."""
    cutoff: float
    """Hz."""
    edge: int
    """Samples dropped at each end: 25 periods of the cutoff frequency, at most 5 % of the shortest record."""
    stride: int
    """One sample is kept of so many: two per period of the cutoff frequency."""
    derivative: str
    """``central`` differences and a Butterworth filter of order 4, forward and backward, where the differences are
    within 0.1 % at the cutoff frequency; else ``spectral``: derivatives and a sharp cut in the spectrum."""
    rule: str
    """Where the cutoff comes from."""
    step: int = 1
    """Laws with memory are stepped along one sample of so many: at least five in a period of the cutoff frequency."""
    thinning: int = 1
    """One sample of so many of a record is used, after a low pass of its own: at least 32 in a period of the cutoff."""

    @property
    def filter(self) -> str:
        """The filter in words."""
        if self.derivative == "central":
            return "Butterworth order 4, forward and backward, on force and displacement alike"
        return "spectra cut above the cutoff, on force and displacement alike"

    def filtered(self, x: Array) -> Array:
        """𝓕x along the last axis, without phase shift."""
        if self.derivative == "central":
            return low_pass(x, self.cutoff, self.sample_rate)
        spectrum, line = _odd_spectrum(x)
        frequency = scipy.fft.rfftfreq(2 * (x.shape[-1] - 1), 1 / self.sample_rate)
        spectrum[..., frequency > self.cutoff] = 0
        return np.asarray(scipy.fft.irfft(spectrum, 2 * (x.shape[-1] - 1))[..., : x.shape[-1]] + line)

    def slope(self, x: Array) -> Array:
        """Time derivative of a filtered signal."""
        if self.derivative == "central":
            return slope(x, self.sample_rate)
        n = len(x)
        spectrum, line = _odd_spectrum(x)
        omega = 2 * np.pi * scipy.fft.rfftfreq(2 * (n - 1), 1 / self.sample_rate)
        own = scipy.fft.irfft(1j * omega * spectrum, 2 * (n - 1))[:n]
        return np.asarray(own + (line[1] - line[0]) * self.sample_rate)


@dataclass(frozen=True, eq=False)
class Run:
    """One record, filtered at the full rate; ``keep`` are the samples that enter the fit."""

    name: str
    condition: str | None
    sha256: str
    path: Path
    acceleration: Array
    """m/s²."""
    force: Array
    """N, filtered."""
    preparation: Preparation
    period: int | None
    recorded: PathRecord
    """The force as it was read, with its clock and the place of the feed."""
    inputs: Mapping[str, Array]
    """What parameters may follow, by condition, in SI at the full rate: see :mod:`jointlib.modulation`."""
    begin: int
    """First sample that counts: after the edge, and on a test that is ramped up after the first quarter cycle, when
    contacts have forgotten how they were left."""

    @property
    def keep(self) -> slice:
        return slice(self.begin, len(self.force) - self.preparation.edge, self.preparation.stride)

    @property
    def time(self) -> Array:
        """s since the first sample of the record, of the samples that are kept."""
        return np.asarray(np.arange(len(self.force))[self.keep] * self.path.time_step)

    def without(self, fault: PathFault, parameters: Mapping[str, float]) -> Run:
        """The record with a fault of its force undone."""
        r = self.recorded
        force = fault.undo(r.force, r.time, r.position, parameters)
        return replace(self, recorded=replace(r, force=force), force=self.preparation.filtered(force))

    def stepped(self) -> Path:
        """The path that laws with memory are stepped along one by one, thinned: their force depends on where the path
        turns, not on how densely it is sampled."""
        every = self.preparation.step
        return Path(self.path.displacement[::every], self.path.velocity[::every], self.path.time_step * every)

    def spread(self, stepped: Array) -> Array:
        """Values along :meth:`stepped` (and beyond) at the full rate again."""
        every, count = self.preparation.step, len(self.force)
        if every == 1:
            return stepped[:count]
        return np.asarray(np.interp(np.arange(count), np.arange(len(stepped)) * every, stepped))

    def column(self, full: Array) -> Array:
        """A nonlinear function of the full-rate path: through the filter that the force went through, then thinned."""
        p = self.preparation
        if p.derivative == "central":
            return low_pass_kept(full, p.cutoff, p.sample_rate, self.keep)
        return np.asarray(p.filtered(full)[..., self.keep])


def choose_preparation(measurement: Measurement, records: Sequence[Record]) -> Preparation:
    """Settings from sample rate and spectra of the fit records.

    The upper end of ``band`` is the cutoff where the file gives one. Else it is √2 times the frequency below which
    99.9 % of the force power above its noise lies, but no more than where the displacement sinks to ten times its
    noise, and 0.4 of the sample rate; then the nearest of 1, 1.5, 2, 3, 4, 5, 7,
    times a power of ten. Noise is the median density in the top quarter of the spectrum.
    """
    rate = measurement.sample_rate or 0.0
    shortest = min(len(r) for r in records)
    if measurement.band is not None:
        cutoff, rule = measurement.band[1], "upper end of the band in the measurement file"
    else:
        force, where = force_channel(measurement), displacement_channel(measurement)
        needed = max(_power_frequency(r.channels[force], rate) for r in records)
        seen = max(_signal_frequency(r.channels[where], rate) for r in records)
        cutoff = min(np.sqrt(2) * needed, seen, 0.4 * rate)
        cutoff = _round_number(max(cutoff, 10 * rate / shortest))
        rule = "99.9 % of the force power times 1.4, within the band where displacement exceeds its noise"
    cutoff = min(cutoff, 0.45 * rate)
    thinning = max(1, int(rate / (_SAMPLES * cutoff)))
    thinning = next(n for n in range(thinning, 0, -1) if all((r.period or 0) % n == 0 for r in records))
    records, rate, shortest = [thinned(r, thinning) for r in records], rate / thinning, -(-shortest // thinning)
    edge = min(round(25 * rate / cutoff), shortest // 20)
    stride = max(1, int(rate / (2 * cutoff)))
    derivative = "central" if (2 * np.pi * cutoff / rate) ** 4 / 30 < 1e-3 else "spectral"
    chosen = Preparation(rate, cutoff, edge, stride, derivative, rule, thinning=thinning)
    paths = [chosen.filtered(r.channels[displacement_channel(measurement)]) for r in records]
    coarsest = max(1, int(rate / (_STEPS * cutoff)))
    return replace(chosen, step=max(s for s in range(1, coarsest + 1) if s == 1 or _follows(paths, s)))


def prepare(measurement: Measurement, record: Record, preparation: Preparation) -> Run:
    """Filter force and displacement alike; velocity and acceleration as measured, or derived after the filter."""
    filtered = preparation.filtered
    record = thinned(record, preparation.thinning)
    if preparation.derivative == "spectral":
        record = _of_fast_length(record, preparation.edge // 4)  # far inside of what the edge leaves out
    displacement = record.channels[displacement_channel(measurement)]
    force = record.channels[force_channel(measurement)]
    feed, clock = measurement.of("position"), measurement.of("time")
    start = record.source.start or 0.0
    time = record.channels[clock[0].name] if clock else start + np.arange(len(force)) / preparation.sample_rate
    z = filtered(displacement)
    speed, acceleration = measurement.of("velocity"), measurement.of("acceleration")
    v = filtered(record.channels[speed[0].name]) if speed else preparation.slope(z)
    a = filtered(record.channels[acceleration[0].name]) if acceleration else preparation.slope(v)
    path = Path(z, v, 1 / preparation.sample_rate)
    return Run(
        name=record.name,
        condition=record.source.condition,
        sha256=record.sha256,
        path=path,
        acceleration=a,
        force=filtered(force),
        preparation=preparation,
        period=record.period,
        recorded=PathRecord(path, force, time, record.channels[feed[0].name] if feed else displacement),
        inputs={CONDITION_OF[c.quantity]: record.channels[c.name] for c in reversed(followed(measurement))},
        begin=max(preparation.edge, _ramp(z)),
    )


def thinned(record: Record, every: int) -> Record:
    """One sample of so many, after a low pass at 0.8 of what such samples can show (Butterworth of order 8, forward and
    backward)."""
    if every == 1:
        return record
    sections = scipy.signal.butter(8, 0.8 / every, output="sos")
    channels = {
        n: x if np.all(np.diff(x) > 0) else scipy.signal.sosfiltfilt(sections, x) for n, x in record.channels.items()
    }
    return replace(
        record,
        channels={n: np.ascontiguousarray(x[::every]) for n, x in channels.items()},
        sample_rate=record.sample_rate / every,
        period=record.period and record.period // every,
    )


def _of_fast_length(record: Record, most: int) -> Record:
    """Without its last few samples, ``most`` of them, where the number of the others less one has small factors alone;
    a spectrum is several times slower else."""
    last = len(record) - 1
    fast = next((n for n in range(last, max(last - most, 1), -1) if scipy.fft.next_fast_len(n) == n), last)
    return replace(record, channels={n: x[: fast + 1] for n, x in record.channels.items()})


def _follows(paths: Sequence[Array], step: int) -> bool:
    """True if straight lines between every so many samples follow all paths to a thousandth of their travel."""
    along = ((z, np.arange(len(z))) for z in paths)
    off = ((np.abs(z - np.interp(at, at[::step], z[::step]))[: at[::step][-1]], z) for z, at in along)
    return all(np.max(apart) <= _CLOSE * np.ptp(z) for apart, z in off)


def _ramp(z: Array) -> int:
    """Sample of the first turn of a path whose first quarter cycle is smaller than later ones; else 0."""
    out, tolerance = z - z[0], 0.02 * float(np.ptp(z))
    moved = np.flatnonzero(np.abs(out) > tolerance)
    rising = out if moved.size and out[moved[0]] > 0 else -out
    back = np.flatnonzero(np.maximum.accumulate(rising) - rising > tolerance)
    back = back[back > moved[0]] if moved.size else back
    turn = int(np.argmax(rising[: back[0]])) if back.size else 0
    return turn if turn < len(z) // 4 and rising[turn] < 0.8 * float(np.max(np.abs(out))) else 0


def force_channel(measurement: Measurement) -> str:
    return measurement.of("force")[0].name


def displacement_channel(measurement: Measurement) -> str:
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
    f, P = scipy.signal.welch(scipy.signal.detrend(x), rate, nperseg=n)
    return np.asarray(f), np.asarray(P), float(np.median(P[f > 3 * rate / 8]))


def _power_frequency(x: Array, rate: float) -> float:
    f, P, noise = _density(x, rate)
    power = np.cumsum(np.maximum(P - 3 * noise, 0.0))
    return float(f[np.searchsorted(power, 0.999 * power[-1])]) if power[-1] > 0 else rate


def _signal_frequency(x: Array, rate: float) -> float:
    f, P, noise = _density(x, rate)
    above = np.flatnonzero(scipy.signal.medfilt(P, 5) > 10 * noise)
    return float(f[above[-1]]) if above.size else rate


def _odd_spectrum(x: Array) -> tuple[ComplexArray, Array]:
    """Spectrum of the odd extension along the last axis, and the line between the ends that was taken out."""
    n = x.shape[-1]
    first, last = x[..., :1], x[..., -1:]
    line = first + (last - first) * np.linspace(0, 1, n)
    y = x - line
    return scipy.fft.rfft(np.concatenate([y, -y[..., -2:0:-1]], axis=-1)), line


def finer(x: Array, factor: int) -> Array:
    """A signal with ``factor`` samples for each, band-limited in between; it ends with the last sample."""
    n = len(x)
    spectrum, _ = _odd_spectrum(x)
    own = scipy.fft.irfft(spectrum, 2 * (n - 1) * factor)[: (n - 1) * factor + 1] * factor
    return np.asarray(own + np.linspace(x[0], x[-1], (n - 1) * factor + 1))
