"""What a receptance is a sum of: modes with a pole each, and one mode far above and one below for all others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray

ABOVE = 10.0
"""Frequency of the residual mode above, over that of the last line, where the lines do not tell it."""
BELOW = 1 / 3
"""Frequency of the residual mode below, over that of the first line, where the lines do not tell it."""
RESIDUAL_DAMPING = 0.1
_NEARER = (1.1, 1.25, 1.5, 2.0, 2.7, 4.0, 6.0)
_LITTLE = (0.85, 0.93, 0.97, 1.03, 1.07, 1.15)
_DAMPINGS = (0.02, 0.05, RESIDUAL_DAMPING)


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

    def nearer(self, frequency: Array) -> Iterator[Ends]:
        """Others, of which one residual mode lies nearer to the band or is damped less."""
        for ratio in _NEARER:
            for zeta in _DAMPINGS:
                high, low = 2 * np.pi * ratio * float(frequency[-1]), 2 * np.pi * float(frequency[0]) / ratio
                yield replace(self, above=(high, zeta * high))
                if self.below[0] > 0:
                    yield replace(self, below=(low, zeta * low))

    def around(self) -> Iterator[Ends]:
        """Others, of which one residual mode lies a little elsewhere."""
        for factor in _LITTLE:
            (high, d), (low, e) = self.above, self.below
            yield replace(self, above=(factor * high, factor * d))
            if low > 0:
                yield replace(self, below=(low / factor, e / factor))


@dataclass(frozen=True)
class Cut:
    """Where a motion ends before it has died out."""

    time: float
    """s after the force."""
    order: int = 0
    """0, 1 or 2 where a displacement, its velocity or its acceleration was measured."""


def modal(s: ComplexArray, omega: Array, decay: Array, cut: Cut | None = None) -> ComplexArray:
    """1/(s² + 2δs + ω²) of modes with natural angular frequency ω and decay δ = ζω, (lines, modes).

    With ``cut`` the transform of the motion after a short force lacks what comes after a time t: of its k-th derivative
    over s^k, 1/(s − λ) lacks (λ/s)^k·e^((λ − s)t)/(s − λ) at the poles λ = −δ ± jω_d.
    """
    whole = 1 / (s[:, None] ** 2 + 2 * decay * s[:, None] + omega**2)
    if cut is None:
        return np.asarray(whole)
    turn = np.sqrt(np.maximum(omega**2 - decay**2, 1e-12 * np.maximum(omega**2, 1.0)))
    pole = -decay + 1j * turn
    at = s[:, None]
    rest = ((p / at) ** cut.order * np.exp((p - at) * cut.time) / (at - p) for p in (pole, pole.conj()))
    return np.asarray(whole - (next(rest) - next(rest)) / (2j * turn))
