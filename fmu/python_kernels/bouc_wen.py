"""Scalar kernel of Bouc–Wen hysteresis: an exponential step over the travel, with play in series."""

from __future__ import annotations

import math

bouc_wen_state_units = {"position": "m", "stretch": "m"}

# Gauss points and weights on [0, 1].
BOUC_WEN_GAUSS = (
    (0.04691007703066802, 0.11846344252809454),
    (0.23076534494715845, 0.23931433524968324),
    (0.5, 0.28444444444444433),
    (0.7692346550528415, 0.23931433524968324),
    (0.9530899229693319, 0.11846344252809454),
)


def bouc_wen_initial(
    z: float, *, stiffness: float, slip_force: float, exponent: float, shape: float, clearance: float
) -> list[float]:
    return [z, 0.0]


def bouc_wen_rate(u: float, exponent: float, shape: float) -> float:
    if u == 0.0:
        return 1.0
    return 1.0 - math.pow(abs(u), exponent) * (shape + math.copysign(1.0 - shape, u))


def bouc_wen_advance(u: float, travel: float, exponent: float, shape: float) -> float:
    slope = max(bouc_wen_rate(u, exponent, shape), 1e-300)
    shrink = 1.0 + exponent * travel
    ahead = bouc_wen_rate(u + travel * slope / (1.5 * shrink), exponent, shape)
    r = min(1.5 * (ahead - slope) * shrink / slope, 30.0) + 1e-300
    return min(u + travel * slope * math.expm1(r) / r, 1.0)


def bouc_wen_step(
    z: float,
    v: float,
    h: float,
    state: list[float],
    *,
    stiffness: float,
    slip_force: float,
    exponent: float,
    shape: float,
    clearance: float,
) -> tuple[float, list[float]]:
    length = slip_force / stiffness
    travel, side = abs(z - state[0]), math.copysign(1.0, z - state[0])
    gap = min(max(state[1], -clearance), clearance)
    u = side * (state[1] - gap) / length
    bound = 1.0
    if clearance > 0.0:
        size, b = max(-u, 0.0), 2.0 * shape - 1.0
        to_zero = length * size * sum(w / (1.0 - b * math.pow(x * size, exponent)) for x, w in BOUC_WEN_GAUSS)
        past, room = max(travel - to_zero, 0.0), clearance - side * gap
        lost = min(past, room)
        if travel < to_zero:
            bound = 0.0 if u < 0.0 else 1.0
        else:
            bound = 0.0 if past < room else 1.0
            if u < 0.0:
                u, travel = 0.0, travel - to_zero
        travel, gap = max(travel - lost, 0.0), gap + side * lost
    u = side * min(bouc_wen_advance(u, travel / length, exponent, shape), bound)
    return slip_force * u, [z, length * u + gap]
