"""How much noise there is at a line, from what the averages leave there and around, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array

_MOST = 16
"""Lines on either side over which the noise of a motion counts as even, at most."""
_ENOUGH = 60.0
"""Independent residuals that tell a noise power to 13 %: no more lines are taken together than give as many."""
_PIECES = 3.0
"""Times the lines that share an error, on either side, over which the noise of the force counts as even."""
_CALM = 3
"""Times the lines at hand over which the weights are even."""
_LEAST = 0.3
"""Times its standard error, below which noise of a motion is not told from none: no line counts as without noise."""
_ROUNDS = 4
_FINEST = 64
"""Bins to either side that a sum over many lines is made of."""
_TINY = 1e-300
ALONE = np.ones(1)
"""Lines that err each for itself."""


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of every line by its sources: N_x on the motion, N_f on the force, in units of S_xx and S_ff."""

    motion: Array
    force: Array
    gain: Array
    """|H|²."""
    freedom: Array
    """Independent complex residuals that the sum of both was found from."""

    @property
    def power(self) -> Array:
        """N_x + |H|²·N_f: what is left of the motion when H times the force is taken away."""
        return self.motion + self.gain * self.force


def shared(window: Array) -> Array:
    """|ρ|² between lines so far apart, of white noise under a window: |Σ w²·e^(−jωt)|²/(Σ w²)², from distance 0 on."""
    return np.asarray(np.abs(np.fft.rfft(window**2)) ** 2 / max(float(np.sum(window**2)) ** 2, _TINY))


def lines_alike(together: Array) -> float:
    """How many lines share one error: the sum of |ρ|² over both sides."""
    return float(together[0] + 2 * np.sum(together[1:]))


def noise_of(residual: Array, gain: Array, free: float, motion: Array = ALONE, force: Array = ALONE) -> Noise:
    """N_x + N_f·|H|² fitted to the residual powers of the lines around, neither below zero.

    A residual power scatters in proportion to its mean, so the weights are 1/mean²; they are found in a few rounds. The
    noise of the motion is taken as even over the lines at hand, that of the force over further ones where a short
    window makes many lines err together. Both are sums of residuals with known weights, so the scatter of their sum
    follows from the weights and from |ρ|² between lines; it is that of a χ² of as many degrees of freedom
    (Satterthwaite, Biometrics Bulletin 2, 1946).

    Parameters
    ----------
    residual
        Power of the residual, mean over the averages, corrected for the one parameter taken from them.
    gain
        |H|².
    free
        n − 1, independent residuals of one line.
    motion, force
        |ρ|² by distance in lines, as `shared` gives it, of the noise of the motion and of the force.
    """
    if not np.any(residual > 0):
        tiny = np.full(len(residual), np.finfo(float).tiny)
        return Noise(tiny, 0 * tiny, gain, np.full(len(residual), max(free, 1.0)))
    size = float(np.max(gain, initial=0.0)) or 1.0
    g, floor = gain / size, 1e-12 * float(np.mean(residual))
    alike = lines_alike(motion)
    near = int(np.clip(np.ceil(_ENOUGH * alike / max(free, 1e-9) / 2), 1, _MOST))
    wide = max(int(_PIECES * lines_alike(force)), _MOST)
    ones = np.ones(len(residual))
    mean = even = np.maximum(_around(residual, _CALM * near) / _around(ones, _CALM * near), floor)
    for _ in range(_ROUNDS):
        w = 1 / even**2
        s0, s1, s2 = (_around(w * g**k, wide) for k in range(3))
        t0, t1 = (_around(w * residual * g**k, wide) for k in range(2))
        det = s0 * s2 - s1**2
        sound = det > 1e-9 * s0 * s2
        det = np.where(sound, det, 1.0)
        b = np.where(sound, (s0 * t1 - s1 * t0) / det, 0.0)
        a = np.where(sound, (s2 * t0 - s1 * t1) / det, 1.0)
        b = np.maximum(np.where(a < 0, t1 / np.maximum(s2, _TINY), b), 0.0)
        local = _around(w, near)
        error = np.sqrt(alike / (local * max(free, 1e-9)))
        a = np.maximum(_around(w * (residual - b * g), near) / local, _LEAST * error)
        mean = np.maximum(a + b * g, floor)
        # a weight that follows the residuals it weighs would favour the small ones
        even = np.maximum(_around(a, _CALM * near) / _around(ones, _CALM * near) + b * g, floor)
    # mean = Σ c·residual, c = A + (g − ḡ)·B, where Σ A·g = ḡ over the lines at hand and Σ B·g = 1 over the wide ones
    w = 1 / even**2
    s0, s1, s2 = (_around(w * g**k, wide) for k in range(3))
    det = np.where(sound, s0 * s2 - s1**2, np.inf)
    local = _around(w, near)
    middle = _around(w * g, near) / local
    off = g - middle
    by_motion = alike * (1 / local + off**2 * s0 / det + 2 * off * (middle * s0 - s1) / det)
    y1, y2 = w * g, w * g**2
    z1, z2 = _together(y1, force), _together(y2, force)
    rest = _around(y2 * z2, wide) * s0**2 - 2 * _around(y1 * z2, wide) * s0 * s1 + _around(y1 * z1, wide) * s1**2
    here = np.minimum(_around(y1 * _together(y1, force[: 2 * near + 1]), near) / local**2, middle**2)
    both = middle * (z2 * s0 - z1 * s1) / det
    by_force = b**2 * (here + off**2 * np.maximum(rest, 0.0) / det**2 + 2 * off * both)
    scatter = np.maximum(by_motion, 0.0) + np.maximum(by_force, 0.0)
    most = (2 * wide + 1) * free
    freedom = np.clip(free * mean**2 / np.maximum(scatter, _TINY), min(free, 1.0), most)
    return Noise(np.maximum(a, floor - b * g), b / size, gain, freedom)


def _together(values: Array, sharing: Array) -> Array:
    """Σ_k values_k·|ρ|² of every line."""
    kernel = np.concatenate([sharing[:0:-1], sharing])
    if len(kernel) == 1:
        return np.asarray(values * kernel[0])
    scale = max(float(np.max(np.abs(values))), _TINY)
    size = scipy.fft.next_fast_len(len(values) + len(kernel) - 1, real=True)
    both = scipy.fft.irfft(scipy.fft.rfft(values / scale, size) * scipy.fft.rfft(kernel, size), size)
    return np.asarray(scale * both[len(sharing) - 1 :][: len(values)])


def _around(values: Array, reach: int) -> Array:
    """Sums over so many lines on either side; of many lines in bins, so that the work grows with their number alone."""
    bins = max(1, reach // _FINEST)
    padded = np.concatenate([values, np.zeros(-len(values) % bins)]).reshape(-1, bins).sum(axis=1)
    width = min(2 * (reach // bins) + 1, 2 * len(padded) - 1)
    summed = np.convolve(padded, np.ones(width), mode="full")[width // 2 : width // 2 + len(padded)]
    return np.repeat(summed, bins)[: len(values)]
