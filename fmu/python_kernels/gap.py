"""Scalar kernel of play that interrupts a spring."""

from __future__ import annotations


def gap_force(z: float, v: float, *, stiffness: float, clearance: float) -> float:
    return -stiffness * min(max(z, -clearance), clearance)
