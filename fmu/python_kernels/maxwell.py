"""Scalar kernel of the Maxwell element: spring and damper in series, exact for a path that is linear in a step."""

from __future__ import annotations

import math

maxwell_state_units = {"position": "m", "stretch": "m"}


def maxwell_initial(z: float, *, stiffness: float, damping: float) -> list[float]:
    return [z, 0.0]


def maxwell_step(
    z: float, v: float, h: float, state: list[float], *, stiffness: float, damping: float
) -> tuple[float, list[float]]:
    x = h * stiffness / damping
    forgotten = -math.expm1(-x)
    followed = forgotten / x if x > 0.0 else 1.0
    stretch = state[1] - forgotten * state[1] + followed * (z - state[0])
    return stiffness * stretch, [z, stretch]
