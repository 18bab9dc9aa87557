"""Viscous friction that differs between the two directions of motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.joint import Joint
from jointlib.laws.viscous import Viscous
from jointlib.laws.viscous_by_direction import ViscousByDirection


class DirectionalDamping(JointEffect):
    """Viscous damping with two constants; beside a viscous law it takes that law's place."""

    family: ClassVar[str] = "viscous-by-direction"
    member: ClassVar[str] = "viscous-by-direction"
    words: ClassVar[str] = "viscous damping that differs between the two directions (viscous-by-direction)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "drift": "Repeat both directions in turn: a drift of the offset averages out."
    }

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        """Half of abs(ż): what a difference of 1 between the two constants adds, their mean held."""
        return 0.5 * np.abs(path.velocity)[None]

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        """A joint with viscous damping c becomes c ± coefficient/2; both must be positive."""
        base = sum(law.damping for law in joint.laws if isinstance(law, Viscous))
        half = float(coefficients[0]) / 2
        positive, negative = base + half, base - half
        if positive <= 0 or negative <= 0:
            return None
        others = tuple(law for law in joint.laws if not isinstance(law, Viscous))
        return replace(joint, laws=(*others, ViscousByDirection(positive, negative)), covariance=None)
