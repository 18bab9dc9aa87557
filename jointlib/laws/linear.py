"""Linear spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Linear(MemorylessLaw):
    """f = stiffness·z."""

    stiffness: float = parameter("N/m", role=Role.STIFFNESS)

    kind: ClassVar[str] = "linear"
    side_by_side: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.stiffness * z + 0.0 * v

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.stiffness + 0.0 * z, 0.0 * v

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = stiffness."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return closed_form(self.stiffness, 0.0, 0.0, self.stiffness * z0 + 0.0 * w, A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """The mean alone depends on the place."""
        nothing = np.zeros(np.broadcast_shapes(amplitude.shape, omega.shape, bias.shape))
        return nothing.astype(complex), nothing, nothing + self.stiffness
