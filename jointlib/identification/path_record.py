"""Force along a measured path: a drive or a test rig with a carriage."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification.force_balance import ForceBalance, blocks
from jointlib.measurement import Measurement, Record

_FEWEST = 200
"""Samples below which a path is not filtered and differentiated."""

ORDER = 4
"""Of the Butterworth low pass, one way."""
_SETTLED = 3.0
"""Periods of the cutoff frequency in which a low pass forgets how it began."""


def path_unknowns(measurement: Measurement) -> tuple[str, ...]:
    """What a path identifies besides the joint: the offset F0, and the carriage mass where it is unknown."""
    unknown = measurement.carriage is not None and measurement.carriage.value is None
    return ("carriage", "offset") if unknown else ("offset",)


@lru_cache(maxsize=16)
def _sections(cutoff: float) -> Array:
    """Second-order sections of the low pass, cutoff in halves of the sample rate; a trace asks thousands of times."""
    return np.asarray(scipy.signal.butter(ORDER, cutoff, output="sos"))


def low_pass(x: Array, cutoff: float, sample_rate: float) -> Array:
    """The part of x below a frequency, along the last axis: Butterworth of order 4, forward and backward, no phase."""
    # Carried on at its ends, turned about them, for so long that the filter has settled: it then keeps the ends, and
    # with the first of them the place at which a slider stands that has not slipped yet.
    pad = min(x.shape[-1] - 1, int(_SETTLED * sample_rate / cutoff) + 1)
    return np.asarray(scipy.signal.sosfiltfilt(_sections(cutoff / (sample_rate / 2)), x, axis=-1, padlen=pad))


def slope(x: Array, sample_rate: float) -> Array:
    """Time derivative by central differences over five samples, short by a share (ω/sample_rate)⁴/30 at ω."""
    out = np.gradient(x)
    out[2:-2] = (8 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12
    return np.asarray(out * sample_rate)


def path_balance(measurement: Measurement, record: Record) -> ForceBalance:
    """F = m·a + f(z, ż) + F0 on filtered samples.

    Force and displacement go through one zero-phase low-pass (Butterworth of order 4, forward and backward, up to
    the band or a twentieth of the sample rate); velocity and acceleration are measured, or differences after it
    (`slope`). All terms then go through it once more: the force of a law along a smooth path has corners, and the
    measured one shows them as round as the filter leaves them. The ends are dropped and the rest is thinned to the
    filter's own rate.
    """
    rate = record.sample_rate
    n = len(record)
    if n < _FEWEST:
        raise InputError(f"{record.source.file}: {n} samples, expected at least {_FEWEST} along a path")
    cutoff = min(measurement.band[1] if measurement.band else rate / 20, 0.45 * rate)

    def smooth(x: Array) -> Array:
        return low_pass(x, cutoff, rate)

    position = (measurement.of("displacement") or measurement.of("position"))[0]
    force_channel = measurement.of("force")[0]
    for channel in (position, force_channel):
        if np.ptp(record.channels[channel.name]) == 0:
            where = f"{record.source.file}: channel {channel.name!r}"
            raise InputError(f"{where} never changes, expected a signal")
    z, force = smooth(record.channels[position.name]), smooth(record.channels[force_channel.name])
    speeds, rates = measurement.of("velocity"), measurement.of("acceleration")
    v = smooth(record.channels[speeds[0].name]) if speeds else slope(z, rate)
    a = smooth(record.channels[rates[0].name]) if rates else slope(v, rate)
    trim = min(int(25 * rate / cutoff), n // 10)
    kept = slice(trim, n - trim, max(1, int(rate / cutoff)))

    def thinned(x: Array) -> Array:
        return np.asarray(smooth(x)[kept])

    target = thinned(force)
    extra = np.ones((len(target), 1))
    if measurement.carriage is not None and measurement.carriage.value is None:
        extra = np.column_stack([thinned(a), extra])
    elif measurement.carriage is not None and measurement.carriage.value is not None:
        target = target - measurement.carriage.value * thinned(a)
    peak = float(np.max(np.abs(force)))
    return ForceBalance(record.name, z, v, 1 / rate, target, thinned, blocks(len(target)), peak, extra=extra)
