"""Scalar kernel of a contact lost, or a stop met, on one side."""

from __future__ import annotations


def contact_loss_check(*, stiffness: float, clearance: float, side: float) -> None:
    if abs(side) != 1.0:
        raise ValueError(f"contact-loss: side is {side}, expected 1 or -1")


def contact_loss_force(z: float, v: float, *, stiffness: float, clearance: float, side: float) -> float:
    return -side * stiffness * max(side * z - clearance, 0.0)
