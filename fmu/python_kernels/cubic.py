"""Scalar kernel of the cubic spring."""

from __future__ import annotations


def cubic_force(z: float, v: float, *, stiffness3: float) -> float:
    return stiffness3 * (z * z * z)
