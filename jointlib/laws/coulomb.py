"""Dry friction with a constant slip force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter

_BENDS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0)
"""Where tanh bends, in units of the smoothing velocity; pieces between them are smooth to rounding."""

_RATIOS = ((2.0, 13), (6.0, 37), (20.0, 115))
"""Largest velocities over the smoothing velocity, and the angles of a quarter that serve up to them."""
_TERMS = np.arange(1, 9)
_REST = 1e-6
"""Velocity over the smoothing velocity at which friction is a damper."""


@cache
def _far() -> Array:
    """∫(1 − tanh x)·xⁿ dx over x > 0, n = 1, 3, …, times the series of 1/√(1 − x²)."""
    special, order = scipy.special, 2 * _TERMS - 1
    series = special.binom(2 * _TERMS - 2, _TERMS - 1) / 4.0 ** (_TERMS - 1)
    moments = special.factorial(order) / 2.0**order * (1 - 2.0**-order) * special.zeta(2.0 * _TERMS)
    return np.asarray(series * moments)


def tanh_kinks(smoothing_velocity: float) -> tuple[float, ...]:
    """Velocities in m/s at which a cycle through tanh(ż/smoothing_velocity) is split."""
    bends = np.array(_BENDS) * smoothing_velocity
    return tuple(float(v) for v in np.concatenate([-bends[:0:-1], bends])) if smoothing_velocity else (0.0,)


def smooth_sign(velocity: Array, smoothing_velocity: float) -> Array:
    """tanh(ż/smoothing_velocity), or sign(ż) where that is 0."""
    if isinstance(smoothing_velocity, float):
        return np.asarray(np.tanh(velocity / smoothing_velocity) if smoothing_velocity > 0 else np.sign(velocity))
    smooth = np.asarray(smoothing_velocity) > 0
    return np.where(smooth, np.tanh(velocity / np.where(smooth, smoothing_velocity, 1.0)), np.sign(velocity))


def smooth_sign_slope(velocity: Array, smoothing_velocity: float) -> Array:
    """Derivative of :func:`smooth_sign` in s/m; 0 where it jumps."""
    smooth = np.asarray(smoothing_velocity) > 0
    value = smooth_sign(velocity, smoothing_velocity)
    return np.where(smooth, (1 - value**2) / np.where(smooth, smoothing_velocity, 1.0), 0.0)


def smoothed_harmonic(ratio: Array) -> tuple[Array, Array]:
    """First harmonic of tanh(r·sin θ), (1/π)∫tanh(r·sin θ)·sin θ dθ, and its derivative by r; r of one axis, ≥ 0.

    The poles of tanh lie asinh(π/2r) off the real angles, so equally spaced angles serve to rounding up to r = 20;
    beyond that the series in 1/r² of 1 − tanh.
    """
    value, slope = np.empty_like(ratio), np.empty_like(ratio)
    low = 0.0
    for high, count in _RATIOS:
        part = np.flatnonzero((ratio >= low) & (ratio < high))
        sine = np.sin(np.pi / 2 * (np.arange(count) + 0.5) / count)
        wave = np.tanh(ratio[part, None] * sine)
        value[part], slope[part] = 2 / count * (wave @ sine), 2 / count * ((1 - wave**2) @ sine**2)
        low = high
    far = ratio >= low
    r = ratio[far]
    value[far] = 4 / np.pi * (1 - r[:, None] ** (-2.0 * _TERMS) @ _far())
    slope[far] = 4 / np.pi * (r[:, None] ** (-2.0 * _TERMS - 1) @ (2 * _TERMS * _far()))
    return value, slope


@dataclass(frozen=True)
class Coulomb(MemorylessLaw):
    """f = slip_force·tanh(ż/smoothing_velocity); sign(ż) for a smoothing velocity of 0."""

    slip_force: float = parameter("N", role=Role.SLIP_FORCE, lower=0.0)
    smoothing_velocity: float = parameter("m/s", role=Role.SMOOTHING, lower=0.0, default=0.0)

    kind: ClassVar[str] = "coulomb"

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.slip_force * smooth_sign(v, self.smoothing_velocity) + 0.0 * z

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 0.0 * z, self.slip_force * smooth_sign_slope(v, self.smoothing_velocity)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (), tanh_kinks(self.smoothing_velocity)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Ideal friction: G = 4j slip_force/(πA), infinite at A = 0 and at ω = 0; smoothed: see `smoothed_harmonic`."""
        A, w, _ = broadcast(amplitude, omega, bias)
        if self.smoothing_velocity:
            v = self.smoothing_velocity
            a = np.maximum(A, _REST * v / np.maximum(w, 1e-300))
            value, slope = (part.reshape(A.shape) for part in smoothed_harmonic((a * w / v).ravel()))
            G, bend = 1j * self.slip_force * value / a, 1j * self.slip_force * slope
            return closed_form(G, np.where(A > 0, (bend * w / v - G) / a, 0.0), bend / v, 0.0, A.shape)
        moving = (A > 0) & (w > 0)
        a = np.where(moving, A, 1.0)
        gain = 4j * self.slip_force / (np.pi * a)
        infinite = complex(0.0, np.inf) if self.slip_force else 0.0
        return closed_form(np.where(moving, gain, infinite), np.where(moving, -gain / a, 0.0), 0.0, 0.0, A.shape)
