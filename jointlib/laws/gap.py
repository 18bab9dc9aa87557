"""Play: a spring that is interrupted while the joint moves within its clearance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.laws.ramp import Ramp
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Gap(MemorylessLaw):
    """f = −stiffness·clip(z, ±clearance), to be added to the spring of that stiffness which the gap interrupts.

    ``clearance`` is half the play. Alone the law is a negative spring; with its spring it is never active.
    """

    stiffness: float = parameter("N/m", role=Role.STIFFNESS, lower=0.0)
    clearance: float = parameter("m", role=Role.CLEARANCE, lower=0.0)

    kind: ClassVar[str] = "gap"

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.asarray(-self.stiffness * np.clip(z, -self.clearance, self.clearance) + 0.0 * v)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.where(np.abs(z) <= self.clearance, -self.stiffness, 0.0), 0.0 * v

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (-self.clearance, self.clearance), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Zero mean: the saturation gain −stiffness (2/π)[asin x + x √(1−x²)], x = clearance/A ≤ 1.

        With a mean: −stiffness times a `Ramp` from −clearance less one from clearance on, less the clearance.
        """
        A, _, z0 = broadcast(amplitude, omega, bias)
        if np.any(z0):
            low, high = self._ramps(A, z0)
            gain, slope = low.gain - high.gain, low.gain_by_amplitude - high.gain_by_amplitude
            mean = low.mean - high.mean - self.clearance
            return closed_form(-self.stiffness * gain, -self.stiffness * slope, 0.0, -self.stiffness * mean, A.shape)
        x = np.where(self.clearance >= A, 1.0, self.clearance / np.where(A > 0, A, 1.0))
        gain = -self.stiffness * 2 / np.pi * (np.arcsin(x) + x * np.sqrt(1 - x**2))
        slope = self.stiffness * 4 / np.pi * np.sqrt(1 - x**2) * x / np.where(A > 0, A, 1.0)
        return closed_form(gain, slope, 0.0, 0.0, A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """Closed forms, see `Ramp`."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        low, high = self._ramps(A, z0)
        gain = np.asarray(-self.stiffness * (low.gain_by_bias - high.gain_by_bias), dtype=complex)
        by_amplitude = -self.stiffness * (low.mean_by_amplitude - high.mean_by_amplitude)
        return gain, by_amplitude, -self.stiffness * (low.mean_by_bias - high.mean_by_bias)

    def _ramps(self, amplitude: Array, bias: Array) -> tuple[Ramp, Ramp]:
        return Ramp.of(amplitude, bias + self.clearance), Ramp.of(amplitude, bias - self.clearance)
