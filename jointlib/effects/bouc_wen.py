"""Hysteresis: a smooth loop between elastic and sliding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.bouc_wen import BoucWen


class BoucWenLoop(JointEffect):
    """Bouc–Wen loop that unloads elastically; shapes are the slip distance and its exponent less 1."""

    family: ClassVar[str] = "hysteresis"
    leads: ClassVar[bool] = False
    member: ClassVar[str] = "bouc-wen"
    words: ClassVar[str] = "a smooth loop between sticking and sliding (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        distances = scale.displacement * np.geomspace(0.02, 0.8, 4)
        return tuple({"slip_distance": float(d), "sharpness": s} for d in distances for s in (0.5, 3.0))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, BoucWen(1.0, shape["slip_distance"], 1 + shape["sharpness"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        if stiffness <= 0:
            return None
        return joint + BoucWen(stiffness, stiffness * shape["slip_distance"], 1 + shape["sharpness"])
