"""Play in the spring of the joint."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.gap import Gap


class Play(JointEffect):
    """f = −stiffness·clip(z, ±clearance): odd, and relatively weaker the larger the amplitude."""

    family: ClassVar[str] = "gap"
    member: ClassVar[str] = "gap"
    words: ClassVar[str] = "play in the spring of the joint (gap)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "hysteresis": "Run a slow loop: slip encloses an area, play does not.",
        "cubic": "Repeat at three or more levels: a gap loses weight as the amplitude grows.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"clearance": float(c)} for c in scale.displacement * np.geomspace(0.02, 0.7, 10))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Gap(1.0, shape["clearance"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        return joint + Gap(stiffness, shape["clearance"]) if stiffness > 0 else None
