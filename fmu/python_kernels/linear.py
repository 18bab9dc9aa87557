"""Scalar kernel of the linear spring."""

from __future__ import annotations


def linear_force(z: float, v: float, *, stiffness: float) -> float:
    return stiffness * z
