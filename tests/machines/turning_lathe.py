"""A slide on one joint that turns: the machine on which lobes over amplitude are told by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine

MASS, FREQUENCY, RATIO, SPEED = 25.33, 100.0, 0.03, 2350.0
"""kg, Hz, –, rpm."""
STIFFNESS = MASS * (2 * np.pi * FREQUENCY) ** 2
DAMPING = 2 * RATIO * np.sqrt(STIFFNESS * MASS)
CUBIC = 0.1 * STIFFNESS / (0.75 * (100e-6) ** 2)
"""N/m³: a tenth of the stiffness at 100 µm."""
TURNING = {"process": "turning", "specific": 1e9}


def lathe(*more: JointLaw, **cut: Any) -> Machine:
    """The slide on spring, damper and further laws."""
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING), *more))
    return Machine(
        components=(Lumped("slide", ("x",), np.array([[MASS]])),),
        connections=(Connection("guide", ("slide.x", "ground"), joint),),
        tool={"x": "slide.x"},
        frequency=(60.0, 200.0),
        cutting={**TURNING, **cut},
    )
