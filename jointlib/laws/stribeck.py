"""Dry friction that is larger at low speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.law import MemorylessLaw
from jointlib.laws.coulomb import smooth_sign, smooth_sign_slope, tanh_kinks
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Stribeck(MemorylessLaw):
    """f = (slip_force + (static_force − slip_force) e^(−(ż/stribeck_velocity)²)) tanh(ż/smoothing_velocity).

    static_force ≥ slip_force: friction falls, never rises, as sliding sets in.
    """

    slip_force: float = parameter("N", role=Role.SLIP_FORCE, lower=0.0)
    static_force: float = parameter("N", role=Role.SLIP_FORCE, lower=0.0)
    stribeck_velocity: float = parameter("m/s", above=0.0)
    smoothing_velocity: float = parameter("m/s", role=Role.SMOOTHING, lower=0.0, default=0.0)

    kind: ClassVar[str] = "stribeck"

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(np.asarray(self.static_force) < np.asarray(self.slip_force)):
            raise InputError(
                f"stribeck: static_force is {self.static_force} N, expected at least slip_force = {self.slip_force} N"
            )

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        bump = (self.static_force - self.slip_force) * np.exp(-((v / self.stribeck_velocity) ** 2))
        return (self.slip_force + bump) * smooth_sign(v, self.smoothing_velocity) + 0.0 * z

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        sign, slope = (f(v, self.smoothing_velocity) for f in (smooth_sign, smooth_sign_slope))
        bump = (self.static_force - self.slip_force) * np.exp(-((v / self.stribeck_velocity) ** 2))
        return 0.0 * z, (self.slip_force + bump) * slope - 2 * v / self.stribeck_velocity**2 * bump * sign

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        bends = (0.5, 1.0, 2.0, 3.0, 5.0)
        falls = tuple(s * b * self.stribeck_velocity for b in bends for s in (-1, 1))
        return (), (*tanh_kinks(self.smoothing_velocity), *falls)
