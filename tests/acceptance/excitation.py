"""What the exciter does: the two signals of the suite, as spectra of one period of 50 ms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RATE = 102.4e3
"""Hz."""
PERIOD = 5120
"""Samples of one period."""
GRID = RATE / PERIOD
"""Hz between the lines of the period: 20."""


def multisine(rng: np.random.Generator) -> NDArray[np.complex128]:
    """MS: every line from 2 to 8 kHz equally strong, phases random; peak amplitude 1 each, from 0 Hz on."""
    frequency = GRID * np.arange(PERIOD // 2)
    inside = (frequency >= 2000) & (frequency <= 8000)
    return np.asarray(np.where(inside, np.exp(2j * np.pi * rng.random(len(frequency))), 0))


def modulated_sine(rng: np.random.Generator) -> NDArray[np.complex128]:
    """AM: a sine of 4.8 kHz whose amplitude swings by 80 % at 20 Hz; both phases random."""
    lines = np.zeros(PERIOD // 2, dtype=complex)
    carrier, swing = np.exp(2j * np.pi * rng.random(2))
    k = round(4800 / GRID)
    lines[k - 1 : k + 2] = carrier * np.array([0.4 * np.conj(swing), 1, 0.4 * swing])
    return lines


SIGNALS = {"MS": multisine, "AM": modulated_sine}


def force(lines: NDArray[np.complex128], periods: int, oversampling: int) -> NDArray[np.float64]:
    """The signal along ``periods`` periods at ``oversampling`` points a sample; lines (..., PERIOD/2)."""
    points = PERIOD * oversampling
    spectrum = np.zeros((*lines.shape[:-1], points // 2 + 1), dtype=complex)
    spectrum[..., : lines.shape[-1]] = lines * points / 2
    once = np.fft.irfft(spectrum, points)
    return np.tile(once, (1,) * (lines.ndim - 1) + (periods,))
