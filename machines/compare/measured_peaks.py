"""Resonances of a measured or computed frequency response, with standard errors where its noise is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray

from ..loop.noise.deviation import FEWEST, local_errors
from ..loop.records import LevelFRF

PROMINENT = np.log(np.sqrt(2.0))
"""By how much a peak of log|H| stands out of its surroundings: its half-power points belong to it."""
_NOISE = 8.0
"""Deviations by which it does so too: the largest of thousands of noisy lines and the smallest lie seven apart."""
_FEWEST = 5
_ONE_MODE = 0.05
"""How far 1/|H|² of one mode may be off its parabola, relative, root mean square: neighbours bend it."""
_DEVIATIONS = 2.0
"""Times its noise by which it may be off beside that."""
_NEAR = 0.1
"""Share of a frequency over which the parabola through the top of a mode may reach."""
_LOCAL = 9
"""Lines that the noise at a peak is read from, or its half-power width where that has more."""


@dataclass(frozen=True)
class Resonance:
    """A peak of |x/F| with standard errors; those of a computed curve are 0."""

    frequency: float
    """Hz."""
    damping_ratio: float
    """From the half-power width of the parabola through the top; nan where too few lines tell it, or several modes
    share the peak."""
    compliance: float
    """m/N."""
    frequency_error: float = 0.0
    damping_error: float = 0.0
    compliance_error: float = 0.0


def resonances(frequency: Array, receptance: ComplexArray, deviation: Array | None = None) -> tuple[Resonance, ...]:
    """Peaks that stand out of their surroundings by their half-power points, ascending in frequency.

    About its top 1/|H|² of a mode is a parabola, which is fitted to the lines above the half-power points, or to five
    where there are fewer; ``deviation`` (m/N) weighs them and gives the standard errors.
    """
    size = np.abs(receptance)
    tops, _ = scipy.signal.find_peaks(np.log(np.maximum(size, 1e-300)), prominence=PROMINENT)
    if deviation is not None:
        tops = tops[scipy.signal.peak_prominences(size, tops)[0] > _NOISE * deviation[tops]]
    return tuple(fitted(frequency, size, int(k), deviation) for k in tops)


def fitted(frequency: Array, size: Array, k: int, deviation: Array | None = None) -> Resonance:
    """The resonance of |x/F| (m/N) whose top is at the line k, see `resonances`."""
    low, high = _half_power(size, k)
    wide = high - low + 1 < _FEWEST
    low, high = (max(k - 2, 0), min(k + 2, len(size) - 1)) if wide else (low, high)
    enough = not wide or (frequency[high] - frequency[low] < _NEAR * frequency[k] and high - low + 1 == _FEWEST)
    part = slice(low, high + 1) if enough else slice(max(k - 1, 0), k + 2)
    f, H = frequency[part] - frequency[k], size[part]
    scale = float(np.max(np.abs(f)))
    noise = 1e-3 * np.max(H) / H if deviation is None else deviation[part] / H / np.sqrt(2)
    design = np.stack([np.ones(len(f)), f / scale, (f / scale) ** 2], axis=1)
    weights = 1 / (2 * noise * H**-2.0)
    norm = float(np.max(H)) ** 2
    p, *_ = np.linalg.lstsq(weights[:, None] * design, weights * H**-2.0, rcond=None)
    spread = np.linalg.pinv((weights[:, None] * design).T @ (weights[:, None] * design))

    def read(q: Array) -> Array:
        """Frequency in Hz, damping and compliance of a parabola."""
        at = -q[1] / (2 * q[2])
        lowest = q[0] - q[1] ** 2 / (4 * q[2])
        half, middle = scale * np.sqrt(abs(lowest / q[2])), frequency[k] + scale * at
        a, b = (middle - half) ** 2, (middle + half) ** 2
        return np.array([middle, np.sin(np.arctan((b - a) / (a + b)) / 2), abs(lowest) ** -0.5])

    if not (p[2] > 0 and p[0] - p[1] ** 2 / (4 * p[2]) > 0 and abs(p[1] / (2 * p[2])) <= 1):
        return Resonance(float(frequency[k]), np.nan, float(size[k]))
    value = read(p)
    step = 1e-6 / norm
    slope = np.stack([(read(p + step * e) - read(p - step * e)) / (2 * step) for e in np.eye(3)], axis=1)
    error = np.sqrt(np.diag(slope @ spread @ slope.T)) if deviation is not None else np.zeros(3)
    off = design @ p * H**2 - 1
    expected = 0.0 if deviation is None else float(np.mean((2 * noise) ** 2))
    alone = wide or np.mean(off**2) <= _ONE_MODE**2 + _DEVIATIONS**2 * expected
    damping = float(value[1]) if enough and alone else np.nan
    return Resonance(float(value[0]), damping, float(value[2]), *error.tolist())


def _half_power(size: Array, k: int) -> tuple[int, int]:
    """First and last line round a top that lie above its half-power points."""
    low = high = k
    while low > 0 and size[low - 1] > size[k] / np.sqrt(2):
        low -= 1
    while high < len(size) - 1 and size[high + 1] > size[k] / np.sqrt(2):
        high += 1
    return low, high


def at_the_peaks(frf: LevelFRF) -> Array:
    """The deviation of a record in m/N, raised round each peak to what the lines there tell.

    One that was gathered from neighbouring lines is that of sixty of them. Noise that grows with the response is larger
    at a peak than there, by half where noise is a share of it, and the errors of the peak would be as much too small.
    """
    out = frf.deviation.copy()
    if frf.deviation_from != "neighbours" or len(out) < FEWEST:
        return out
    missed, size = local_errors(frf.frequency, frf.receptance)[0], np.abs(frf.receptance)
    for k in scipy.signal.find_peaks(np.log(np.maximum(size, 1e-300)), prominence=PROMINENT)[0]:
        low, high = _half_power(size, int(k))
        reach = max(high - low + 1, _LOCAL) // 2
        part = slice(max(int(k) - reach, 0), int(k) + reach + 1)
        square = float(np.median(np.abs(missed[part]) ** 2 / frf.deviation[part] ** 2)) / np.log(2)
        out[part] = np.maximum(out[part], frf.deviation[part] * np.sqrt(square))
    return out
