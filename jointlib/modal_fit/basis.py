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


@dataclass(frozen=True, eq=False)
class Cut:
    """Where a motion ends before it has died out.

    Parameters
    ----------
    time
        s, end of the motion.
    step
        s between samples.
    order
        0, 1 or 2 where a displacement, its velocity or its acceleration was measured.
    at
        s, times of the samples of the pulses.
    pulses
        The forces that made it, (pulses, samples).
    line
        Their transforms at every line, (pulses, lines).
    """

    time: float
    step: float
    order: int
    at: Array
    pulses: Array
    line: ComplexArray

    @classmethod
    def after(cls, pulses: Array, at: Array, time: float, step: float, s: ComplexArray, order: int = 0) -> Cut:
        """Of the lines s in 1/s."""
        return cls(time, step, order, at, pulses, np.asarray(pulses @ np.exp(-np.outer(at, s))))

    @property
    def middle(self) -> float:
        """s: the middle of the pulses."""
        size = np.sum(np.abs(self.pulses), axis=0)
        return float(np.sum(size * self.at) / np.sum(size))

    def lost(self, pole: ComplexArray, s: ComplexArray) -> ComplexArray:
        """What 1/(s − λ) lacks, (lines, poles): (λ/s)^k·e^((λ − s)t)·Δ/(1 − e^((λ − s)Δ))·Σ P(λ)P(s)*/Σ |P(s)|².

        After a pulse P a mode moves as P(λ)·e^(λt); what is lacking is its samples from t on, Δ apart, as a
        least-squares quotient of the transforms over several pulses weighs them.
        """
        driven = self.pulses @ np.exp(-np.outer(self.at, pole))
        share = self.line.conj().T @ driven / np.sum(np.abs(self.line) ** 2, axis=0)[:, None]
        away = pole - s[:, None]
        tail = np.exp(away * self.time) * self.step / -np.expm1(away * self.step)
        return np.asarray((pole / s[:, None]) ** self.order * tail * share)


def modal(s: ComplexArray, omega: Array, decay: Array, cut: Cut | None = None) -> ComplexArray:
    """1/(s² + 2δs + ω²) of modes with natural angular frequency ω and decay δ = ζω, (lines, modes).

    With ``cut``, of whose lines s are, the transform of the motion lacks what comes after its end, see `Cut.lost`, at
    the poles λ = −δ ± jω_d.
    """
    whole = 1 / (s[:, None] ** 2 + 2 * decay * s[:, None] + omega**2)
    if cut is None:
        return np.asarray(whole)
    turn = np.sqrt(np.maximum(omega**2 - decay**2, 1e-12 * np.maximum(omega**2, 1.0)))
    pole = -decay + 1j * turn
    return np.asarray(whole - (cut.lost(pole, s) - cut.lost(pole.conj(), s)) / (2j * turn))
