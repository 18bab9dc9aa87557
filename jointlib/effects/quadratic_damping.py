"""Damping that grows with speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, forces
from jointlib.joint import Joint
from jointlib.laws.quadratic_damping import QuadraticDamping


class SpeedSquaredDamping(JointEffect):
    """f = damping2·ż·abs(ż): an equivalent damping that grows with the amplitude."""

    family: ClassVar[str] = "quadratic-damping"
    member: ClassVar[str] = "quadratic-damping"
    words: ClassVar[str] = "damping that grows with speed (quadratic-damping)"
    look_alikes: ClassVar[Mapping[str, str]] = {"stribeck": "Repeat at three or more levels."}

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, QuadraticDamping(1.0))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        damping2 = float(coefficients[0])
        return joint + QuadraticDamping(damping2) if damping2 > 0 else None
