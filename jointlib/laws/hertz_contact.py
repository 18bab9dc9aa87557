"""One preloaded rolling contact: a ball row, or a single ball, that presses one way and can lift off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.laws.hertz_guide import row_harmonics, row_slopes
from jointlib.parameter import Role, parameter

_SERIES = 1e-3


@dataclass(frozen=True)
class HertzContact(MemorylessLaw):
    """f = preload·[(1 + z/d0)₊^(3/2) − 1], d0 = kappa·preload^(2/3): the load beyond the preload; z > 0 presses.

    The contact is lost at z = −d0, where f = −preload. Hertz's δ = kappa·Q^(2/3) for the whole load Q = preload + f
    (Dhupia et al. 2008, eq. 3). Two opposed contacts along one line are a ``hertz-guide``.
    """

    preload: float = parameter("N", role=Role.PRELOAD, above=0.0)
    kappa: float = parameter("m/N^(2/3)", above=0.0)

    kind: ClassVar[str] = "hertz-contact"
    side_by_side: ClassVar[bool] = True

    @property
    def indentation(self) -> float:
        """Preload deformation d0 in m."""
        d0: float = self.kappa * np.cbrt(self.preload) ** 2
        return d0

    @property
    def stiffness(self) -> float:
        """Tangent stiffness at rest (3/2) preload/d0 in N/m."""
        return 1.5 * self.preload / self.indentation

    def force(self, displacement: Array, velocity: Array) -> Array:
        u = np.asarray(displacement) / self.indentation
        return np.asarray(self.preload * (np.maximum(1 + u, 0) ** 1.5 - 1) + 0 * np.asarray(velocity))

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        u = np.asarray(displacement) / self.indentation + 0 * np.asarray(velocity)
        return self.stiffness * np.sqrt(np.maximum(1 + u, 0)), np.zeros_like(u)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (-self.indentation,), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Closed form: first harmonic and mean of (a + r cos θ)₊^(3/2), a = 1 + bias/d0, r = A/d0."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        r, a = A / self.indentation, 1 + z0 / self.indentation
        x = np.maximum(r, 1e-12)
        first, mean, by_r = row_harmonics(a, x)
        slope = (by_r - first / x) / x
        # Small against the depth of contact the difference cancels, and the first term of the Gauss series stands.
        shallow = r < _SERIES * a
        slope = np.where(shallow, -3 / 32 * r * np.where(shallow, a, 1.0) ** -1.5, slope)
        scale = self.preload / self.indentation
        return closed_form(scale * first / x, scale / self.indentation * slope, 0.0, self.preload * (mean - 1), A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """Those of a ball row, see `row_slopes`."""
        A, _, z0 = np.broadcast_arrays(amplitude, omega, bias)
        d0 = self.indentation
        gain, by_amplitude, mean = row_slopes(1 + z0 / d0, A / d0)
        scale = self.preload / d0
        return np.asarray(scale / d0 * gain, dtype=complex), scale * by_amplitude, scale * mean
