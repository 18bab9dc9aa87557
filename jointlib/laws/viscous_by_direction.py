"""Viscous friction that differs between the two directions of motion."""

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
class ViscousByDirection(MemorylessLaw):
    """f = damping_positive·max(ż, 0) + damping_negative·min(ż, 0)."""

    damping_positive: float = parameter("N s/m", role=Role.DAMPING, lower=0.0)
    damping_negative: float = parameter("N s/m", role=Role.DAMPING, lower=0.0)

    kind: ClassVar[str] = "viscous-by-direction"

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.asarray(self.damping_positive * np.maximum(v, 0) + self.damping_negative * np.minimum(v, 0) + 0.0 * z)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 0.0 * z, np.where(v >= 0, self.damping_positive, self.damping_negative)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (), (0.0,)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = jω times the mean of the two dampings; the difference gives a mean force ωA (c₊ − c₋)/π."""
        A, w, _ = broadcast(amplitude, omega, bias)
        mean = (self.damping_positive + self.damping_negative) / 2
        rectified = w * A * (self.damping_positive - self.damping_negative) / np.pi
        return closed_form(1j * w * mean, 0.0, 1j * mean, rectified, A.shape)
