"""The first harmonic of a ramp (x)₊ = max(x, 0), of which laws with straight pieces are made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array


@dataclass(frozen=True, eq=False)
class Ramp:
    """Mean and first harmonic of (a + A cos θ)₊, in closed form, with cos φ = −a/A where the edge is crossed.

    Arrays of one shape; A and a are in m, so the gain has no unit.
    """

    gain: Array
    """(φ − sin φ cos φ)/π."""
    mean: Array
    """(a φ + A sin φ)/π, in m."""
    gain_by_amplitude: Array
    """2 sin φ cos φ/(πA), in 1/m."""
    gain_by_bias: Array
    """2 sin φ/(πA), in 1/m."""
    mean_by_amplitude: Array
    """sin φ/π."""
    mean_by_bias: Array
    """φ/π."""

    @classmethod
    def of(cls, amplitude: Array, a: Array) -> Ramp:
        """At amplitudes A ≥ 0 about a, how far beyond the edge the middle of the motion lies."""
        A = amplitude
        size = np.where(A > 0, A, 1.0)
        cos = np.where(A > 0, np.clip(-a / size, -1.0, 1.0), np.where(a > 0, -1.0, 1.0))
        phi, sin = np.arccos(cos), np.sqrt(1 - cos**2)
        steep = np.where(A > 0, 2 * sin / (np.pi * size), 0.0)
        return cls((phi - sin * cos) / np.pi, (a * phi + A * sin) / np.pi, steep * cos, steep, sin / np.pi, phi / np.pi)
