"""Scalar kernel of the polynomial force surface, by Horner's rule."""

from __future__ import annotations


def polynomial_force(z: float, v: float, *, coefficients: list[list[float]]) -> float:
    force = 0.0
    for row in reversed(coefficients):
        inner = 0.0
        for c in reversed(row):
            inner = inner * v + c
        force = force * z + inner
    return force
