"""Noise of a measured frequency response, line by line: from records that repeat, else from neighbouring lines.

On a few lines the response of a structure is a ratio of two low polynomials in frequency. What such a ratio, fitted to
the lines around one line but not to that line itself, misses of it is noise: the local rational method of McKelvey and
Guérin (IFAC SYSID 2012) with one line left out. The error of one line is a poor estimate, so many are gathered, by
their median, which the jump of a folded response does not move.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from jointlib.arrays import Array, ComplexArray

_WINDOW = 9
_POWERS = np.arange(3)
"""Of the numerator and of the denominator: up to two resonances in a window."""
_SWEEPS = 3
_NEAREST_POLE = 0.05
_NOISE = 2.0
"""Deviations that a column of noise in a window is long."""
_GATHERED = 61
_FLOORS = 0.5 ** np.arange(1, 10)
"""Shares of the largest |H| below which noise may be that of the motion, above which that of the force."""
_FLAT = 1e-3
_PREFERENCE = 15.0
"""Logarithm of the likelihood by which noise that follows |H|, and then both noises, must beat what is simpler."""
_ROUNDING = 1e-15
_OUTLIER = 8.0
"""Of squares over their variance: a few lines at a peak that a local fit does not hold decide nothing."""
FEWEST = 16
"""Lines that an estimate from neighbours needs."""


def from_neighbours(frequency: Array, H: ComplexArray) -> Array:
    """√(E|error|²) of each line in the unit of H; at least `FEWEST` ascending lines.

    Within a fifth of the truth where a half-power width has a line or more; where lines are sparser than that, or
    noise is below about a thousandth of H, the fit misses more than noise and the estimate is too large.
    """
    deviation = None
    for _ in range(2):
        error, smooth = local_errors(frequency, H, deviation)
        deviation = _gathered(np.abs(error[None]) ** 2, np.abs(smooth))
    assert deviation is not None
    return deviation


def from_repeats(repeats: Sequence[ComplexArray]) -> Array:
    """√(E|error|²) of each line of one record, from two or more on the same lines under the same force."""
    H = np.array(repeats)
    mean = H.mean(axis=0)
    return _gathered(np.abs(H - mean) ** 2 * len(H) / (len(H) - 1), np.abs(mean))


def local_errors(
    frequency: Array, H: ComplexArray, deviation: Array | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """Per line, what the fit to the lines around it misses, scaled to the deviation of one line; and that fit.

    Where no resonance bends the response, the columns of the denominator differ from those of the numerator by noise
    alone, and a fit of the one noise by the other misses less than the deviation of a line. With a first estimate of
    the ``deviation`` what is no longer than noise in them is left out, where it tells no more of the response either.
    """
    missed, smooth, _ = _local_fits(frequency, H, deviation)
    return missed, smooth


def local_slopes(frequency: Array, H: ComplexArray) -> ComplexArray:
    """dH/df of each line, from the fit to the lines around it."""
    return _local_fits(frequency, H)[2]


def _local_fits(
    frequency: Array, H: ComplexArray, deviation: Array | None = None
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    n = len(frequency)
    start = np.clip(np.arange(n) - _WINDOW // 2, 0, n - _WINDOW)
    window = start[:, None] + np.arange(_WINDOW)
    x = frequency[window] - frequency[:, None]
    reach = np.max(np.abs(x), axis=1)
    x /= reach[:, None]
    size = np.maximum(np.max(np.abs(H[window]), axis=1), np.finfo(float).tiny)
    y = H[window] / size[:, None]
    # Σ a_i x^i − y Σ b_i x^i = y; weighted with the last 1/|1 + Σ b_i x^i| its error becomes that of y.
    powers = x[:, :, None] ** _POWERS
    columns = np.concatenate([powers, -y[:, :, None] * powers[:, :, 1:]], axis=2)
    others = (window != np.arange(n)[:, None]).astype(float)
    weight = others
    least = np.zeros(n) if deviation is None else _NOISE * deviation / size
    for sweep in range(_SWEEPS):
        left, length, right = np.linalg.svd(columns * weight[:, :, None], full_matrices=False)
        told = (left.conj().swapaxes(1, 2) @ (y * weight)[:, :, None])[:, :, 0]
        kept = (length > 1e-12 * length[:, :1]) & (np.maximum(length, np.abs(told)) > least[:, None])
        scaled = left.conj() * (kept / np.where(kept, length, 1.0))[:, None]
        inverse = right.conj().swapaxes(1, 2) @ scaled.swapaxes(1, 2)
        fit = (inverse @ (y * weight)[:, :, None])[:, :, 0]
        if sweep < _SWEEPS - 1:
            denominator = 1 + np.sum(powers[:, :, 1:] * fit[:, None, len(_POWERS) :], axis=2)
            weight = others / np.maximum(np.abs(denominator), _NEAREST_POLE)
    # At the line itself x = 0, so that the fit there is a_0 with the variance of that coefficient.
    spread = np.sum(np.abs(inverse[:, 0] * weight) ** 2, axis=1)
    smooth = fit[:, 0] * size
    slope = (fit[:, 1] - fit[:, 0] * fit[:, len(_POWERS)]) * size / reach
    return (H - smooth) / np.sqrt(1 + spread), smooth, slope


def _gathered(square: Array, size: Array) -> Array:
    """Deviation from squared errors (repeat, line), each an exponential variable.

    Noise of the motion at constant force is the same on all lines, noise of the force follows |H|; a record has one of
    them, or both, or what lies between.
    """
    largest = float(np.max(size))
    share = np.maximum(size / largest, _FLAT)

    def scored(shape: Array) -> tuple[float, Array]:
        variance = np.maximum(_running_median(square / shape) / np.log(2) * shape, (_ROUNDING * largest * share) ** 2)
        return float(np.sum(np.minimum(square / variance, _OUTLIER) + np.log(variance))), variance

    both = min((scored(share**2 + floor**2) for floor in _FLOORS), key=lambda found: found[0])
    best = scored(np.ones(len(share)))
    for found in (scored(share), scored(share**2), both):
        if found[0] < best[0] - _PREFERENCE:
            best = found
    return np.asarray(np.sqrt(best[1]))


def _running_median(rows: Array) -> Array:
    """Median over all rows of the lines around each line."""
    n = rows.shape[1]
    width = min(_GATHERED, n)
    medians = np.median(sliding_window_view(rows, width, axis=1), axis=(0, 2))
    return np.asarray(medians[np.clip(np.arange(n) - width // 2, 0, n - width)])
