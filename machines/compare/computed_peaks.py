"""Maxima of a receptance that can be computed at every frequency, and which of another one each has become."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import Outcome

from ..forced_response.tool_peaks import half_power_damping
from ..indices import Index, Mask
from ..operating.peaks import local_maxima, maxima
from .measured_peaks import PROMINENT, Resonance, fitted

_ALONE = np.log(1.5)
"""Further apart in frequency two peaks are not the same."""
_SIZE = 0.05
"""What the logarithm of a ratio of compliances counts beside that of frequencies."""


@dataclass(frozen=True)
class Top:
    """A maximum of |x/F|."""

    resonance: Resonance
    stands_out: bool
    """By its half-power points; another is only what one that does has become."""


def tops_of(size: Callable[[Array], Array], lines: Array) -> tuple[Top, ...]:
    """Maxima of |x/F| in m/N, solved for between ``lines`` (Hz) on which every mode leaves a trace, ascending.

    The damping is that of the half-power width, and is told where one mode alone makes the peak.
    """
    values = size(lines)
    frequency, height = _solved(size, lines, values, local_maxima(values))
    fine, first = np.unique(np.concatenate([frequency, lines]), return_index=True)
    drawn = np.concatenate([height, values])[first]
    found = []
    for k in np.searchsorted(fine, frequency).tolist():
        rise = scipy.signal.peak_prominences(np.log(np.maximum(drawn, 1e-300)), [k])[0][0]
        f, c, alone = float(fine[k]), float(drawn[k]), np.isfinite(fitted(fine, drawn, k).damping_ratio)
        damping = half_power_damping(fine, drawn, k, f, c) if alone else np.nan
        found.append(Top(Resonance(f, damping, c), bool(rise >= PROMINENT)))
    return tuple(found)


def _solved(size: Callable[[Array], Array], lines: Array, values: Array, rows: Index) -> tuple[Array, Array]:
    """Frequency and height of the tops at some rows; those of the line itself where no top is found beside it."""
    if not len(rows):
        return np.zeros(0), np.zeros(0)

    def motion(searches: Index, omega: Array) -> tuple[Array, Mask]:
        return size(omega.ravel() / (2 * np.pi)).reshape(omega.shape), np.ones(len(searches), dtype=bool)

    low, high = lines[rows - 1], lines[rows + 1]
    half = np.pi * (high - low)
    band = (2 * np.pi * float(lines[0]), 2 * np.pi * float(lines[-1]))
    omega, height, _, outcomes = maxima(motion, 2 * np.pi * lines[rows], half, band)
    at = omega / (2 * np.pi)
    fine = np.array([outcome is Outcome.CONVERGED for outcome in outcomes]) & (low < at) & (at < high)
    return np.where(fine, at, lines[rows]), np.where(fine, height, values[rows])


def matched(first: Sequence[Top], other: Sequence[Top]) -> tuple[tuple[Resonance | None, Resonance | None], ...]:
    """Each peak that stands out on one side with the maximum of the other that it has become, in their order.

    Of all ways to pair two rows without a crossing it is that of the least sum of what pairs are apart, where a peak
    left alone counts half as much as the largest distance of two that are the same. One that stands out nowhere is not
    told, but may be what one that does has become: a peak and a shoulder are no peak and nothing.
    """
    a, b = ([top.resonance for top in tops] for tops in (first, other))
    cost = np.full((len(a) + 1, len(b) + 1), 0.0)
    cost[:, 0], cost[0] = _ALONE / 2 * np.arange(len(a) + 1), _ALONE / 2 * np.arange(len(b) + 1)
    apart = np.array([[_apart(x, y) for y in b] for x in a]).reshape(len(a), len(b))
    for i in range(len(a)):
        for j in range(len(b)):
            alone = min(cost[i, j + 1], cost[i + 1, j]) + _ALONE / 2
            cost[i + 1, j + 1] = min(cost[i, j] + apart[i, j], alone)
    pairs: list[tuple[int | None, int | None]] = []
    i, j = len(a), len(b)
    while i or j:
        if i and j and cost[i, j] == cost[i - 1, j - 1] + apart[i - 1, j - 1]:
            i, j = i - 1, j - 1
            pairs.append((i, j))
        elif i and cost[i, j] == cost[i - 1, j] + _ALONE / 2:
            i -= 1
            pairs.append((i, None))
        else:
            j -= 1
            pairs.append((None, j))
    return tuple(
        (None if i is None else a[i], None if j is None else b[j])
        for i, j in reversed(pairs)
        if (i is not None and first[i].stands_out) or (j is not None and other[j].stands_out)
    )


def _apart(a: Resonance, b: Resonance) -> float:
    """How far two peaks are from being one and the same."""
    far = abs(np.log(b.frequency / a.frequency))
    return float(far + _SIZE * abs(np.log(b.compliance / a.compliance))) if far < _ALONE else np.inf
