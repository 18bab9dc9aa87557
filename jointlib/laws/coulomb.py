"""Dry friction with a constant slip force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter

_BENDS = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0)
"""Where tanh bends, in units of the smoothing velocity; pieces between them are smooth to rounding."""


def tanh_kinks(smoothing_velocity: float) -> tuple[float, ...]:
    """Velocities in m/s at which a cycle through tanh(ż/smoothing_velocity) is split."""
    bends = np.array(_BENDS) * smoothing_velocity
    return tuple(float(v) for v in np.concatenate([-bends[:0:-1], bends])) if smoothing_velocity else (0.0,)


def smooth_sign(velocity: Array, smoothing_velocity: float) -> tuple[Array, Array]:
    """tanh(ż/smoothing_velocity), or sign(ż) where that is 0, and its derivative in s/m."""
    smooth = np.asarray(smoothing_velocity) > 0
    scale = np.where(smooth, smoothing_velocity, 1.0)
    value = np.where(smooth, np.tanh(velocity / scale), np.sign(velocity))
    return value, np.where(smooth, (1 - value**2) / scale, 0.0)


@dataclass(frozen=True)
class Coulomb(MemorylessLaw):
    """f = slip_force·tanh(ż/smoothing_velocity); sign(ż) for a smoothing velocity of 0."""

    slip_force: float = parameter("N", role=Role.SLIP_FORCE, lower=0.0)
    smoothing_velocity: float = parameter("m/s", role=Role.SMOOTHING, lower=0.0, default=0.0)

    kind: ClassVar[str] = "coulomb"

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return self.slip_force * smooth_sign(v, self.smoothing_velocity)[0] + 0.0 * z

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return 0.0 * z, self.slip_force * smooth_sign(v, self.smoothing_velocity)[1]

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (), tanh_kinks(self.smoothing_velocity)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Ideal friction: G = 4j slip_force/(πA), infinite at A = 0 and at ω = 0; smoothed: by quadrature."""
        if self.smoothing_velocity:
            return super().first_harmonic(amplitude, omega, bias)
        A, w, _ = broadcast(amplitude, omega, bias)
        moving = (A > 0) & (w > 0)
        a = np.where(moving, A, 1.0)
        gain = 4j * self.slip_force / (np.pi * a)
        infinite = complex(0.0, np.inf) if self.slip_force else 0.0
        return closed_form(np.where(moving, gain, infinite), np.where(moving, -gain / a, 0.0), 0.0, 0.0, A.shape)
