"""Odd stiffness that grows or falls with amplitude."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, forces
from jointlib.joint import Joint
from jointlib.laws.cubic import Cubic


class CubicStiffness(JointEffect):
    """f = stiffness3·z³, either sign: odd lines, in phase with z, growing with the square of the amplitude."""

    family: ClassVar[str] = "cubic"
    member: ClassVar[str] = "cubic"
    words: ClassVar[str] = "a stiffness that changes with the square of the amplitude (cubic)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "preload": "Drive the guide to at least 0.8 of lift-off, or load it statically past lift-off.",
        "gap": "Repeat at three or more levels: a gap loses weight as the amplitude grows.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"preload"})

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Cubic(1.0))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        return joint + Cubic(float(coefficients[0]))
