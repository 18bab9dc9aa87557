"""Hysteresis: bristles that bend, slip and slide with less force the faster they go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.lugre import LuGre


class BristleFriction(JointEffect):
    """LuGre friction without bristle damping; shapes are slip distance, Stribeck velocity, and static over sliding
    force less 1."""

    family: ClassVar[str] = "hysteresis"
    leads: ClassVar[bool] = False
    member: ClassVar[str] = "lugre"
    words: ClassVar[str] = "elastic slip that eases with speed (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "stribeck": "Reverse slowly: bristles bend before they slide.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple(
            {"slip_distance": d * scale.displacement, "stribeck_velocity": v * scale.velocity, "bump": 0.5}
            for d in (0.02, 0.1, 0.5)
            for v in (0.2, 0.7)
        )

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, _law(1.0, shape))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        return joint + _law(stiffness, shape) if stiffness > 0 else None


def _law(stiffness: float, shape: Mapping[str, float]) -> LuGre:
    sliding = stiffness * shape["slip_distance"]
    return LuGre(stiffness, 0.0, sliding, sliding * (1 + shape["bump"]), shape["stribeck_velocity"])
