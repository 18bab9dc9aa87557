"""Stiffness that differs between the two directions of load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, forces
from jointlib.joint import Joint
from jointlib.laws.quadratic import Quadratic


class QuadraticStiffness(JointEffect):
    """f = stiffness2·z², either sign: even lines, at twice the excitation."""

    family: ClassVar[str] = "quadratic"
    member: ClassVar[str] = "quadratic"
    words: ClassVar[str] = "a stiffness that differs between the two directions of load (quadratic)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "preload": "Measure the mean displacement: accelerometers cannot tell a static offset from uneven preload.",
        "contact-loss": "Raise the level: a lost contact shows a knee.",
    }

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Quadratic(1.0))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        return joint + Quadratic(float(coefficients[0]))
