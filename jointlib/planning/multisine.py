"""The signal to play: a multisine of low crest."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.planning.campaign import Campaign

_ROUNDS, _CLIP = 60, 0.8


def phases(campaign: Campaign, record: int, seed: int) -> ComplexArray:
    """Unit lines of one period from 0 Hz to half the rate; those outside the band are 0.

    Random phases, made less peaky by clipping the signal and taking the phases of what is left, again and again (Van
    der Ouderaa, Schoukens, Renneboog 1988).
    """
    n = campaign.period
    inside = excited(campaign)
    rng = np.random.default_rng([seed, record, n])
    lines = np.zeros(n // 2 + 1, dtype=complex)
    lines[inside] = np.exp(2j * np.pi * rng.random(int(inside.sum())))
    best, least = lines, crest(lines, n)
    for _ in range(_ROUNDS):
        x = np.fft.irfft(lines, n)
        top = _CLIP * np.abs(x).max()
        X = np.fft.rfft(np.clip(x, -top, top))
        lines = np.where(inside, X / np.maximum(np.abs(X), 1e-300), 0)
        if (now := crest(lines, n)) < least:
            best, least = lines, now
    return best


def excited(campaign: Campaign) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """True on the lines of the period that are driven."""
    f = np.arange(campaign.period // 2 + 1) * campaign.spacing
    edge = 1e-6 * campaign.spacing
    return np.asarray((f >= campaign.band[0] - edge) & (f <= campaign.band[1] + edge))


def crest(lines: ComplexArray, samples: int) -> float:
    """Peak over rms."""
    x = np.fft.irfft(lines, samples)
    return float(np.abs(x).max() / np.sqrt(np.mean(x * x)))


def unit_force(lines: ComplexArray, period: int, oversampling: int) -> Array:
    """One period of rms 1 at ``oversampling`` points a sample."""
    points = period * oversampling
    spectrum = np.zeros(points // 2 + 1, dtype=complex)
    spectrum[: len(lines)] = lines
    x = np.fft.irfft(spectrum, points)
    return np.asarray(x / np.sqrt(np.mean(x * x)))
