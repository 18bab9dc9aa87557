"""Quadratic spring: a stiffness that differs between the two directions of load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Quadratic(MemorylessLaw):
    """f = stiffness2·z²."""

    stiffness2: float = parameter("N/m^2", role=Role.STIFFNESS)

    kind: ClassVar[str] = "quadratic"

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.stiffness2 * z**2 + 0.0 * v

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 2 * self.stiffness2 * z, 0.0 * v

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = 2 stiffness2 z0: none about a zero mean; the mean force is stiffness2 (z0² + A²/2)."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return closed_form(2 * self.stiffness2 * z0, 0.0, 0.0 * w, self.stiffness2 * (z0**2 + A**2 / 2), A.shape)
