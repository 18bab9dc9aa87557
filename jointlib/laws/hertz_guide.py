"""Linear guide with preloaded balls in four rows: Hertz contact, both sides of lift-off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ellipe, ellipkm1, hyp2f1

from jointlib.arrays import Array, ArrayLike
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


def centred_gain(r: Array) -> tuple[Array, Array]:
    """Gain g(r) relative to the stiffness at rest, and dg/dr; r is the amplitude over the lift-off displacement.

    First harmonic of (1 + r cos θ)₊^(3/2) − (1 − r cos θ)₊^(3/2) over 3r. Touching (r ≤ 1) it is the Gauss series
    2F1(−1/4, 1/4; 2; r²), past lift-off a combination of complete elliptic integrals of parameter (1+r)/(2r).
    """
    r = np.asarray(r, dtype=float)
    inside, beyond = np.minimum(r, 1.0), np.maximum(r, 1.0)
    g_in = hyp2f1(-0.25, 0.25, 2.0, inside**2)
    slope_in = -inside / 16 * hyp2f1(0.75, 1.25, 3.0, np.minimum(inside, 1 - 1e-16) ** 2)
    p = (1 + beyond) / (2 * beyond)
    K, E = _elliptic(p, (beyond - 1) / (2 * beyond))
    lifted = (beyond - 1) * K
    factor = np.sqrt(2) / (15 * np.pi)
    g_out = 4 * factor * beyond**-1.5 * (2 * (3 * beyond**2 + 1) * E - (3 * beyond - 1) * lifted)
    slope_out = 2 * factor * beyond**-2.5 * ((6 * beyond**2 - 8) * E - (3 * beyond + 4) * lifted)
    return np.where(r <= 1, g_in, g_out), np.where(r < 1, slope_in, slope_out)


def row_harmonics(a: Array, r: Array) -> tuple[Array, Array, Array]:
    """One ball row (a + r cos θ)₊^(3/2): I = (1/π)∫ f cos θ dθ, mean M and ∂I/∂r, for r > 0.

    Always touching (a ≥ r): Gauss series in (r/a)². Touching part of the cycle: elliptic integrals of parameter
    p = (a+r)/(2r). Never touching (a ≤ −r): zero.
    """
    a, r = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(r, dtype=float))
    touching = a >= r
    above = np.where(touching, a, 1.0)
    x = np.where(touching, r / above, 0.5)
    I_touch = 1.5 * above**1.5 * x * hyp2f1(-0.25, 0.25, 2.0, x**2)
    M_touch = above**1.5 * hyp2f1(-0.75, -0.25, 1.0, x**2)
    Ia_touch = 0.75 * np.sqrt(above) * x * hyp2f1(0.25, 0.75, 2.0, np.minimum(x, 1 - 1e-16) ** 2)
    parted = np.abs(a) < r
    p = np.where(parted, (a + r) / (2 * r), 0.5)
    K, E = _elliptic(p, 1 - p)
    root = np.sqrt(2 * r)
    I_part = 4 / (5 * np.pi) * root**3 * (2 * (1 - p + p**2) * E - (1 - p) * (2 - p) * K)
    M_part = 2 / (3 * np.pi) * root**3 * ((1 - p) * (2 - 3 * p) * K + 2 * (2 * p - 1) * E)
    Ia_part = 2 / np.pi * root * ((2 * p - 1) * E + (1 - p) * K)
    first = np.where(touching, I_touch, np.where(parted, I_part, 0.0))
    mean = np.where(touching, M_touch, np.where(parted, M_part, 0.0))
    by_a = np.where(touching, Ia_touch, np.where(parted, Ia_part, 0.0))
    # f is homogeneous of degree 3/2 in (a, r): a ∂I/∂a + r ∂I/∂r = (3/2) I.
    return first, mean, (1.5 * first - a * by_a) / r


def _elliptic(p: Array, complement: Array) -> tuple[Array, Array]:
    """Complete elliptic integrals K, E of parameter p; K finite where p = 1 (it enters times 1 − p)."""
    return np.asarray(ellipkm1(np.maximum(complement, 1e-300))), np.asarray(ellipe(p))
