"""Cubic spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Cubic(MemorylessLaw):
    """f = stiffness3·z³; negative for a joint that softens."""

    stiffness3: float = parameter("N/m^3", role=Role.STIFFNESS)

    kind: ClassVar[str] = "cubic"
    side_by_side: ClassVar[bool] = True

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.asarray(self.stiffness3 * z * z * z + 0.0 * v)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 3 * self.stiffness3 * z * z, 0.0 * v

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = (3/4) stiffness3 A² for zero mean; a mean z0 adds 3 stiffness3 z0²."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return closed_form(
            self.stiffness3 * (0.75 * A**2 + 3 * z0**2),
            1.5 * self.stiffness3 * A,
            0.0 * w,
            self.stiffness3 * z0 * (z0**2 + 1.5 * A**2),
            A.shape,
        )
