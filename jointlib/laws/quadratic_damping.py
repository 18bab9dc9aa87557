"""Damping that grows with speed."""

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
class QuadraticDamping(MemorylessLaw):
    """f = damping2·ż·abs(ż)."""

    damping2: float = parameter("N s^2/m^2", role=Role.DAMPING, lower=0.0)

    kind: ClassVar[str] = "quadratic-damping"

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (), (0.0,)

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.asarray(self.damping2 * v * np.abs(v) + 0.0 * z)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 0.0 * z, 2 * self.damping2 * np.abs(v)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = j (8/(3π)) damping2 ω² A."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return closed_form(
            8j / (3 * np.pi) * self.damping2 * w**2 * A,
            8j / (3 * np.pi) * self.damping2 * w**2,
            16j / (3 * np.pi) * self.damping2 * w * A,
            0.0 * z0,
            A.shape,
        )
