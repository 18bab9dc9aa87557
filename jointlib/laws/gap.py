"""Play: a spring that is interrupted while the joint moves within its clearance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
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
        """Zero mean: the saturation gain −stiffness (2/π)[asin x + x √(1−x²)], x = clearance/A ≤ 1; else quadrature."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        if np.any(z0):
            return super().first_harmonic(amplitude, omega, bias)
        x = np.where(self.clearance >= A, 1.0, self.clearance / np.where(A > 0, A, 1.0))
        gain = -self.stiffness * 2 / np.pi * (np.arcsin(x) + x * np.sqrt(1 - x**2))
        slope = self.stiffness * 4 / np.pi * np.sqrt(1 - x**2) * x / np.where(A > 0, A, 1.0)
        return closed_form(gain, slope, 0.0, 0.0, A.shape)
