"""Hysteresis: contact faces that stick elastically and then slip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins


class ElasticSlip(JointEffect):
    """Jenkins element: a loop with memory, loading and unloading on different paths; shape is the slip distance."""

    family: ClassVar[str] = "hysteresis"
    member: ClassVar[str] = "jenkins"
    words: ClassVar[str] = "elastic slip in the contact faces (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"slip_distance": float(d)} for d in scale.displacement * np.geomspace(0.01, 1.0, 15))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Jenkins(1.0, shape["slip_distance"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        return joint + Jenkins(stiffness, stiffness * shape["slip_distance"]) if stiffness > 0 else None
