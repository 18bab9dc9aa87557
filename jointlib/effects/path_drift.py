"""A force sensor whose zero wanders during a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.path_fault import PathFault, PathRecord, Shape


class ForceDrift(PathFault):
    """measured = F + slope·t + curvature·t², t in s on the laboratory clock; the constant belongs to the offset F0."""

    family: ClassVar[str] = "drift"
    words: ClassVar[str] = "that the zero of the force wanders (drift)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "viscous-by-direction": "Repeat both directions in turn: a drift of the offset averages out.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"slope": "channel/s", "curvature": "channel/s^2"}
    requires: ClassVar[str] = "clock"
    experiment: ClassVar[str] = "a start for every record, or the same record at the start and the end of a session"

    def columns(self, record: PathRecord, shape: Shape) -> Array:
        return np.array([record.time, record.time**2])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"slope": float(coefficients[0]), "curvature": float(coefficients[1])}

    def undo(self, force: Array, time: Array, position: Array, parameters: Mapping[str, float]) -> Array:
        return np.asarray(force - parameters["slope"] * time - parameters["curvature"] * time**2)
