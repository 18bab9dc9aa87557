"""Scalar kernel of the quadratic spring."""

from __future__ import annotations


def quadratic_force(z: float, v: float, *, stiffness2: float) -> float:
    return stiffness2 * (z * z)
