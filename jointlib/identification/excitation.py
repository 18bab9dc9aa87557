"""Lines of a shaken rig on which its motion is known, where the measurement does not tell a band."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.errors import InputError
from jointlib.loop.balance.floor import Floor, excited_band, noise_floor
from jointlib.loop.balance.spectra import Spectra
from jointlib.measurement import Measurement, Record


def excited(measurement: Measurement, records: Sequence[Record]) -> tuple[float, float] | None:
    """The band in Hz that `trace` takes too: from 0.8 times the lowest excited line to three times the highest.

    Division by ω² blows up whatever an accelerometer shows on slow lines. The scatter between periods does not warn of
    it: what folds down from beyond half the sample rate repeats. None for records without period, and where no line
    stands out of the noise.
    """
    if any(r.period is None for r in records):
        return None
    spectra = [_drive(measurement, r) for r in records]
    driven = [s for s in spectra if s is not None]
    if len(driven) < len(records):
        return None
    try:
        low, _, _, high = excited_band(driven, [_floor(s) for s in driven], None)
    except InputError:
        return None
    return low, high


def _drive(measurement: Measurement, record: Record) -> Spectra | None:
    """The steady periods of the shaker force, without it of the driven body; None where nothing is left of them."""
    name, period = "P" if "P" in record.channels else "a1", record.period or 0
    kept = len(record) // period - measurement.settle
    if kept < 1:
        return None
    x = record.channels[name][measurement.settle * period : (measurement.settle + kept) * period]
    return Spectra(record.name, "", "", record.sample_rate, kept, period, {name: np.fft.rfft(x)}) if x.any() else None


def _floor(record: Spectra) -> Floor:
    if record.periods > 1:
        return noise_floor(record)
    return Floor({name: np.zeros(len(X)) for name, X in record.channels.items()}, "none", {})
