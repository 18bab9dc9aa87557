"""Hysteresis: slip with play in series, which the elastic contact has to cross first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins

_SLIPS = 0.9
"""Of the peak motion: what holds up to there has hardly slipped."""


class SlipWithPlay(JointEffect):
    """Jenkins element behind play: after every reversal a stretch without load; shapes are both distances.

    As long as it sticks it is the spring with the gap alone: only the area that slip encloses tells the two apart.
    """

    family: ClassVar[str] = "hysteresis"
    member: ClassVar[str] = "jenkins"
    words: ClassVar[str] = "slip with play in series (hysteresis)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "coulomb": "Move less than the slip distance: stuck contacts are elastic.",
        "gap": "Run a slow loop: slip encloses an area, play does not.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"gap"})

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple(
            {"slip_distance": d * scale.displacement, "clearance": c * scale.displacement}
            for d in (0.02, 0.05, 0.12, 0.3, 0.7)
            for c in (0.02, 0.06, 0.18, 0.5)
            if d + c < _SLIPS
        )

    def reached(self, shape: Mapping[str, float], scale: Scale) -> bool:
        return shape["slip_distance"] + shape["clearance"] < _SLIPS * scale.displacement

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Jenkins(1.0, shape["slip_distance"], shape["clearance"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        if stiffness <= 0:
            return None
        return joint + Jenkins(stiffness, stiffness * shape["slip_distance"], shape["clearance"])
