"""Records of a periodic rig test as line spectra."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.loop.answer.import_checks import check_period, flat_tops, without_dead_channels
from jointlib.measurement import Measurement, Record

OVERSAMPLING = 4
CHANNELS = ("a1", "a2", "a3", "P")
Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True)
class Spectra:
    """The steady part of one record: X_l = Σ x e^(−j2πln/N) of every channel, l = 0 … N/2, in unit of x times samples.

    N is a whole number of excitation periods, so the response of the steady rig stands on every ``periods``-th line
    alone; the other lines hold noise and what does not repeat.
    """

    name: str
    condition: str
    sha256: str
    sample_rate: float
    periods: int
    period_samples: int
    channels: dict[str, ComplexArray]

    @property
    def samples(self) -> int:
        return self.periods * self.period_samples

    @cached_property
    def frequency(self) -> Array:
        """Hz, one a line."""
        return np.asarray(np.fft.rfftfreq(self.samples, 1 / self.sample_rate))

    @cached_property
    def on_period(self) -> Mask:
        """True on the lines of the excitation period, the mean left out."""
        line = np.arange(len(self.frequency))
        mask: Mask = (line % self.periods == 0) & (line > 0)
        return mask

    def averaged_period(self, lines: ComplexArray) -> Array:
        """The first so many period lines of a spectrum as one averaged period, without the mean."""
        n = self.period_samples
        spectrum = np.zeros(n // 2 + 1, dtype=complex)
        spectrum[1 : len(lines) + 1] = lines * (n / self.samples)
        return np.asarray(np.fft.irfft(spectrum, n))

    def moved(self, Z: ComplexArray, unseen: ComplexArray | None, whole: bool = False) -> tuple[Array, Array, float]:
        """z in m, ż in m/s and the time step in s, four times oversampled, from the lines of a relative motion.

        Without oversampling the harmonics of a sharp feature fold back and imitate other features. ``Z`` are the lines
        of the period from the first on and the motion one averaged period, or all lines and the whole record.
        ``unseen`` is added on the lines of the oversampled period.
        """
        periods = self.periods if whole else 1
        samples = periods * self.period_samples
        n = OVERSAMPLING * samples
        spectrum = np.zeros(n // 2 + 1, dtype=complex)
        spectrum[1 : len(Z) + 1] = Z * OVERSAMPLING / (self.periods // periods)
        if unseen is not None:
            spectrum[::periods] += unseen * periods
        rate = 2j * np.pi * np.arange(len(spectrum)) * self.sample_rate / samples
        return np.fft.irfft(spectrum, n), np.fft.irfft(rate * spectrum, n), 1 / (OVERSAMPLING * self.sample_rate)


def spectra_of(record: Record, measurement: Measurement) -> tuple[Spectra, tuple[str, ...]]:
    """Transform a record, its run-in dropped, and say what had to be left out or looks wrong."""
    warnings = []
    period, rate = record.period, record.sample_rate
    if not period:
        raise InputError(
            f"{measurement.source}: record {record.name} has no period, expected samples per excitation period"
        )
    whole = len(record) // period
    if whole * period != len(record):
        warnings.append(
            f"{record.name}: the last {len(record) - whole * period} samples are no whole period; left out."
        )
    kept = whole - measurement.settle
    if kept < 1:
        raise InputError(
            f"{record.name}: {whole} whole periods, settle = {measurement.settle} drops them; "
            f"expected at least {measurement.settle + 1}"
        )
    channels = {}
    alive, dead = without_dead_channels(measurement, [record])
    warnings += dead
    names = [c.name for c in alive.channels]
    steady = {
        name: record.channels[name][measurement.settle * period : whole * period]
        for name in CHANNELS
        if name in record.channels and name in names
    }
    quiet = record.source.role == "quiet"
    for name, x in steady.items():
        channels[name] = np.fft.rfft(x)
        channel = measurement.channel(name)
        flat = channel.at_full_scale(x)
        cut = None if flat or quiet else flat_tops(x)
        if flat:
            warnings.append(
                f"{record.name}: {flat} samples of {name} stand at full scale {channel.full_scale:g}; "
                "they may be clipped."
            )
        elif cut:
            unit = channel.si_unit
            warnings.append(
                f"{record.name}: {cut[0]} samples of {name} stand at its largest value {cut[1]:.4g} {unit}; its tops "
                "are flat, they may be clipped."
            )
    said = None if quiet else check_period(record.name, steady, period)
    warnings += [said] if said else []
    condition = record.source.condition or record.name
    return Spectra(record.name, condition, record.sha256, rate, kept, period, channels), tuple(warnings)
