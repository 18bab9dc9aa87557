"""Tops of amplitudes between points that lie close, from polynomials through 1/A², all motions side by side.

1/A² of a single mode is a parabola in ω², so that polynomials through a few of its points tell its top far better than
polynomials through the motion itself would.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..indices import Index, Mask
from .peaks import local_maxima

_WIDE, _NARROW = 7, 5
"""Points of the two polynomials whose difference tells the error."""
_GRID, _NEWTON = 33, 6
_STILL = 1e-9
"""Share of the largest motion at a frequency; what rises by less above the points around is rounding."""
_NOTHING = 1e-10
"""Share of the largest motion at a frequency that is itself rounding, as of contacts that a symmetry keeps still."""
_SURE, _PLACED = 1e-8, 1e-5
"""Relative differences of amplitude and frequency; what the wider polynomial leaves is far less."""
_BESIDE = 0.25
"""Of the spacing round a top that is not resolved yet: where further points are wanted."""
_FINEST = 1e-3
"""Of the half width at half power, a spacing at which a top is in doubt for rounding alone."""
_COINCIDE = 0.02
"""Of the widest spacing near by."""
_NEAR = 0.2
"""Of that spacing: points that lie closer tell the same."""


@dataclass(frozen=True, eq=False)
class Tops:
    """Maxima over frequency, one entry each."""

    motion: Index
    row: Index
    """The nearest point."""
    omega: Array
    """rad/s."""
    amplitude: Array
    """m."""
    width: Array
    """Half of the half-power width that the curvature there tells, rad/s; 0 where it tells none."""
    sure: Mask
    """Whether both polynomials agree."""

    def wanted(self, omega: Array) -> Array:
        """Frequencies in rad/s at which further points would tell more of the tops that are not sure."""
        gap = np.minimum(omega[self.row] - omega[self.row - 1], omega[self.row + 1] - omega[self.row])
        doubted = ~self.sure & (gap > _FINEST * self.width)
        gap = gap[doubted]
        new = (self.omega[doubted] + _BESIDE * gap * np.array([[-1.0], [0.0], [1.0]])).ravel()
        order = np.argsort(new)
        new, near = new[order], _NEAR * np.tile(gap, 3)[order]
        place = np.searchsorted(omega, new)
        apart = (new - omega[place - 1] > near) & (omega[place] - new > near)
        kept, last = list[float](), -np.inf
        for w, least in zip(new[apart].tolist(), near[apart].tolist(), strict=True):
            if w - last > least:
                kept.append(w)
                last = w
        return np.array(kept)


def tops(omega: Array, amplitude: Array, sure: float = _SURE, still: float = _STILL) -> Tops:
    """Tops of amplitudes (points, motions) in m over ascending frequencies (rad/s), in doubt by more than ``sure``;
    what rises by less than ``still`` of the largest motion, or is next to nothing of it, is rounding.
    """
    count = amplitude.shape[1]
    places = [local_maxima(amplitude[:, k]) for k in range(count)]
    motion = np.repeat(np.arange(count), [len(rows) for rows in places])
    row = np.concatenate([np.zeros(0, dtype=int), *places])
    near = np.clip(row[:, None] + np.arange(1, 3 * _WIDE) * np.array([[[-1]], [[1]]]), 0, max(len(omega) - 1, 0))
    lowest = np.min(amplitude[near, motion[:, None]], axis=2, initial=np.inf)
    rise = amplitude[row, motion] - np.max(lowest, axis=0, initial=0.0)
    largest = np.max(amplitude[row], axis=1, initial=0.0)
    moving = (rise > still * largest) & (amplitude[row, motion] > _NOTHING * largest)
    motion, row = motion[moving], row[moving]
    if not len(row) or len(omega) < _WIDE:
        return Tops(motion, row, omega[row], amplitude[row, motion], np.zeros(len(row)), np.zeros(len(row), dtype=bool))
    found = [_lowest(omega, amplitude, motion, row, count) for count in (_WIDE, _NARROW)]
    (at, size, width), (at_narrow, size_narrow, _) = found
    agreed = np.abs(size_narrow - size) <= sure * size
    agreed &= np.abs(at_narrow - at) <= _PLACED * at
    return Tops(motion, row, at, size, width, agreed)


def apart(omega: Array) -> Index:
    """Points without those that all but coincide with one before them, which tell of rounding alone, by their place."""
    gap = np.diff(omega)
    around = np.pad(gap, 2, mode="edge")
    wide = np.max(np.lib.stride_tricks.sliding_window_view(around, 5), axis=1) if len(gap) else gap
    return np.flatnonzero(np.concatenate([np.ones(len(omega[:1]), dtype=bool), gap > _COINCIDE * wide]))


def _lowest(omega: Array, amplitude: Array, motion: Index, row: Index, count: int) -> tuple[Array, Array, Array]:
    """Where the polynomial of 1/A² through so many points has its minimum between the neighbours of a row, the
    amplitude there, and the half width at half power."""
    begin = np.clip(row - count // 2, 0, len(omega) - count)
    window = begin[:, None] + np.arange(count)
    here = omega[row]
    reach = np.max(np.abs(omega[window] - here[:, None]), axis=1)
    x = (omega[window] - here[:, None]) / reach[:, None]
    nearest = np.argsort(np.abs(x), axis=1)
    x, window = np.take_along_axis(x, nearest, axis=1), np.take_along_axis(window, nearest, axis=1)
    own = amplitude[row, motion][:, None]
    c = (own / np.maximum(amplitude[window, motion[:, None]], _STILL * own)) ** 2
    for k in range(1, count):
        c[:, k:] = (c[:, k:] - c[:, k - 1 : -1]) / (x[:, k:] - x[:, :-k])
    low, high = ((omega[row + side] - here) / reach for side in (-1, 1))
    grid = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _GRID)
    at = grid[np.arange(len(row)), np.argmin(_value(x, c, grid)[0], axis=1)]
    for _ in range(_NEWTON):
        _, slope, bend = (part[:, 0] for part in _value(x, c, at[:, None]))
        at = np.clip(at - slope / np.where(bend > 0, bend, np.inf), low, high)
    least, _, bend = (part[:, 0] for part in _value(x, c, at[:, None]))
    least = np.maximum(least, 1e-300)
    width = reach * np.sqrt(2 * least / np.where(bend > 0, bend, np.inf))
    return here + at * reach, amplitude[row, motion] / np.sqrt(least), width


def _value(nodes: Array, c: Array, x: Array) -> tuple[Array, Array, Array]:
    """Polynomials with divided differences c on nodes (n, count) at x (n, places), and their two derivatives."""
    value, slope, half = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    for k in range(nodes.shape[1] - 1, -1, -1):
        aside = x - nodes[:, k, None]
        half = half * aside + slope
        slope = slope * aside + value
        value = value * aside + c[:, k, None]
    return value, slope, 2 * half
