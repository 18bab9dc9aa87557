"""The end of a spindle from one or several blanks with noise: line by line where a line tells, else with the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..indices import Mask
from .along_lines import smoothed
from .end_receptance import Hits, Information, bend, doubt_of, information, inverse, parts_of, symmetric, taken_off

TELLS = 0.15
"""Relative error of the interface up to which a line tells it by itself."""
_BY_ITSELF = 1e-6
"""The same up to which nothing is gained by the lines around, and the line is kept as it was measured."""
_POWER, _MOST = 4.0, 1e6
_REACH = 3.5
"""Deviations beyond which noise lies once in 200 000 lines."""
_ROUNDING = 1e-7
_FEWEST = 0.05
"""Share of the lines that begin, the surest, where fewer tell by themselves."""
_ROUNDS = 5
_AROUND = 2
"""Lines on either side over which the size of the curve is taken."""
_SIZES = np.logspace(-5, 1, 13) ** 2
"""Changes of slope from line to line over the size of the curve, squared, among which the likelihood chooses."""
_BEYOND = 10.0
"""Times its median size within which the end is believed to stay where nothing is told."""


@dataclass(frozen=True, eq=False)
class EstimatedEnd:
    """Receptance of the end of a spindle in one plane.

    Parameters
    ----------
    receptance
        S, (lines, 2, 2): deflection (m/N, 1/N) and rotation (1/N, 1/(N m)) by force and moment.
    variance
        E|error|² of its entries, same shape.
    doubt
        Relative error of the interface that the blanks feel, (lines,).
    weak
        Lines that do not tell the end by themselves: there the lines around them stand in for what is missing.
    """

    receptance: ComplexArray
    variance: Array
    doubt: Array
    weak: Mask


def estimated_end(frequency: Array, blanks: Sequence[Hits], length: float) -> EstimatedEnd:
    """S from the responses of one or several assemblies, each with a blank of its own, of which one tells all.

    A line that tells S to a millionth is kept as `taken_off` has it, and so is one that tells it well where the curve
    misses it. The others are estimated together: S is a smooth curve over frequency whose slope changes from line to
    line by a share of its size, which the likelihood chooses and which is raised where the curve misses more than
    noise. Each line enters by what it tells near the curve, less where it lies so far off that the linear form no
    longer holds. The variances are those of the curve, so they hold where a line tells nothing.

    Parameters
    ----------
    frequency
        Hz, (lines,).
    length
        m, that makes rotations and deflections of one size: about the length of the blanks.
    """
    leading = [hits for hits in blanks if hits.tells_all]
    if not leading:
        raise InputError("no blank tells the end by itself, expected one with two places hit and two sensed, not one")
    unit = np.array([1.0, 1 / length, 1 / length**2])
    first = [_first(hits, unit) for hits in leading]
    doubts = np.array([doubt for _, _, doubt in first])
    alone, best = np.min(doubts, axis=0), np.argmin(doubts, axis=0)
    raw = np.array([S for S, _, _ in first])[best, np.arange(len(frequency))]
    kept = (alone <= _BY_ITSELF) & (len(blanks) == 1)
    if np.all(kept):
        variance = np.maximum(np.einsum("laa->la", inverse(first[0][1].matrix)).real, 0.0) * unit**2
        return EstimatedEnd(raw, symmetric(variance + 0j).real, alone, np.zeros(len(frequency), dtype=bool))
    tells = [doubt <= max(TELLS, float(np.quantile(alone, _FEWEST))) for doubt in doubts]
    told = _sum(
        [
            information(hits, S, unit, _floor(hits)).where(sure.astype(float))
            for hits, (S, _, _), sure in zip(leading, first, tells, strict=True)
        ]
    )
    start = np.any(tells, axis=0)
    typical = np.median(np.abs(parts_of(raw[start]) / unit), axis=0)
    S, covariance = _together(frequency, blanks, told, typical, unit)
    own = inverse(_sum([information(hits, S, unit) for hits in blanks]).matrix)
    weak = doubt_of(blanks[0], S, own, unit) > TELLS
    # Where the curve misses what a line tells well, the line is right and the curve too smooth.
    kept |= (alone <= TELLS) & np.any([_misses(hits, S) for hits in blanks], axis=0)
    by_line = np.array([inverse(told.matrix) for _, told, _ in first])[best, np.arange(len(frequency))]
    S = np.where(kept[:, None, None], raw, S)
    covariance = np.where(kept[:, None, None], by_line, covariance)
    variance = np.maximum(np.einsum("laa->la", covariance).real, 0.0) * unit**2
    doubt = np.min([doubt_of(hits, S, covariance, unit) for hits in blanks], axis=0)
    return EstimatedEnd(S, symmetric(variance + 0j).real, doubt, weak)


def _first(hits: Hits, unit: Array) -> tuple[ComplexArray, Information, Array]:
    """S of one blank line by line, what it tells there, and the relative error of its interface."""
    S = taken_off(hits)
    told = information(hits, S, unit)
    return S, told, doubt_of(hits, S, inverse(told.matrix), unit)


def _together(
    frequency: Array, blanks: Sequence[Hits], told: Information, typical: Array, unit: Array
) -> tuple[ComplexArray, ComplexArray]:
    """S and the covariance of its parts in units of ``unit``, all lines at once."""
    steps = np.diff(frequency, prepend=frequency[0] - 1)
    steps[1:] /= np.mean(steps[1:])
    far = np.diag(1 / (_BEYOND * typical) ** 2) + 0j
    change = np.tile(typical**2, (len(frequency), 1))
    boost = np.ones((len(frequency), 1))
    S = np.zeros((len(frequency), 2, 2), dtype=complex)
    for _ in range(_ROUNDS):
        loose = Information(told.matrix + far, told.vector, told.constant)
        values, spread = smoothed(loose, change, _SIZES, steps)
        before, S = parts_of(S) / unit, symmetric(values * unit)
        doubts = [np.hypot(bend(hits, S, spread, unit), _floor(hits)) for hits in blanks]
        told = _sum([information(hits, S, unit, doubt) for hits, doubt in zip(blanks, doubts, strict=True)])
        boost = np.clip(boost * _misfit(blanks, S, spread, unit) ** _POWER, 1.0, _MOST)
        change = _mean_around(np.abs(values) ** 2) * boost
    # What the last round still moved is no noise, but an error all the same.
    moved = _mean_around(np.abs(values - before) ** 2)
    return S, spread + moved[:, :, None] * np.eye(3)


def _misfit(blanks: Sequence[Hits], S: ComplexArray, spread: ComplexArray, unit: Array) -> Array:
    """Squared residuals around each line over what the noise leaves of them beside the curve, (lines, 1)."""
    off, left = np.zeros(len(S)), np.zeros(len(S))
    for hits in blanks:
        off += np.sum(np.abs(hits.assembly - hits.coupled(S)) ** 2 / (hits.deviation**2 + _floor(hits) ** 2), axis=0)
        told = information(hits, S, unit, _floor(hits)).matrix
        left += np.maximum(len(hits.free) - np.einsum("lij,lji->l", told, spread).real, 0.0)
    each = _mean_around(np.stack([off, left, left], axis=1))
    return np.asarray((each[:, :1] + 1) / (each[:, 1:2] + 1))


def _misses(hits: Hits, S: ComplexArray) -> Mask:
    """Lines on which a response lies further from its coupled value than noise reaches."""
    return np.asarray(np.any(np.abs(hits.assembly - hits.coupled(S)) > _REACH * hits.deviation, axis=0))


def _floor(hits: Hits) -> Array:
    """Deviation in m/N below which no response is believed here, so that the equations stay regular."""
    return np.asarray(_ROUNDING * np.abs(hits.assembly))


def _sum(told: Sequence[Information]) -> Information:
    whole = told[0]
    for more in told[1:]:
        whole = whole + more
    return whole


def _mean_around(values: Array) -> Array:
    """Means over the lines around each, (lines, 3)."""
    window = min(_AROUND, len(values) - 1)
    padded = np.pad(values, ((window, window), (0, 0)), "edge")
    return np.asarray(sliding_window_view(padded, 2 * window + 1, axis=0).mean(axis=-1))
