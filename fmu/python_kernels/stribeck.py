"""Scalar kernel of dry friction that is larger at low speed."""

from __future__ import annotations

import math


def stribeck_check(
    *, slip_force: float, static_force: float, stribeck_velocity: float, smoothing_velocity: float
) -> None:
    if static_force < slip_force:
        raise ValueError(f"stribeck: static_force is {static_force} N, expected at least slip_force = {slip_force} N")


def stribeck_force(
    z: float,
    v: float,
    *,
    slip_force: float,
    static_force: float,
    stribeck_velocity: float,
    smoothing_velocity: float,
) -> float:
    ratio = v / stribeck_velocity
    size = slip_force + (static_force - slip_force) * math.exp(-(ratio * ratio))
    if smoothing_velocity == 0.0:
        return math.copysign(size, v) if v != 0.0 else 0.0
    return size * math.tanh(v / smoothing_velocity)
