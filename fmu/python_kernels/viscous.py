"""Scalar kernel of the viscous damper."""

from __future__ import annotations


def viscous_force(z: float, v: float, *, damping: float) -> float:
    return damping * v
