"""Restoring-force surface as a polynomial in displacement and velocity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import parameter


@dataclass(frozen=True)
class Polynomial(MemorylessLaw):
    """f = Σ coefficients[i][j] z^i ż^j (Dhupia et al. 2008, eqs 16, 23); nothing keeps it passive outside its data."""

    coefficients: tuple[tuple[float, ...], ...] = parameter("N/(m^i (m/s)^j)", table=True)

    kind: ClassVar[str] = "polynomial"
    passive: ClassVar[bool] = False

    def _table(self) -> Array:
        return np.asarray(self.coefficients, dtype=float)

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.asarray(np.polynomial.polynomial.polyval2d(z, v, self._table()))

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        P = np.polynomial.polynomial
        C = self._table()
        by_z, by_v = P.polyder(C, axis=0), P.polyder(C, axis=1)
        return np.asarray(P.polyval2d(z, v, by_z)), np.asarray(P.polyval2d(z, v, by_v))

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Beta functions term by term (eq. 32); with a bias the polynomial is first shifted to z0."""
        A, w, z0 = broadcast(amplitude, omega, bias)
        return polynomial_harmonic(self._table(), A, w, z0)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (), ()


def polynomial_harmonic(C: Array, A: Array, w: Array, z0: Array) -> FirstHarmonic:
    """First harmonic of Σ C[i][m] z^i ż^m, with its derivatives; arrays of one shape, scaled by the caller.

    Odd powers of z with even powers of ż give the real part, even with odd the imaginary part:
    Re: (2/π) C ω^m A^(i+m−1) B(i/2+1, (m+1)/2), Im: (2/π) C ω^m A^(i+m−1) B((i+1)/2, m/2+1) (eq. 32).
    """
    rows, columns = C.shape
    power = np.arange(rows)
    shifted = np.empty((rows, columns, *A.shape))
    for k in range(rows):
        # Taylor shift: coefficient of (z − z0)^k is Σ_i C_i binom(i, k) z0^(i−k).
        factor = [scipy.special.comb(i, k) * z0 ** (i - k) if i >= k else np.zeros_like(z0) for i in power]
        shifted[k] = np.tensordot(C, np.array(factor), axes=(0, 0))
    gain: ComplexArray = np.zeros(A.shape, dtype=complex)
    d_amplitude, d_omega = gain.copy(), gain.copy()
    mean = np.zeros(A.shape)
    for i in range(rows):
        for m in range(columns):
            c, n = shifted[i, m], i + m - 1
            if i % 2 == 0 and m % 2 == 0:
                mean += c * w**m * A ** (i + m) * scipy.special.beta((i + 1) / 2, (m + 1) / 2) / np.pi
            elif i % 2 == 1 and m % 2 == 0:
                c = 2 / np.pi * c * scipy.special.beta(i / 2 + 1, (m + 1) / 2)
            elif i % 2 == 0 and m % 2 == 1:
                c = 2j / np.pi * c * scipy.special.beta((i + 1) / 2, m / 2 + 1)
            if (i + m) % 2 == 1:
                gain += c * w**m * A**n
                d_amplitude += n * c * w**m * A ** max(n - 1, 0)
                d_omega += m * c * w ** max(m - 1, 0) * A**n
    return closed_form(gain, d_amplitude, d_omega, mean, A.shape)
