"""Scalar kernel of LuGre friction: the bristle followed along the travel, with play in series."""

from __future__ import annotations

import math

lugre_state_units = {"position": "m", "stretch": "m"}


def lugre_check(
    *,
    stiffness: float,
    damping: float,
    slip_force: float,
    static_force: float,
    stribeck_velocity: float,
    clearance: float,
) -> None:
    if static_force < slip_force:
        raise ValueError(f"lugre: static_force is {static_force} N, expected at least slip_force = {slip_force} N")


def lugre_initial(
    z: float,
    *,
    stiffness: float,
    damping: float,
    slip_force: float,
    static_force: float,
    stribeck_velocity: float,
    clearance: float,
) -> list[float]:
    return [z, 0.0]


def lugre_length(v: float, stiffness: float, slip_force: float, static_force: float, stribeck_velocity: float) -> float:
    ratio = v / stribeck_velocity
    return (slip_force + (static_force - slip_force) * math.exp(-ratio * ratio)) / stiffness


def lugre_step(
    z: float,
    v: float,
    h: float,
    state: list[float],
    *,
    stiffness: float,
    damping: float,
    slip_force: float,
    static_force: float,
    stribeck_velocity: float,
    clearance: float,
) -> tuple[float, list[float]]:
    move = z - state[0]
    length = lugre_length(move / h if h > 0.0 else v, stiffness, slip_force, static_force, stribeck_velocity)
    gap = min(max(state[1], -clearance), clearance)
    y = state[1] - gap
    free = False
    if clearance > 0.0:
        side = math.copysign(1.0, move) if move != 0.0 else 0.0
        to_zero = length * math.log1p(max(-side * y, 0.0) / length)
        past, room = max(abs(move) - to_zero, 0.0), clearance - side * gap
        free = abs(move) >= to_zero and past < room if side else abs(gap) < clearance
        lost = side * min(past, room)
        move, gap = move - lost, gap + lost
    decay = math.expm1(-abs(move) / length)
    y = y + y * decay + math.copysign(length * decay, move)
    rate = v - abs(v) * y / lugre_length(v, stiffness, slip_force, static_force, stribeck_velocity)
    return stiffness * y + (0.0 if free else damping * rate), [z, y + gap]
