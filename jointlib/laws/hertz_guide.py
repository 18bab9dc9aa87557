"""Linear guide with preloaded balls in four rows: Hertz contact, both sides of lift-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class HertzGuide(MemorylessLaw):
    """Normal force of a preloaded ball guide, explicit in the displacement.

    P(z) = 2 sin φ P0 [(1+u)₊^(3/2) − (1−u)₊^(3/2)], u = z sin φ/d0, d0 = κ P0^(2/3).

    Both rows touch for abs(u) ≤ 1; beyond, one row has lifted off and the guide stiffens like a single contact.
    Dhupia et al. 2008, eqs 3–6 with the lost signs restored; eliminating the row loads in favour of z makes the
    implicit eq. 7 explicit. Lift-off is at abs(P) = 4√2 P0 sin φ (eq. 9).
    """

    preload: float = parameter("N", role=Role.PRELOAD, above=0.0)
    kappa: float = parameter("m/N^(2/3)", above=0.0)
    contact_angle: float = parameter("rad", above=0.0, upper=np.pi / 2, default=np.pi / 4)

    kind: ClassVar[str] = "hertz-guide"
    side_by_side: ClassVar[bool] = True

    @property
    def indentation(self) -> float:
        """Preload deformation d0 of a ball in m."""
        d0: float = self.kappa * np.cbrt(self.preload) ** 2
        return d0

    @property
    def stiffness(self) -> float:
        """Tangent stiffness at rest K0 = 6 sin²φ P0/d0 in N/m."""
        K0: float = 6 * np.sin(self.contact_angle) ** 2 * self.preload / self.indentation
        return K0

    @property
    def lift_off_displacement(self) -> float:
        """Displacement d0/sin φ in m at which one row loses contact."""
        displacement: float = self.indentation / np.sin(self.contact_angle)
        return displacement

    @property
    def lift_off_load(self) -> float:
        """Load 4√2 P0 sin φ in N at which one row loses contact (eq. 9)."""
        load: float = 4 * np.sqrt(2) * self.preload * np.sin(self.contact_angle)
        return load

    def force(self, displacement: Array, velocity: Array) -> Array:
        u = np.asarray(displacement) / self.lift_off_displacement
        rows = np.maximum(1 + u, 0) ** 1.5 - np.maximum(1 - u, 0) ** 1.5
        return np.asarray(2 * np.sin(self.contact_angle) * self.preload * rows + 0 * np.asarray(velocity))

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        u = np.asarray(displacement) / self.lift_off_displacement + 0 * np.asarray(velocity)
        rows = np.sqrt(np.maximum(1 + u, 0)) + np.sqrt(np.maximum(1 - u, 0))
        return self.stiffness / 2 * rows, np.zeros_like(rows)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (-self.lift_off_displacement, self.lift_off_displacement), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Closed form: K0 g(r), r = A sin φ/d0, and row by row where the mean is not zero."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        r, u0 = A / self.lift_off_displacement, z0 / self.lift_off_displacement
        if not np.any(u0):
            g, slope = centred_gain(r)
            return closed_form(
                self.stiffness * g, self.stiffness * slope / self.lift_off_displacement, 0.0, 0.0, A.shape
            )
        scale = 2 * np.sin(self.contact_angle) * self.preload
        small = r < 1e-4
        x = np.where(small, 1e-4, r)
        (I1, M1, I1r), (I2, M2, I2r) = row_harmonics(1 + u0, x), row_harmonics(1 - u0, x)
        gain, slope = scale * (I1 + I2) / x, scale * ((I1r + I2r) - (I1 + I2) / x) / x
        mean = scale * (M1 - M2)
        rest = self.slopes(z0, np.zeros_like(z0))[0] * self.lift_off_displacement
        gain, slope = np.where(small, rest, gain), np.where(small, 0.0, slope)
        mean = np.where(small, self.force(z0, np.zeros_like(z0)), mean)
        d = self.lift_off_displacement
        return closed_form(gain / d, slope / d**2, 0.0, mean, A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """Row by row, see `row_slopes`."""
        A, _, z0 = np.broadcast_arrays(amplitude, omega, bias)
        d = self.lift_off_displacement
        r, u0 = A / d, z0 / d
        one, other = row_slopes(1 + u0, r), row_slopes(1 - u0, r)
        scale = 2 * np.sin(self.contact_angle) * self.preload / d
        gain, by_amplitude, mean = one[0] - other[0], one[1] - other[1], one[2] + other[2]
        return np.asarray(scale / d * gain, dtype=complex), scale * by_amplitude, scale * mean


def centred_gain(r: Array) -> tuple[Array, Array]:
    """Gain g(r) relative to the stiffness at rest, and dg/dr; r is the amplitude over the lift-off displacement.

    First harmonic of (1 + r cos θ)₊^(3/2) − (1 − r cos θ)₊^(3/2) over 3r. Touching (r ≤ 1) it is the Gauss series
    2F1(−1/4, 1/4; 2; r²), past lift-off a combination of complete elliptic integrals of parameter (1+r)/(2r).
    """
    r = np.asarray(r, dtype=float)
    inside, beyond = np.minimum(r, 1.0), np.maximum(r, 1.0)
    g_in = scipy.special.hyp2f1(-0.25, 0.25, 2.0, inside**2)
    slope_in = -inside / 16 * scipy.special.hyp2f1(0.75, 1.25, 3.0, np.minimum(inside, 1 - 1e-16) ** 2)
    p = (1 + beyond) / (2 * beyond)
    K, E = _elliptic(p, (beyond - 1) / (2 * beyond))
    lifted = (beyond - 1) * K
    factor = np.sqrt(2) / (15 * np.pi)
    g_out = 4 * factor * beyond**-1.5 * (2 * (3 * beyond**2 + 1) * E - (3 * beyond - 1) * lifted)
    slope_out = 2 * factor * beyond**-2.5 * ((6 * beyond**2 - 8) * E - (3 * beyond + 4) * lifted)
    return np.where(r <= 1, g_in, g_out), np.where(r < 1, slope_in, slope_out)


def row_harmonics(a: Array, r: Array) -> tuple[Array, Array, Array]:
    """One ball row (a + r cos θ)₊^(3/2): I = (1/π)∫ f cos θ dθ, mean M and ∂I/∂r, for r > 0."""
    first, mean, by_a = row_parts(a, r)
    # f is homogeneous of degree 3/2 in (a, r): a ∂I/∂a + r ∂I/∂r = (3/2) I.
    return first, mean, (1.5 * first - a * by_a) / r


def row_parts(a: Array, r: Array) -> tuple[Array, Array, Array]:
    """I and M of `row_harmonics` and ∂I/∂a = 2 ∂M/∂r, for r > 0.

    A row that parts from its contact (abs(a) < r): complete elliptic integrals of parameter p = (a+r)/2r. One that
    always touches: the same by the reciprocal modulus, of parameter 1/p, and Gauss series in (r/a)² where r is so small
    that they would cancel. Never touching (a ≤ −r): zero.
    """
    a, r = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(r, dtype=float))
    shallow, touching, away = r < _SMALL * a, a >= r, a <= -r
    above = np.where(shallow, a, 1.0)
    x = np.where(shallow, r / above, 0.0)
    near = np.tensordot(_ROW, _powers(x), 1)
    half = np.sqrt(above)
    middle = np.where(shallow | away, 0.0, a)
    size = np.where(shallow | away, 1.0, r)
    p, rest = (middle + size) / (2 * size), (size - middle) / (2 * size)
    m = np.where(touching, 1 / p, p)
    complement = np.where(touching, (middle - size) / (middle + size), rest)
    K, E = _elliptic(m, complement)
    turned = np.sqrt(m)
    K, E = np.where(touching, turned * K, K), np.where(touching, (E - complement * K) / turned, E)
    root = np.where(away, 0.0, np.sqrt(2 * size))
    cubed = 2 * size * root
    first = 4 / (5 * np.pi) * cubed * (2 * (1 - p * rest) * E - rest * (2 - p) * K)
    mean = 2 / (3 * np.pi) * cubed * (rest * (2 - 3 * p) * K + 2 * (p - rest) * E)
    by_a = 2 / np.pi * root * ((p - rest) * E + rest * K)
    return (
        np.where(shallow, above * half * x * near[0], first),
        np.where(shallow, above * half * near[1], mean),
        np.where(shallow, half * x * near[2], by_a),
    )


def row_slopes(a: Array, r: Array) -> tuple[Array, Array, Array]:
    """∂(I/r)/∂a, ∂M/∂r and ∂M/∂a of one ball row for r ≥ 0, see `row_parts`.

    f is homogeneous, so a ∂M/∂a + r ∂M/∂r = (3/2) M; where a is small beside r, ∂M/∂a = (3/2π)∫ √(a + r cos θ) dθ over
    the contact, (3/π)·√2r·(E − (1−p)K).
    """
    x = np.maximum(r, _STILL * np.maximum(np.abs(a), 1e-3))
    _, mean, by_a = row_parts(a, x)
    held = a > x / 2
    divisor = np.where(held, a, 1.0)
    p = np.clip((a + x) / (2 * x), 0.0, 1.0)
    K, E = _elliptic(p, 1 - p)
    parted = 3 / np.pi * np.sqrt(2 * x) * (E - (1 - p) * K)
    slope = np.where(held, (1.5 * mean - x * by_a / 2) / divisor, np.where(a > -x, parted, 0.0))
    return by_a / x, by_a / 2 * (r > 0), slope


def _elliptic(p: Array, complement: Array) -> tuple[Array, Array]:
    """Complete elliptic integrals K, E of parameter p; K finite where p = 1 (it enters times 1 − p)."""
    return np.asarray(scipy.special.ellipkm1(np.maximum(complement, 1e-300))), np.asarray(scipy.special.ellipe(p))


def _gauss(a: float, b: float, c: float) -> Array:
    """Coefficients of the series 2F1(a, b; c; y) = Σ (a)_n (b)_n/((c)_n n!) yⁿ."""
    n = np.arange(_TERMS - 1)
    return np.concatenate([[1.0], np.cumprod((a + n) * (b + n) / ((c + n) * (1 + n)))])


def _powers(x: Array) -> Array:
    """1, x², x⁴, … on a first axis."""
    every = np.empty((_TERMS, *x.shape))
    every[0], every[1:] = 1.0, x * x
    return np.asarray(np.multiply.accumulate(every, axis=0, out=every))


_SMALL, _TERMS = 0.2, 10
"""r/a below which series stand, with so many terms that the first left out is below rounding."""
_STILL = 1e-9
"""r/a in place of one that is zero."""
_ROW = np.stack([1.5 * _gauss(-0.25, 0.25, 2.0), _gauss(-0.75, -0.25, 1.0), 0.75 * _gauss(0.25, 0.75, 2.0)])
