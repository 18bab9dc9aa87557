"""Coefficients and run-out together, from every line of the revolution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray, Mask
from jointlib.cutting_force.fit import SCALE, CoefficientFit, ForceRecord, floored, real, told, zeros
from jointlib.cutting_force.run_out import by_offset, uneven

_STANDS_OUT = 6.0
"""Deviations of its scatter from which on a line between those of the teeth is heard."""
_EXPLAINED = 0.25
"""Share of the χ² between the lines of the teeth that a run-out leaves at most."""
_STEP = 1e-4
_MICROMETRE = 1e-6
_MOST_TEETH = 16


def beside_teeth(record: ForceRecord) -> Mask:
    """Which lines of the revolution stand between those of the teeth."""
    assert record.turn is not None
    return np.asarray(np.arange(len(record.turn)) % record.cut.teeth != 0, dtype=bool)


def repeats(record: ForceRecord) -> bool:
    """Whether the force repeats with the revolution but not from tooth to tooth."""
    if record.turn is None or record.turn_variance is None:
        return False
    beside = beside_teeth(record)
    return bool(np.any(np.abs(record.turn[beside]) > _STANDS_OUT * np.sqrt(record.turn_variance[beside])))


def unlike(records: Sequence[ForceRecord]) -> float:
    """N rms of what repeats with the revolution but not from tooth to tooth, the mean of the channels' squares."""
    power = [np.mean(2 * np.sum(np.abs(r.turn[beside_teeth(r)]) ** 2, axis=0)) for r in records if r.turn is not None]
    return float(np.sqrt(np.mean(power))) if power else 0.0


