"""A damper that a joint lacks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.viscous import Viscous
from jointlib.parameter import parameters_of


class MissingDamper(JointEffect):
    """f = damping·ż, where no law of the joint damps so; the bristles of a LuGre do while they bend alone."""

    family: ClassVar[str] = "viscous"
    member: ClassVar[str] = "viscous"
    words: ClassVar[str] = "damping in proportion to the speed (viscous)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Repeat at two speeds: viscous force grows with the speed, dry friction does not.",
        "lag": "Raise the speed at the same travel, and tap the force sensor beside an accelerometer: a late channel "
        "is as late there.",
        "quadratic-damping": "Repeat at three or more speeds: the one grows with the speed, the other with its square.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        damped = any(p.unit == "N s/m" for law in joint.laws if not law.states for p in parameters_of(law))
        return () if damped else ({},)

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Viscous(1.0))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        damping = float(coefficients[0])
        return joint + Viscous(damping) if damping > 0 else None
