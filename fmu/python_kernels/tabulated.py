"""Scalar kernel of stiffness and damping by table over the displacement."""

from __future__ import annotations

import math


def tabulated_check(*, width: list[float], stiffness: list[float], damping: list[float]) -> None:
    if not len(width) == len(stiffness) == len(damping):
        raise ValueError(
            "tabulated: lists differ in length, expected as many entries of stiffness and damping as of width"
        )


def tabulated_force(z: float, v: float, *, width: list[float], stiffness: list[float], damping: list[float]) -> float:
    i, carried, edge = 0, 0.0, 0.0
    while i + 1 < len(width) and abs(z) >= edge + width[i]:
        carried += stiffness[i] * width[i]
        edge += width[i]
        i += 1
    beyond = abs(z) - edge
    rise = (damping[i + 1] - damping[i]) / width[i] if i + 1 < len(width) else 0.0
    return math.copysign(1.0, z) * (carried + stiffness[i] * beyond) + (damping[i] + rise * beyond) * v
