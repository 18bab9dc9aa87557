"""Restoring force of a joint on a shaken rig: displacement, velocity and force from accelerations alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification.integration import band_gain, continued, frequencies, integrate
from jointlib.measurement import Measurement, Record

_CYCLES = 12
"""Cycles of the lowest frequency that a record without period loses at each end to the filter."""


@dataclass(frozen=True)
class RestoringForce:
    """Samples of the surface f(z, ż) in time order; for a periodic record one period, averaged over all of them.

    All three are limited to the lines of the band, so that the mean and whatever moves more slowly are not in them.
    """

    name: str
    z: Array
    """Relative displacement in m."""
    v: Array
    """Relative velocity in m/s."""
    f: Array
    """Joint force in N."""
    sample_rate: float
    """Hz."""
    periodic: bool
    gain: Array
    """Gain of the band at every line of the (continued) record."""
    margin: int = 0
    """Samples added at each end while filtering; as many inside the ends are not to be trusted."""
    periods: tuple[Array, Array, Array] | None = None
    """z, ż and f of every steady period, shape (periods, samples), where a record holds more than one."""

    @property
    def inside(self) -> slice:
        """The samples that the ends of the record do not touch."""
        return slice(self.margin, len(self.z) - self.margin) if self.margin else slice(None)

    def filtered(self, force: Array) -> Array:
        """A force along z in N, through the filter that ``f`` went through."""
        extended = continued(force, self.margin) if self.margin else force
        out = np.fft.irfft(np.fft.rfft(extended) * self.gain, len(extended))
        return np.asarray(out[self.margin : self.margin + len(force)])


def restoring_force(measurement: Measurement, record: Record, *, from_shaker: bool = False) -> RestoringForce:
    """Joint force and relative motion of one record of a rig (Dhupia et al. 2008, eqs 10, 11).

    f = Σ m_b a_b over the bodies that ride on the joint (with two accelerometers f = (m2 + m3) a2), or f = P − m1 a1
    with ``from_shaker``; z and ż by integrating a1 − a2 on the lines of the band.
    """
    a = {name: _channel(record, name) for name in ("a1", "a2")}
    relative = a["a1"] - a["a2"]
    force = _shaker_balance(measurement, record) if from_shaker else _riding_force(measurement, record)
    if record.period is not None:
        return _periodic(measurement, record, relative, force)
    return _single(measurement, record, relative, force)


def _channel(record: Record, name: str) -> Array:
    value = record.channels[name]
    if not np.any(value):
        raise InputError(f"{record.source.file}: channel {name!r} is zero throughout, expected a signal")
    return value


def _masses(measurement: Measurement) -> dict[str, float]:
    masses = {}
    for body, mass in measurement.bodies.items():
        if mass.value is None:
            raise InputError(f"{measurement.source}: mass of {body!r} is unknown, the joint force needs it in kg")
        if mass.stiffness or mass.damping:
            raise InputError(
                f"{measurement.source}: {body!r} is held to ground, expected free bodies: trace alone minds that"
            )
        masses[body] = mass.value
    return masses


def _riding_force(measurement: Measurement, record: Record) -> Array:
    """Σ m_b a_b over all bodies but the driven one; a body without accelerometer moves as that of a2."""
    sensors: dict[str, list[Array]] = {}
    for channel in measurement.of("acceleration"):
        if channel.body is not None and channel.body != measurement.driven:
            sensors.setdefault(channel.body, []).append(_channel(record, channel.name))
    force = np.zeros(len(record))
    for body, mass in _masses(measurement).items():
        if body != measurement.driven:
            force += mass * np.mean(sensors.get(body, [record.channels["a2"]]), axis=0)
    if not np.any(force):
        raise InputError(f"{measurement.source}: [bodies] names the driven body alone, expected one that it drives")
    return force


def _shaker_balance(measurement: Measurement, record: Record) -> Array:
    if "P" not in record.channels:
        raise InputError(f"{measurement.source}: no channel 'P', the balance of the driven body needs the shaker force")
    driven = _masses(measurement)[str(measurement.driven)]
    return np.asarray(_channel(record, "P") - driven * _channel(record, "a1"))


def _periodic(measurement: Measurement, record: Record, relative: Array, force: Array) -> RestoringForce:
    period = record.period or 0
    count = len(record) // period - measurement.settle
    if count < 1:
        found = f"{len(record)} samples, {measurement.settle} periods of {period} dropped"
        raise InputError(f"{record.source.file}: {found}, expected at least one whole period to be left")
    whole = slice(measurement.settle * period, (measurement.settle + count) * period)
    a, f = (x[whole].reshape(count, period) for x in (relative, force))
    frequency = frequencies(period, record.sample_rate)
    low, high = measurement.band or (0.0, np.inf)
    gain = ((frequency >= low) & (frequency <= high) & (frequency > 0)).astype(float)
    if period % 2 == 0:
        gain[-1] = 0.0
    heard = gain * _above_noise(a)
    if np.count_nonzero(heard) < 1:
        raise InputError(
            f"{record.source.file}: no line of a1 − a2 stands out of the noise, expected an excited record"
        )
    z, v = integrate(a.mean(axis=0), record.sample_rate, heard)
    one = RestoringForce(record.name, z, v, np.zeros_like(z), record.sample_rate, True, gain)
    each = None
    if count > 1:
        moved = [integrate(row, record.sample_rate, heard) for row in a]
        each = np.stack([x for x, _ in moved]), np.stack([x for _, x in moved]), np.stack([one.filtered(x) for x in f])
    mean = one.filtered(f.mean(axis=0))
    return RestoringForce(record.name, z, v, mean, record.sample_rate, True, gain, periods=each)


def _above_noise(periods: Array) -> Array:
    """True for lines whose mean stands out of the scatter from period to period, or of rounding."""
    lines = np.fft.rfft(periods, axis=1)
    power = np.abs(lines.mean(axis=0)) ** 2
    floor = 1e-20 * np.max(power) * np.ones_like(power)
    if len(periods) > 1:
        scatter = np.sum(np.abs(lines - lines.mean(axis=0)) ** 2, axis=0) / (len(periods) - 1) / len(periods)
        smooth = np.convolve(np.pad(scatter, 20, mode="reflect"), np.full(41, 1 / 41), mode="valid")
        floor = np.maximum(floor, 6 * smooth)
    return np.asarray(power > floor)


def _single(measurement: Measurement, record: Record, relative: Array, force: Array) -> RestoringForce:
    rate, n = record.sample_rate, len(record)
    low, high = measurement.band or (40 * rate / n, rate / 2)
    margin = int(np.ceil(_CYCLES * rate / max(low, 1e-300)))
    if n < 6 * margin:
        found = f"{n} samples at {rate:g} Hz, band from {low:g} Hz"
        raise InputError(
            f"{record.source.file}: {found}, expected at least {6 * _CYCLES} cycles of the lowest frequency"
        )
    gain = band_gain(frequencies(n + 2 * margin, rate), (low, high))
    z, v = integrate(continued(relative - relative.mean(), margin), rate, gain)
    cut = slice(margin, margin + n)
    bare = RestoringForce(record.name, z[cut], v[cut], np.zeros(n), rate, False, gain, margin)
    return RestoringForce(record.name, z[cut], v[cut], bare.filtered(force - force.mean()), rate, False, gain, margin)
