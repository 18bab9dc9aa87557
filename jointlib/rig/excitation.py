"""What the shaker does: periodic forces made of lines on one frequency grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError


@dataclass(frozen=True)
class Excitation:
    """One period of a force, F(t) = Re Σ lines[k] e^(jω_k t) with ω_k = 2πk·sample_rate/period.

    ``lines`` holds peak amplitudes in N from k = 0 up to below half the period, so that the force is known between
    the samples as exactly as at them.
    """

    lines: ComplexArray
    period: int
    """Samples in one period."""
    sample_rate: float
    """Hz."""

    def __post_init__(self) -> None:
        if len(self.lines) > self.period // 2:
            raise InputError(f"excitation: {len(self.lines)} lines in a period of {self.period} samples, too many")

    def force(self, oversampling: int = 1) -> Array:
        """One period in N at ``oversampling`` points per sample."""
        points = self.period * oversampling
        spectrum = np.zeros(points // 2 + 1, dtype=complex)
        spectrum[: len(self.lines)] = self.lines * points / 2
        spectrum[0] *= 2
        return np.fft.irfft(spectrum, points)

    def scaled(self, rms: float) -> Excitation:
        """The same shape at another root mean square force in N."""
        now = float(np.sqrt(np.mean(self.force() ** 2)))
        return Excitation(self.lines * (rms / now if now else 0.0), self.period, self.sample_rate)


def multisine(
    rng: np.random.Generator,
    rms: float,
    *,
    band: tuple[float, float] = (2e3, 8e3),
    period: int = 5120,
    sample_rate: float = 102.4e3,
) -> Excitation:
    """Random-phase multisine: every line of the grid in ``band`` (Hz) equally strong, ``rms`` in N together."""
    lines = np.zeros(period // 2, dtype=complex)
    frequency = np.arange(period // 2) * sample_rate / period
    excited = (frequency >= band[0]) & (frequency <= band[1])
    lines[excited] = np.exp(2j * np.pi * rng.random(np.count_nonzero(excited)))
    return Excitation(lines, period, sample_rate).scaled(rms)


def modulated_sine(
    rms: float,
    *,
    carrier: float = 4.8e3,
    modulation: float = 20.0,
    depth: float = 0.8,
    period: int = 5120,
    sample_rate: float = 102.4e3,
) -> Excitation:
    """Sine of a carrier frequency whose amplitude swings, (1 + depth·cos ω_m t) sin ω_c t.

    The swing carries the motion over the whole range of displacement and velocity, as the hand on the shaker's knob
    does in Dhupia et al. 2008, section 4.4. Both frequencies (Hz) must lie on the grid of the period.
    """
    grid = sample_rate / period
    k, m = round(carrier / grid), round(modulation / grid)
    if abs(k * grid - carrier) > 1e-6 * grid or abs(m * grid - modulation) > 1e-6 * grid or m == 0:
        raise InputError(f"modulated sine: {carrier:g} and {modulation:g} Hz, expected multiples of {grid:g} Hz")
    lines = np.zeros(period // 2, dtype=complex)
    lines[k] = -1j
    lines[[k - m, k + m]] += -0.5j * depth
    return Excitation(lines, period, sample_rate).scaled(rms)
