"""Dry friction that is larger at low speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.stribeck import Stribeck


class StribeckFriction(JointEffect):
    """Sliding friction and a bump at low speed, both positive: static_force ≥ slip_force."""

    family: ClassVar[str] = "stribeck"
    member: ClassVar[str] = "stribeck"
    words: ClassVar[str] = "dry friction that falls with speed (Stribeck)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Record slow motion, at or below the speed where friction falls, or a free decay.",
        "quadratic-damping": "Repeat at three or more levels.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple(
            {"smoothing_velocity": s * scale.velocity, "stribeck_velocity": s * times * scale.velocity}
            for s in (0.01, 0.03, 0.1, 0.3, 0.9)
            for times in (2.0, 5.0, 12.0)
        )

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        """The sliding level everywhere, and the bump alone."""
        both = Stribeck(1.0, 1.0, shape["stribeck_velocity"], shape["smoothing_velocity"])
        bump = Stribeck(0.0, 1.0, shape["stribeck_velocity"], shape["smoothing_velocity"])
        return forces(path, both, bump)

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        sliding, bump = (float(c) for c in coefficients)
        if sliding <= 0 or bump <= 0:
            return None
        law = Stribeck(sliding, sliding + bump, shape["stribeck_velocity"], shape["smoothing_velocity"])
        return joint + law
