"""Dry friction that is larger at low speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.stribeck import Stribeck

_LEAST_FALL = 0.01


class StribeckFriction(JointEffect):
    """Sliding friction and a bump at low speed, both positive, that is wider than the rounding at zero speed.

    A bump that fades before the hyperbolic tangent has risen makes no force that falls with speed: it only shapes the
    corner of a Coulomb force, and is not named Stribeck.
    """

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
        return joint + law if _falls_with_speed(law) else None

    def shows(self, joint: Joint) -> bool:
        return all(law.stribeck_velocity >= law.smoothing_velocity for law in joint.laws if isinstance(law, Stribeck))


def _falls_with_speed(law: Stribeck) -> bool:
    """Whether the force anywhere exceeds that of fast sliding by more than a hundredth."""
    v = law.stribeck_velocity * np.geomspace(0.05, 4.0, 60)
    force = law.force(np.zeros_like(v), v)
    return bool(np.max(force) > (1 + _LEAST_FALL) * law.slip_force)
