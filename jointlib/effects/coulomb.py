"""Dry friction with a constant slip force."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb


class CoulombFriction(JointEffect):
    """f = slip_force·tanh(ż/smoothing_velocity): an equivalent damping that falls as 1/A.

    It is the Stribeck law without its bump: only motion at or below the speed of the bump tells the two apart.
    """

    family: ClassVar[str] = "coulomb"
    member: ClassVar[str] = "coulomb"
    words: ClassVar[str] = "dry friction (Coulomb)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "stribeck": "Record slow motion, at or below the speed where friction falls, or a free decay.",
        "hysteresis": "Move less than the slip distance: stuck contacts are elastic.",
        "quadratic-damping": "Repeat at three or more levels: friction loses weight, quadratic damping gains it.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"stribeck"})

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"smoothing_velocity": f * scale.velocity} for f in (0.01, 0.03, 0.1, 0.3, 0.9))

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Coulomb(1.0, shape["smoothing_velocity"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        force = float(coefficients[0])
        return joint + Coulomb(force, shape["smoothing_velocity"]) if force > 0 else None
