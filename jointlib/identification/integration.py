"""From acceleration to velocity and displacement line by line in the frequency domain: nothing drifts."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array


def frequencies(samples: int, sample_rate: float) -> Array:
    """Frequency in Hz of every line of a real signal of that many samples."""
    return np.asarray(np.fft.rfftfreq(samples, 1 / sample_rate), dtype=float)


def integrate(acceleration: Array, sample_rate: float, gain: Array) -> tuple[Array, Array]:
    """Displacement (m) and velocity (m/s) of a periodic acceleration, Z = −A/ω², V = A/(jω) on lines times ``gain``.

    The mean is never integrated, whatever its gain; lines of gain 0 contribute nothing.
    """
    n = len(acceleration)
    omega = 2 * np.pi * frequencies(n, sample_rate)
    omega[0] = 1.0
    lines = np.fft.rfft(acceleration) * gain
    lines[0] = 0.0
    return np.fft.irfft(-lines / omega**2, n), np.fft.irfft(lines / (1j * omega), n)


def band_gain(frequency: Array, band: tuple[float, float]) -> Array:
    """1 inside a band (Hz), 0 outside, with half-cosine flanks from 0.7 times its lower to 1.1 times its upper end."""
    low, high = band
    rise = np.clip((frequency - 0.7 * low) / (0.3 * low), 0, 1)
    fall = np.clip((1.1 * high - frequency) / (0.1 * high), 0, 1)
    gain: Array = np.sin(np.pi / 2 * rise) ** 2 * np.sin(np.pi / 2 * fall) ** 2
    return gain


def continued(signal: Array, margin: int) -> Array:
    """A record continued at both ends by its own point reflection, which leaves no step for a filter to ring on."""
    head = 2 * signal[0] - signal[margin:0:-1]
    tail = 2 * signal[-1] - signal[-2 : -margin - 2 : -1]
    return np.concatenate([head, signal, tail])