def with_run_out(records: Sequence[ForceRecord], start: CoefficientFit) -> CoefficientFit | None:
    """Coefficients, run-out and angles that explain all lines of the revolution, from a fit to those of the teeth on.

    None where no line between those of the teeth is heard, or where run-out does not explain them.
    """
    teeth = records[0].cut.teeth
    if not 2 <= teeth <= _MOST_TEETH or any(r.cut.teeth != teeth for r in records):
        return None
    if not any(repeats(record) for record in records):
        return None
    fit = _Fit(records, start)
    offsets = fit.first_offsets()
    x = np.concatenate([start.value / fit.scale, offsets, fit.first_angles(offsets)])
    before = fit.left(np.concatenate([start.value / fit.scale, 0 * offsets, x[fit.n + teeth - 1 :]]))
    found = scipy.optimize.least_squares(fit.left, x, fit.slope, method="lm", max_nfev=60)
    rows = np.asarray(found.jac, dtype=float)
    if len(found.fun) <= len(found.x) or np.linalg.matrix_rank(rows) < len(found.x):
        return None
    beside = fit.beside()
    left, had = (np.array([np.sum(part[at] ** 2) for at in (beside, ~beside)]) for part in (found.fun, before))
    if left[0] > _EXPLAINED * had[0] or left[1] > max(1.2 * had[1], 2.0 * np.sum(~beside)):
        return None
    value = found.x[: fit.n] * fit.scale
    made = told("instantaneous", start.known, rows, found.fun, value, fit.rms(found.x), fit.zeros())
    spread = np.linalg.inv(rows.T @ rows)[fit.n : fit.n + teeth - 1, fit.n : fit.n + teeth - 1]
    error = np.sqrt(np.diag(fit.basis @ spread @ fit.basis.T) * max(made.misfit, 1.0)) * _MICROMETRE
    out = fit.basis @ found.x[fit.n : fit.n + teeth - 1] * _MICROMETRE
    angles = found.x[fit.n + teeth - 1 :]
    return replace(
        made,
        angles=tuple(float(a) for a in angles),
        run_out=tuple(float(r) for r in out),
        run_out_error=tuple(float(e) for e in error),
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """Residuals over x: coefficients by their scales, run-out in µm on a basis of zero sum, angles in rad."""

    records: Sequence[ForceRecord]
    start: CoefficientFit

    @property
    def known(self) -> list[int]:
        return list(self.start.known)

    @property
    def scale(self) -> Array:
        return np.asarray(SCALE[self.known])

    @property
    def n(self) -> int:
        return len(self.start.known)

    @property
    def teeth(self) -> int:
        return self.records[0].cut.teeth

    @cached_property
    def basis(self) -> Array:
        return np.asarray(np.linalg.svd(np.eye(self.teeth) - 1 / self.teeth)[0][:, : self.teeth - 1])

    @cached_property
    def value(self) -> list[ComplexArray]:
        return [np.asarray(r.turn) for r in self.records]

    @cached_property
    def variance(self) -> list[Array]:
        return [np.asarray(r.turn_variance) for r in self.records]

    @cached_property
    def weight(self) -> list[Array]:
        return [1 / floored(np.sqrt(variance)) for variance in self.variance]

    @cached_property
    def order(self) -> list[Array]:
        return [np.arange(len(value), dtype=float) for value in self.value]

    def columns(self, r: int, offsets: Array) -> ComplexArray:
        """Of one record, (orders, channels, coefficients), by their scales."""
        made = uneven(self.records[r].cut, self.order[r], self.basis @ offsets * _MICROMETRE)
        return np.asarray(made[:, list(self.records[r].axes)][:, :, self.known] * self.scale)

    def parts(self, x: Array) -> tuple[Array, Array, Array]:
        return x[: self.n], x[self.n : self.n + self.teeth - 1], x[self.n + self.teeth - 1 :]

    def left(self, x: Array) -> Array:
        """Whitened, of all records."""
        K, offsets, angles = self.parts(x)
        return np.concatenate([self._rest(r, self.columns(r, offsets) @ K, a) for r, a in enumerate(angles)])

    def _rest(self, r: int, model: ComplexArray, angle: float) -> Array:
        turned = np.exp(1j * self.order[r] * angle)[:, None]
        return real((self.value[r] - model * turned) * self.weight[r])

    def slope(self, x: Array) -> Array:
        """Straight in the coefficients, by differences in the offsets."""
        K, offsets, angles = self.parts(x)
        steps = np.eye(self.teeth - 1) * _STEP
        rows = []
        for r, angle in enumerate(angles):
            turned = (np.exp(1j * self.order[r] * angle)[:, None]) * self.weight[r]
            columns = self.columns(r, offsets)
            made = np.zeros((*turned.shape, len(x)), dtype=complex)
            made[:, :, : self.n] = -columns * turned[:, :, None]
            for i, step in enumerate(steps):
                apart = (self.columns(r, offsets + step) - self.columns(r, offsets - step)) @ K
                made[:, :, self.n + i] = -apart / (2 * _STEP) * turned
            made[:, :, self.n + self.teeth - 1 + r] = -1j * self.order[r][:, None] * (columns @ K) * turned
            rows.append(np.stack([real(made[:, :, i]) for i in range(len(x))], axis=1))
        return np.concatenate(rows)

    def first_offsets(self) -> Array:
        """µm, from the record of the largest feed, as if no chip ended for the run-out."""
        r = self._largest()
        record, beside = self.records[r], beside_teeth(self.records[r])
        K = np.zeros(3)
        for k, value in zip(self.known, self.start.value, strict=True):
            if k < 3:
                K[k] = value
        thicker = by_offset(record.cut, self.order[r])[:, list(record.axes)] @ K
        against = (np.eye(self.teeth) - np.roll(np.eye(self.teeth), -1, axis=1)) @ self.basis
        turned = np.exp(1j * self.order[r] * self.start.angles[r] / self.teeth)[:, None, None]
        rows = (thicker @ against * turned * self.weight[r][:, :, None])[beside]
        right = (self.value[r] * self.weight[r])[beside].ravel()
        flat = rows.reshape(-1, self.teeth - 1)
        solved = np.linalg.lstsq(np.concatenate([flat.real, flat.imag]), np.concatenate([right.real, right.imag]))[0]
        return np.asarray(solved / _MICROMETRE)

    def first_angles(self, offsets: Array) -> Array:
        """rad of the revolution: which flute was at the angle that the lines of the teeth tell."""
        K, angles = self.start.value / self.scale, []
        for r, of_teeth in enumerate(self.start.angles):
            model = self.columns(r, offsets) @ K
            tried = (of_teeth + 2 * np.pi * np.arange(self.teeth)) / self.teeth
            tried = tried[:1] if r == self._largest() else tried
            angles.append(min(tried, key=lambda a: float(np.sum(self._rest(r, model, float(a)) ** 2))))
        return np.array(angles)

    def _largest(self) -> int:
        return int(np.argmax([record.cut.feed for record in self.records]))

    def beside(self) -> Mask:
        """Which residuals belong to lines between those of the teeth."""
        marks = [np.repeat(beside_teeth(r)[:, None], len(r.axes), axis=1) for r in self.records]
        return np.concatenate([real(mark.astype(complex) * (1 + 1j)) != 0 for mark in marks])

    def rms(self, x: Array) -> list[float]:
        """N that is left of each record."""
        K, offsets, angles = self.parts(x)
        found = []
        for r, angle in enumerate(angles):
            rest = self.value[r] - self.columns(r, offsets) @ K * np.exp(1j * self.order[r] * angle)[:, None]
            power = np.abs(rest) ** 2 * np.where(self.order[r] > 0, 2.0, 1.0)[:, None]
            found.append(float(np.sqrt(np.mean(np.sum(power, axis=0)))))
        return found

    def zeros(self) -> Array:
        """What zeros that are off by their standard errors make of the residuals."""
        return zeros(self.variance, self.records)
