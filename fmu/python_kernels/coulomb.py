"""Scalar kernel of dry friction."""

from __future__ import annotations

import math


def coulomb_force(z: float, v: float, *, slip_force: float, smoothing_velocity: float) -> float:
    if smoothing_velocity == 0.0:
        return math.copysign(slip_force, v) if v != 0.0 else 0.0
    return slip_force * math.tanh(v / smoothing_velocity)
