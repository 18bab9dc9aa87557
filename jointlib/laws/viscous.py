"""Viscous damper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Viscous(MemorylessLaw):
    """f = damping·ż (Dhupia et al. 2008, eqs 13, 15)."""

    damping: float = parameter("N s/m", role=Role.DAMPING, lower=0.0)

    kind: ClassVar[str] = "viscous"
    side_by_side: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.damping * v + 0.0 * z

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 0.0 * z, self.damping + 0.0 * v

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = jω damping."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return closed_form(1j * w * self.damping, 0.0, 1j * self.damping, 0.0 * z0, A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """Nothing depends on the place."""
        nothing = np.zeros(np.broadcast_shapes(amplitude.shape, omega.shape, bias.shape))
        return nothing.astype(complex), nothing, nothing
