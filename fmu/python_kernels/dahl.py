"""Scalar kernel of Dahl friction: the exact return map, with play in series."""

from __future__ import annotations

import math

dahl_state_units = {"position": "m", "stretch": "m"}


def dahl_initial(z: float, *, stiffness: float, slip_force: float, clearance: float) -> list[float]:
    return [z, 0.0]


def dahl_step(
    z: float, v: float, h: float, state: list[float], *, stiffness: float, slip_force: float, clearance: float
) -> tuple[float, list[float]]:
    length = slip_force / stiffness
    move = z - state[0]
    gap = min(max(state[1], -clearance), clearance)
    q = (state[1] - gap) / length
    if clearance > 0.0 and move != 0.0:
        side = math.copysign(1.0, move)
        to_zero = length * math.log1p(max(-side * q, 0.0))
        lost = side * min(max(abs(move) - to_zero, 0.0), clearance - side * gap)
        move, gap = move - lost, gap + lost
    decay = math.expm1(-abs(move) / length)
    q = q + q * decay + math.copysign(decay, move)
    return slip_force * q, [z, length * q + gap]
