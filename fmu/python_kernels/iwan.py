"""Scalar kernel of the Iwan model: the exact return map of every slider."""

from __future__ import annotations

import math

iwan_state_units = {"slider": "m"}


def iwan_check(*, stiffness: list[float], slip_force: list[float], clearance: float) -> None:
    if len(stiffness) != len(slip_force):
        raise ValueError(f"iwan: {len(slip_force)} entries of slip_force, expected {len(stiffness)}, as of stiffness")


def iwan_initial(z: float, *, stiffness: list[float], slip_force: list[float], clearance: float) -> list[float]:
    return [z] * len(stiffness)


def iwan_step(
    z: float,
    v: float,
    h: float,
    state: list[float],
    *,
    stiffness: list[float],
    slip_force: list[float],
    clearance: float,
) -> tuple[float, list[float]]:
    force, sliders = 0.0, []
    for k, slip, slider in zip(stiffness, slip_force, state, strict=True):
        reach = slip / k + clearance
        stretch = min(max(z - slider, -reach), reach)
        force += k * math.copysign(max(abs(stretch) - clearance, 0.0), stretch)
        sliders.append(z - stretch)
    return force, sliders
