"""Frequency responses from averaged spectra: H1, H2, Hv, coherence and the error of every line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.estimation.noise import ALONE, lines_alike, noise_of

COVERED = 0.95
"""Probability of the bound of an error."""
_TINY = 1e-300
_MOSTLY_BIAS = 1e6


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


@dataclass(frozen=True, eq=False)
class Spread:
    """What chance and noise do to a response, an entry per line."""

    variance: Array
    """E|error|²: what chance does, and the square of the bias."""
    radius: Array
    """|error| lies below it with a probability of 95 %."""
    alike: Array
    """Lines that err together with this one, weighed by what they share: the sum of |ρ|² over all lines."""


def spread_of(
    of: Averages,
    H: ComplexArray,
    estimator: str,
    motion: Array = ALONE,
    force: Array = ALONE,
    raised: Array | float = 1.0,
) -> Spread | None:
    """E|error|² of every line and its bound at 95 %; None of one average.

    Chance: the residual power r = S_xx·(1 − γ²)·n/(n − 1) over n·S_ff, that is |H|²·(1 − γ²)/((n − 1)·γ²) (Bendat,
    Piersol, eq. 9.81 with n − 1 for the n that one parameter, H, was taken from). Few averages tell r of one line
    badly, so it is r = N_x + |H|²·N_f with both found from the lines around; see `jointlib.estimation.noise.noise_of`.
    ``raised`` is how much more noise than elsewhere a line has, as far as it is known.
    Bias: −N_f/S_ff of H by H1, N_x/(S_xx − N_x) by H2, the mean of both by Hv.
    """
    if of.count <= 1:
        return None
    residual = of.response * np.maximum(1 - of.coherence, 0.0) * of.count / (of.count - 1)
    H1 = np.abs(of.cross) / np.maximum(of.force, _TINY)
    noise = noise_of(residual / raised, H1**2 / raised, of.count - 1, motion, force)
    with np.errstate(all="ignore"):
        factor = np.where(H1 > 0, np.abs(H) / np.maximum(H1, _TINY), 1.0)
    chance = factor**2 * noise.power * raised / (of.count * np.maximum(of.force, _TINY))
    down = noise.force / np.maximum(of.force, _TINY)
    up = noise.motion * raised / np.maximum(of.response - noise.motion * raised, 0.1 * of.response + _TINY)
    bias = np.abs(H) * np.abs({"H1": -down, "H2": up, "Hv": (up - down) / 2}[estimator])
    by_motion = noise.motion / np.maximum(noise.power, _TINY)
    alike = by_motion * lines_alike(motion) + (1 - by_motion) * lines_alike(force)
    return spread(chance, noise.freedom, bias, alike)


def spread(chance: Array, freedom: Array, bias: Array | float = 0.0, alike: Array | float = 1.0) -> Spread:
    """Of an error whose mean is ``bias`` and whose variance ``chance`` was found from ``freedom`` complex residuals.

    Without bias |error|²/chance has the distribution F(2, 2·freedom). With bias the χ² above the line is not central;
    it is taken as a multiple of a central one with the same mean and variance (Patnaik, Biometrika 36, 1949).
    """
    off = np.minimum(2 * np.asarray(bias) ** 2 / np.maximum(chance, _TINY), _MOSTLY_BIAS)
    degrees = (2 + off) ** 2 / (2 + 2 * off)
    bound = chance / 2 * (2 + off) * scipy.special.fdtri(degrees, 2 * freedom, COVERED)
    return Spread(
        np.asarray(chance + np.asarray(bias) ** 2), np.asarray(np.sqrt(bound)), np.broadcast_to(alike, chance.shape)
    )
