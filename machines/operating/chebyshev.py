"""Windows of Chebyshev points, on which a function of frequency is smooth enough for one polynomial."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from jointlib.arrays import Array

POINTS = 9
_X = np.cos(np.pi * (2 * np.arange(POINTS) + 1) / (2 * POINTS))[::-1].copy()
_FIT = np.linalg.inv(chebyshev.chebvander(_X, POINTS - 1)).T
_FINE = np.linspace(-1, 1, 401)
_FINE_BASIS = chebyshev.chebvander(_FINE, POINTS - 1).T


@dataclass(frozen=True, eq=False)
class Minimum:
    """Minima of functions sampled on windows [−1, 1], one each: place, value and second derivative."""

    x: Array
    value: Array
    curvature: Array
    rest: Array
    """The last two coefficients of the polynomial, a measure of what it leaves out."""

    def of(self, samples: Array) -> Array:
        """Another function of the same windows at the places of the minima."""
        return _evaluate(samples @ _FIT, self.x)


def window(centre: Array, half: Array) -> Array:
    """Points of the windows, shape (windows, POINTS), ascending."""
    return np.asarray(centre[:, None] + half[:, None] * _X)


def minimum(samples: Array) -> Minimum:
    """The lowest point of the interpolating polynomial of each window, samples (windows, POINTS)."""
    coefficients = samples @ _FIT
    first = chebyshev.chebder(coefficients, axis=1)
    second = chebyshev.chebder(first, axis=1)
    x = _FINE[np.argmin(coefficients @ _FINE_BASIS, axis=1)]
    for _ in range(4):
        curvature = _evaluate(second, x)
        step = -_evaluate(first, x) / np.where(curvature > 0, curvature, np.inf)
        x = np.clip(x + np.clip(step, -0.01, 0.01), -1.0, 1.0)
    rest = np.max(np.abs(coefficients[:, -2:]), axis=1)
    return Minimum(x, _evaluate(coefficients, x), _evaluate(second, x), rest)


def _evaluate(coefficients: NDArray[np.floating[Any]], x: Array) -> Array:
    return np.asarray(np.sum(chebyshev.chebvander(x, coefficients.shape[1] - 1) * coefficients, axis=1))
