"""Contact lost on one side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.contact_loss import ContactLoss


class OneSidedContactLoss(JointEffect):
    """f = −side·stiffness·max(side·z − clearance, 0): even and odd lines, with a knee."""

    family: ClassVar[str] = "contact-loss"
    member: ClassVar[str] = "contact-loss"
    words: ClassVar[str] = "contact lost on one side (contact-loss)"
    look_alikes: ClassVar[Mapping[str, str]] = {"quadratic": "Raise the level: a lost contact shows a knee."}

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        knees = scale.displacement * np.array([0.0, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8])
        return tuple({"clearance": float(c), "side": side} for side in (1.0, -1.0) for c in knees)

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, ContactLoss(1.0, shape["clearance"], shape["side"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        return joint + ContactLoss(float(coefficients[0]), shape["clearance"], shape["side"])
