"""Scalar kernel of viscous friction that differs between the directions."""

from __future__ import annotations


def viscous_by_direction_force(z: float, v: float, *, damping_positive: float, damping_negative: float) -> float:
    return damping_positive * v if v > 0.0 else damping_negative * v
