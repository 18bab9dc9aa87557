"""Hysteresis: slip that sets in gradually."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.dahl import Dahl


class DahlFriction(JointEffect):
    """Dahl friction: a rounded loop; shape is the distance over which it comes to sliding."""

    family: ClassVar[str] = "hysteresis"
    leads: ClassVar[bool] = False
    member: ClassVar[str] = "dahl"
    words: ClassVar[str] = "slip that sets in gradually (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"slip_distance": float(d)} for d in scale.displacement * np.geomspace(0.01, 1.0, 8))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Dahl(1.0, shape["slip_distance"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        return joint + Dahl(stiffness, stiffness * shape["slip_distance"]) if stiffness > 0 else None
