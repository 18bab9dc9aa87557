"""Coefficients that explain the lines of several records: by mean forces, and by every line of the teeth.

Mean forces are linear in the coefficients. The harmonics are too, but for the angle at which each record began, which
nobody measures; it is fitted with them. By Parseval a fit of the lines is that of the force at every instant, without
what repeats with the revolution alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.cutting_force.cut import Cut
from jointlib.cutting_force.run_out import uneven
from jointlib.cutting_force.tooth_force import harmonics
from jointlib.errors import InputError

SCALE = np.array([1e9, 1e9, 1e9, 1e4, 1e4, 1e4])
"""N/m² and N/m, by which the six coefficients are of size 1."""
_ANGLES = 720
_DEFINED = 1e-8
_PER_RECORD = 0.5
"""rad; a start angle that the lines tell no better than this is no angle."""


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """Lines of one record: (orders, channels) of values in N and their E|error|²; ``axes`` says which force each is."""

    name: str
    cut: Cut
    axes: tuple[int, ...]
    value: ComplexArray
    variance: Array
    zero: Array
    """E|error|² of the zero of each channel in N², which all records share."""
    turn: ComplexArray | None = None
    """Lines of the revolution (orders, channels) in N, those between the teeth too; None where they were not read."""
    turn_variance: Array | None = None
    run_out: tuple[float, ...] = ()
    """m by which each flute stands out from the mean, where that is known."""

    def columns(self) -> ComplexArray:
        """What each coefficient gives to each line, (orders, channels, 6)."""
        order = np.arange(len(self.value), dtype=float)
        told = uneven(self.cut, self.cut.teeth * order, np.array(self.run_out)) if self.run_out else None
        return (harmonics(self.cut, order) if told is None else told)[:, list(self.axes)]


@dataclass(frozen=True, eq=False)
class CoefficientFit:
    """Coefficients of the told names and their covariance, SI; what is left of each record in N rms."""

    method: str
    known: tuple[int, ...]
    """Which of the six coefficients the channels tell."""
    value: Array
    covariance: Array
    left: tuple[float, ...]
    misfit: float
    """χ² over degrees of freedom; where it is above 1 the covariance has been raised by it."""
    freedom: int
    angles: tuple[float, ...] = ()
    """rad, of the teeth, at which each record began; of the revolution where there is a run-out."""
    run_out: tuple[float, ...] = ()
    """m by which each flute stands out from the mean, in the order in which they cut; empty where none was fitted."""
    run_out_error: tuple[float, ...] = ()


def by_means(records: Sequence[ForceRecord]) -> CoefficientFit:
    """A straight line through the mean forces over the feed, weighed by their scatter."""
    known = _known(records)
    columns, right, deviation = [], [], []
    for record in records:
        columns.append(record.columns()[0].real[:, known])
        right.append(record.value[0].real)
        deviation.append(floored(np.sqrt(record.variance[0])))
    A, y, s = np.concatenate(columns), np.concatenate(right), np.concatenate(deviation)
    scale = SCALE[known]
    value = _solved(A * scale / s[:, None], y / s, records) * scale
    rows = A * scale / s[:, None]
    left = [_left(one, known, value, 0.0, "average") for one in records]
    return told("average", known, rows, y / s - rows @ (value / scale), value, left, _zeros(records, "average"))


def by_lines(records: Sequence[ForceRecord], start: CoefficientFit) -> CoefficientFit | None:
    """All lines of the teeth at once, from the mean forces on; None where they tell no angle."""
    known, scale = list(start.known), SCALE[list(start.known)]
    columns = [record.columns()[:, :, known] * scale for record in records]
    weight = [1 / floored(np.sqrt(record.variance)) for record in records]
    known_about = start.value / scale
    turns = [_angle(*one, known_about) for one in zip(records, columns, weight, strict=True)]
    order = [np.arange(len(record.value))[:, None] for record in records]

    def left(x: Array) -> Array:
        parts = []
        for r, record in enumerate(records):
            model = columns[r] @ x[: len(known)] * np.exp(1j * order[r] * x[len(known) + r])
            parts.append(real((record.value - model) * weight[r]))
        return np.concatenate(parts)

    def slope(x: Array) -> Array:
        rows = []
        for r in range(len(records)):
            turned = np.exp(1j * order[r] * x[len(known) + r])
            part = np.zeros((*weight[r].shape, len(x)), dtype=complex)
            part[:, :, : len(known)] = -columns[r] * (turned * weight[r])[:, :, None]
            part[:, :, len(known) + r] = -1j * order[r] * (columns[r] @ x[: len(known)]) * turned * weight[r]
            rows.append(np.stack([real(part[:, :, i]) for i in range(len(x))], axis=1))
        return np.concatenate(rows)

    found = scipy.optimize.least_squares(left, np.concatenate([known_about, turns]), slope, method="lm")
    rows = np.asarray(found.jac, dtype=float)
    if len(found.fun) <= len(found.x) or np.linalg.matrix_rank(rows) < len(found.x):
        return None
    spread = np.linalg.inv(rows.T @ rows)
    if np.any(np.sqrt(np.diag(spread)[len(known) :]) > _PER_RECORD):
        return None
    value, angles = found.x[: len(known)] * scale, found.x[len(known) :]
    left_of = [_left(one, known, value, float(a), "") for one, a in zip(records, angles, strict=True)]
    fit = told("instantaneous", known, rows, found.fun, value, left_of, _zeros(records, ""))
    return replace(fit, angles=tuple(float(a) for a in angles))


def told(
    method: str,
    known: Sequence[int],
    rows: Array,
    rest: Array,
    value: Array,
    left: Sequence[float],
    zeros: Array,
) -> CoefficientFit:
    """The covariance, from whitened rows whose first columns are the coefficients, what is left in whitened ``rest``
    and what zeros that are off by their standard errors make of it."""
    n, scale = len(known), SCALE[list(known)]
    freedom = max(len(rest) - rows.shape[1], 0)
    misfit = float(np.sum(rest**2)) / freedom if freedom else 1.0
    inverse = np.linalg.inv(rows.T @ rows)
    of_zero = (inverse @ rows.T @ zeros)[:n]
    spread = (inverse[:n, :n] * max(misfit, 1.0) + of_zero @ of_zero.T) * np.outer(scale, scale)
    return CoefficientFit(method, tuple(known), value, spread, tuple(left), misfit, freedom)


def _zeros(records: Sequence[ForceRecord], method: str) -> Array:
    return zeros([record.variance if method != "average" else record.variance[:1] for record in records], records)


def zeros(variances: Sequence[Array], records: Sequence[ForceRecord]) -> Array:
    """What a zero that is off by its standard error makes of the whitened data, a column per axis."""
    columns = np.zeros((0, 3))
    for variance, record in zip(variances, records, strict=True):
        weight = 1 / floored(np.sqrt(variance))
        made = np.zeros((*weight.shape, 3), dtype=complex)
        for i, axis in enumerate(record.axes):
            made[0, i, axis] = weight[0, i] * np.sqrt(record.zero[i])
        columns = np.concatenate([columns, np.stack([real(made[:, :, k]) for k in range(3)], axis=1)])
    return columns


def _left(record: ForceRecord, known: list[int], value: Array, angle: float, method: str) -> float:
    """N rms that the coefficients leave of a record, over its channels; of the means alone where those were fitted."""
    order = np.arange(len(record.value))[:, None]
    rest = record.value - record.columns()[:, :, known] @ value * np.exp(1j * order * angle)
    power = np.abs(rest) ** 2 * np.where(order > 0, 2.0, 1.0)
    return float(np.sqrt(np.mean(np.sum(power[:1] if method == "average" else power, axis=0))))


def _known(records: Sequence[ForceRecord]) -> list[int]:
    """Coefficients that some record has a force of: in milling F_x or F_y tell both directions in the plane."""
    seen = np.sum([np.any(np.abs(record.columns()) > 0, axis=(0, 1)) for record in records], axis=0)
    return [int(k) for k in np.flatnonzero(seen)]


def _solved(rows: Array, right: Array, records: Sequence[ForceRecord]) -> Array:
    size = np.linalg.svd(rows / np.linalg.norm(rows, axis=0), compute_uv=False)
    if size[-1] < _DEFINED * size[0]:
        told = ", ".join(dict.fromkeys(f"{record.cut.mode} {record.cut.immersion:g}" for record in records))
        raise InputError(
            f"the mean forces do not tell all coefficients apart ({told}), expected Fx and Fy, or several immersions"
        )
    return np.asarray(np.linalg.lstsq(rows, right, rcond=None)[0])


def _angle(record: ForceRecord, columns: ComplexArray, weight: Array, value: Array) -> float:
    """The angle, of the teeth, at which the record began, as coefficients tell it that are nearly right."""
    tried = 2 * np.pi * np.arange(_ANGLES) / _ANGLES
    order = np.arange(len(record.value))
    match = np.sum(record.value * (columns @ value).conj() * weight**2, axis=1)
    return float(tried[np.argmax((np.exp(-1j * tried[:, None] * order) @ match).real)])


def real(lines: ComplexArray) -> Array:
    """Order 0 as it is; of the others real and imaginary part, each with half of the variance."""
    rest = np.sqrt(2) * lines[1:].ravel()
    return np.concatenate([lines[0].real, rest.real, rest.imag])


def floored(deviation: Array) -> Array:
    """Deviations, none of them smaller than a billionth of the largest, as of records without noise."""
    return np.maximum(deviation, max(1e-9 * float(np.max(deviation)), 1e-12))
