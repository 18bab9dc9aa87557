"""Restoring-force surface in Chebyshev polynomials of scaled displacement and velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast
from jointlib.law import MemorylessLaw
from jointlib.laws.polynomial import Polynomial, polynomial_harmonic
from jointlib.parameter import parameter


@dataclass(frozen=True)
class Chebyshev(MemorylessLaw):
    """f = Σ coefficients[i][j] T_i(z/displacement_scale) T_j(ż/velocity_scale) (Dhupia et al. 2008, eq. 12).

    The scales are the largest abs(z) and abs(ż) of the data; outside them the surface is an extrapolation.
    """

    coefficients: tuple[tuple[float, ...], ...] = parameter("N", table=True)
    displacement_scale: float = parameter("m", above=0.0)
    velocity_scale: float = parameter("m/s", above=0.0)

    kind: ClassVar[str] = "chebyshev"
    passive: ClassVar[bool] = False

    def _scaled(self, z: Array, v: Array) -> tuple[Array, Array]:
        x, y = np.broadcast_arrays(np.asarray(z) / self.displacement_scale, np.asarray(v) / self.velocity_scale)
        return x, y

    def force(self, displacement: Array, velocity: Array) -> Array:
        x, y = self._scaled(displacement, velocity)
        return np.asarray(np.polynomial.chebyshev.chebval2d(x, y, np.asarray(self.coefficients)))

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        T, C = np.polynomial.chebyshev, np.asarray(self.coefficients)
        x, y = self._scaled(displacement, velocity)
        by_z = T.chebval2d(x, y, T.chebder(C, axis=0)) / self.displacement_scale
        by_v = T.chebval2d(x, y, T.chebder(C, axis=1)) / self.velocity_scale
        return np.asarray(by_z), np.asarray(by_v)

    def scaled_powers(self) -> Array:
        """Coefficients of (z/displacement_scale)^i (ż/velocity_scale)^j in N."""
        C = np.asarray(self.coefficients, dtype=float)
        rows, columns = (_basis(n) for n in C.shape)
        return np.asarray(rows.T @ C @ columns)

    def polynomial(self) -> Polynomial:
        """The same surface in powers of z and ż (eq. 16), an exact change of basis."""
        powers = self.scaled_powers()
        i, j = np.indices(powers.shape)
        table = powers / (self.displacement_scale**i * self.velocity_scale**j)
        return Polynomial(tuple(tuple(float(c) for c in row) for row in table))

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Eq. 32 in scaled variables, so that no coefficient is measured in powers of metres."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        x, ratio = self.displacement_scale, self.displacement_scale / self.velocity_scale
        scaled = polynomial_harmonic(self.scaled_powers(), A / x, w * ratio, z0 / x)
        return FirstHarmonic(
            scaled.gain / x, scaled.d_amplitude / x**2, scaled.d_omega * ratio / x, scaled.mean, scaled.error
        )


def _basis(n: int) -> Array:
    """Row i holds the power-basis coefficients of T_i, i < n."""
    out = np.zeros((n, n))
    for i in range(n):
        out[i, : i + 1] = np.polynomial.chebyshev.cheb2poly(np.eye(n)[i])[: i + 1]
    return out
