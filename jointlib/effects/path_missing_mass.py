"""A mass that moves along a path and that nobody declared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.path_fault import PathFault, PathRecord, Shape


class UndeclaredMass(PathFault):
    """F = mass·z̈ + f(z, ż) + F0: the force is measured behind a mass, and the balance has none."""

    family: ClassVar[str] = "missing-mass"
    words: ClassVar[str] = "that a mass moves along the path that the measurement does not declare (missing-mass)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "lag": "Weigh what moves, or repeat with a known mass added: a lag does not grow with it.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"mass": "kg"}
    inertia: ClassVar[bool] = True

    def columns(self, record: PathRecord, shape: Shape) -> Array:
        raise NotImplementedError("the acceleration of the balance is its column")

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"mass": float(coefficients[0])} if coefficients[0] > 0 else None

    def undo(self, force: Array, time: Array, position: Array, parameters: Mapping[str, float]) -> Array:
        return force
