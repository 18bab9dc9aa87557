"""Scalar kernel of the Chebyshev force surface, by Clenshaw's recurrence."""

from __future__ import annotations


def chebyshev_series(x: float, coefficients: list[float]) -> float:
    after = later = 0.0
    for c in reversed(coefficients[1:]):
        after, later = c + 2.0 * x * after - later, after
    return coefficients[0] + x * after - later


def chebyshev_force(
    z: float, v: float, *, coefficients: list[list[float]], displacement_scale: float, velocity_scale: float
) -> float:
    y = v / velocity_scale
    return chebyshev_series(z / displacement_scale, [chebyshev_series(y, row) for row in coefficients])
