"""What a receptance is a sum of: modes with a pole each, and one mode far above and one below for all others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

ABOVE = 10.0
"""Frequency of the residual mode above, over that of the last line."""
BELOW = 1 / 3
"""Frequency of the residual mode below, over that of the first line."""
RESIDUAL_DAMPING = 0.1


@dataclass(frozen=True)
class Ends:
    """Poles of the residual modes: angular frequency and decay in 1/s."""

    above: tuple[float, float]
    below: tuple[float, float]

    @classmethod
    def of(cls, frequency: Array, free: bool = False) -> Ends:
        """Beyond the lines (Hz); ``free``: what is below is the motion of a free body, at 0 Hz."""
        high, low = 2 * np.pi * ABOVE * frequency[-1], 2 * np.pi * BELOW * frequency[0]
        low = 0.0 if free else low
        return cls((float(high), float(RESIDUAL_DAMPING * high)), (float(low), float(RESIDUAL_DAMPING * low)))


def modal(s: ComplexArray, omega: Array, decay: Array) -> ComplexArray:
    """1/(s² + 2δs + ω²) of modes with natural angular frequency ω and decay δ = ζω, (lines, modes)."""
    return np.asarray(1 / (s[:, None] ** 2 + 2 * decay * s[:, None] + omega**2))
