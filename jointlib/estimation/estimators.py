"""Frequency responses from averaged spectra: H1, H2, Hv, coherence and the variance of every line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray

_REACH = 16
"""Lines on either side over which the noise of the sensors counts as even."""
_ROUNDS = 4
_FINEST = 64
"""Bins to either side that a sum over many lines is made of."""
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Averages:
    """Averaged spectra of one force f and one response x, an entry per line."""

    force: Array
    """S_ff, mean of |F|²."""
    response: Array
    """S_xx, mean of |X|²."""
    cross: ComplexArray
    """S_xf, mean of X·F*."""
    count: float
    """Independent averages n."""

    @property
    def coherence(self) -> Array:
        """γ² = |S_xf|²/(S_xx·S_ff)."""
        return np.abs(self.cross) ** 2 / np.maximum(self.response * self.force, _TINY)


def averages(F: ComplexArray, X: ComplexArray) -> Averages:
    """Of blocks, (blocks, lines)."""
    return Averages(
        np.mean(np.abs(F) ** 2, axis=0), np.mean(np.abs(X) ** 2, axis=0), np.mean(X * F.conj(), axis=0), len(F)
    )


def transfer(of: Averages, estimator: str) -> ComplexArray:
    """X/F by H1 = S_xf/S_ff, H2 = S_xx/S_xf* or Hv = √(H1·H2).

    Noise on the response leaves H1 without bias and noise on the force H2; with noise N_f on the force H1 is too small
    by 1/(1 + N_f/S), with N_x on the response H2 too large by 1 + N_x/(|H|²·S), S the force without noise. Hv lies
    between (Bendat, Piersol, Random Data, 4th ed., ch. 6.1.4 and 9). All have the phase of S_xf.
    """
    H1 = of.cross / np.maximum(of.force, _TINY)
    over = np.sqrt(np.maximum(of.coherence, _TINY))
    return np.asarray({"H1": H1, "H2": H1 / over**2, "Hv": H1 / over}[estimator])


def variance_of(of: Averages, H: ComplexArray, even: int = 0) -> Array | None:
    """E|error|² of every line, |H|²·(1 − γ²)/((n − 1)·γ²), of the part that chance plays; None of one average.

    It is the residual power r = S_xx·(1 − γ²)·n/(n − 1) over n·S_ff (Bendat, Piersol, eq. 9.81 with n − 1 for the n
    that one parameter, H, was taken from). Few averages tell r of one line badly, so it is r = N_x + |H|²·N_f with the
    noise N_x of the response and N_f of the force each even over 33 lines, N_f over ``even`` lines on either side where
    those are more.
    """
    if of.count <= 1:
        return None
    residual = of.response * np.maximum(1 - of.coherence, 0.0) * of.count / (of.count - 1)
    H1 = np.abs(of.cross) / np.maximum(of.force, _TINY)
    smooth = noise_power(residual, H1**2, even)
    with np.errstate(all="ignore"):
        factor = np.where(H1 > 0, np.abs(H) / np.maximum(H1, _TINY), 1.0)
    return np.asarray(factor**2 * smooth / (of.count * np.maximum(of.force, _TINY)))


def noise_power(residual: Array, gain: Array, even: int = 0) -> Array:
    """a + b·gain, fitted to the residual powers of the lines around, neither below zero; see `variance_of`.

    A residual power scatters in proportion to its mean, so the weights are 1/mean²; they are found in a few rounds.
    """
    if not np.any(residual > 0):
        return np.full(len(residual), np.finfo(float).tiny)
    size = np.max(gain, initial=0.0) or 1.0
    g, floor = gain / size, 1e-12 * float(np.mean(residual))
    wide = max(even, _REACH)
    mean = np.maximum(_around(residual, _REACH) / _around(np.ones(len(residual)), _REACH), floor)
    for _ in range(_ROUNDS):
        w = 1 / mean**2
        s0, s1, s2 = (_around(w * g**k, wide) for k in range(3))
        t0, t1 = (_around(w * residual * g**k, wide) for k in range(2))
        det = s0 * s2 - s1**2
        sound = det > 1e-9 * s0 * s2
        b = np.where(sound, (s0 * t1 - s1 * t0) / np.where(sound, det, 1.0), 0.0)
        a = np.where(sound, (s2 * t0 - s1 * t1) / np.where(sound, det, 1.0), 1.0)
        b = np.maximum(np.where(a < 0, t1 / np.maximum(s2, _TINY), b), 0.0)
        a = np.maximum(_around(w * (residual - b * g), _REACH) / _around(w, _REACH), 0.0)
        mean = np.maximum(a + b * g, floor)
    return mean


def _around(values: Array, reach: int) -> Array:
    """Sums over so many lines on either side; of many lines in bins, so that the work grows with their number alone."""
    bins = max(1, reach // _FINEST)
    padded = np.concatenate([values, np.zeros(-len(values) % bins)]).reshape(-1, bins).sum(axis=1)
    width = min(2 * (reach // bins) + 1, 2 * len(padded) - 1)
    summed = np.convolve(padded, np.ones(width), mode="full")[width // 2 : width // 2 + len(padded)]
    return np.repeat(summed, bins)[: len(values)]
