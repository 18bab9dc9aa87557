"""Scalar kernel of the Jenkins element: the exact return map of spring, play and slider."""

from __future__ import annotations

import math

jenkins_state_units = {"slider": "m"}


def jenkins_initial(z: float, *, stiffness: float, slip_force: float, clearance: float) -> list[float]:
    return [z]


def jenkins_step(
    z: float, v: float, h: float, state: list[float], *, stiffness: float, slip_force: float, clearance: float
) -> tuple[float, list[float]]:
    reach = slip_force / stiffness + clearance
    stretch = min(max(z - state[0], -reach), reach)
    loaded = math.copysign(max(abs(stretch) - clearance, 0.0), stretch)
    return stiffness * loaded, [z - stretch]
