"""Scalar kernel of damping that grows with speed."""

from __future__ import annotations


def quadratic_damping_force(z: float, v: float, *, damping2: float) -> float:
    return damping2 * v * abs(v)
