"""Relaxation: a part of the joint that yields in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path, Scale, forces
from jointlib.joint import Joint
from jointlib.laws.maxwell import Maxwell

_CORNERS = np.geomspace(0.15, 12.0, 9)
"""Of peak velocity over peak displacement, roughly: rms velocity over peak z is 0.7 of the angular frequency of a tone
and a quarter of the mean one of a multisine, so both lie well inside."""


class Relaxation(JointEffect):
    """Maxwell element: a spring above a corner frequency, a damper below it; shape is the relaxation time."""

    family: ClassVar[str] = "relaxation"
    member: ClassVar[str] = "maxwell"
    words: ClassVar[str] = "a part that yields within one relaxation time (relaxation)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "structural-damping": "Drive over two decades: the loss of one relaxation peaks, structural loss stays level.",
        "viscous": "Drive to higher frequencies: past its corner a relaxing part is a spring and loses less.",
        "delay": "Record P as well and swap cables: a delay of a channel shows in the balance, relaxation does not.",
    }

    def shapes(self, scale: Scale, joint: Joint) -> tuple[Mapping[str, float], ...]:
        return tuple({"relaxation_time": float(t)} for t in scale.displacement / scale.velocity / _CORNERS)

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        return forces(path, Maxwell(1.0, shape["relaxation_time"]))

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        stiffness = float(coefficients[0])
        return joint + Maxwell(stiffness, stiffness * shape["relaxation_time"]) if stiffness > 0 else None
