"""Refit the parameters of a joint to a weighted residual."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.joint import Covariance, Joint
from jointlib.parameter import parameters_of

_STEP = 1e-6
"""Finite difference relative to the scale of a parameter."""

_MOST_STEPS, _QUICK_STEPS = 40, 10

Residual = Callable[[Joint], Array]


def refit(
    joint: Joint, residual_of: Residual, free: Sequence[str], *, quick: bool = False, errors: bool = True
) -> tuple[Joint, float]:
    """Least squares over the parameters named in ``free``, within the bounds that the laws declare.

    ``residual_of(joint)`` is real and weighted to unit variance (stack real and imaginary parts). Returned are the
    joint with the covariance (JᵀJ)⁻¹·max(1, χ²) of those parameters, and χ² = Σr²/(n − p). Parameters that the
    joint declares fixed keep their value; a parameter pinned at a bound or without influence has no covariance.
    ``quick`` ends where a step gains less than a thousandth; without ``errors`` there is no covariance.
    """
    known = joint.parameters
    for name in free:
        if name not in known:
            raise InputError(f"joint {joint.name!r}: no parameter {name!r} to refit, {nearest(name, known)}")
    names = tuple(n for n in free if n not in joint.fixed)
    start = np.asarray(residual_of(joint), dtype=float)
    if not names:
        return replace(joint, covariance=None), float(start @ start / max(1, len(start)))
    scaled = Scaled(joint, names, _scales(joint, residual_of, names, start))
    problem = _Problem(scaled, residual_of)
    solved = scipy.optimize.least_squares(
        problem.residual,
        scaled.start,
        jac=problem.jacobian,
        bounds=scaled.bounds,
        xtol=1e-4 if quick else 1e-7,
        ftol=1e-3 if quick else 1e-9,
        gtol=1e-9,
        max_nfev=_QUICK_STEPS if quick else _MOST_STEPS,
    )
    fitted = scaled.at(solved.x)
    chi2 = float(2 * solved.cost / max(1, len(start) - len(names)))
    covariance = _covariance(problem, solved.x, max(1.0, chi2)) if errors else None
    return replace(fitted, covariance=covariance), chi2


def bounds_of(joint: Joint, names: Sequence[str]) -> tuple[Array, Array]:
    """Lower and upper bounds of parameters in SI; an open bound is moved inside by a billionth of the value."""
    lower, upper = [], []
    declared = {
        f"{part}.{p.name}": p
        for part, law in zip(joint.part_names, joint.laws, strict=True)
        for p in parameters_of(law)
    }
    for name in names:
        p = declared[name.split("[", 1)[0]]
        inside = p.above + 1e-9 * max(abs(joint.parameters[name]), 1e-12) if np.isfinite(p.above) else -np.inf
        lower.append(max(p.lower, inside))
        upper.append(p.upper)
    return np.array(lower), np.array(upper)


@dataclass(frozen=True)
class Scaled:
    """Parameters of a joint divided by their scales, within the bounds that the laws declare."""

    joint: Joint
    names: tuple[str, ...]
    scales: Array

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        return bounds_of(self.joint, self.names)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest, scaled."""
        lower, upper = self._bounds
        return lower / self.scales, upper / self.scales

    @property
    def start(self) -> Array:
        """Those of the joint, scaled."""
        known = self.joint.parameters
        return np.clip(np.array([known[n] for n in self.names]) / self.scales, *self.bounds)

    def at(self, x: Array) -> Joint:
        """The joint with scaled parameters."""
        values = np.clip(x * self.scales, *self._bounds)
        return self.joint.with_parameters(dict(zip(self.names, values.tolist(), strict=True)))


@dataclass(frozen=True)
class _Problem:
    """Least squares; an inadmissible combination has infinite residual."""

    scaled: Scaled
    residual_of: Residual

    def residual(self, x: Array) -> Array:
        try:
            return np.asarray(self.residual_of(self.scaled.at(x)), dtype=float)
        except InputError:
            return np.full(len(self.residual_of(self.scaled.joint)), np.inf)

    def jacobian(self, x: Array) -> Array:
        """Forward differences, backward where the forward step is inadmissible."""
        here = self.residual(x)
        columns = []
        for i in range(len(x)):
            column = np.zeros_like(here)
            for h in (_STEP * max(1.0, abs(x[i])), -_STEP * max(1.0, abs(x[i]))):
                moved = x.copy()
                moved[i] += h
                there = self.residual(moved)
                if np.all(np.isfinite(there)) and np.any(there != here):
                    column = (there - here) / h
                    break
            columns.append(column)
        return np.column_stack(columns)


def _scales(joint: Joint, residual_of: Residual, names: Sequence[str], start: Array) -> Array:
    """The size of each parameter; for one that is zero, the value that would change the residual by its own size."""
    scales = []
    size = max(float(np.linalg.norm(start)), 1e-300)
    for name in names:
        value = abs(joint.parameters[name])
        probe = 1e-12
        while value == 0:
            try:
                change = float(np.linalg.norm(residual_of(joint.with_parameters({name: probe})) - start))
            except InputError:
                change = 0.0
            if change > 1e-6 * size:
                value = probe * size / change
            elif probe > 1e24:
                value = 1.0
            probe *= 1e3
        scales.append(value)
    return np.array(scales)


def _covariance(problem: _Problem, x: Array, variance: float) -> Covariance | None:
    """Covariance of the parameters that are free at the solution."""
    lower, upper = problem.scaled.bounds
    J = problem.jacobian(x)
    size = np.linalg.norm(J, axis=0)
    gap = 1e-8 * np.maximum(1.0, np.abs(x))
    inside = (x - lower > gap) & (upper - x > gap) & (size > 1e-12 * max(float(size.max()), 1e-300))
    if not inside.any():
        return None
    J, size, scales = J[:, inside], size[inside], problem.scaled.scales[inside]
    unit = np.linalg.pinv((J / size).T @ (J / size), rcond=1e-14, hermitian=True)
    rescale = scales / size
    names = tuple(n for n, keep in zip(problem.scaled.names, inside, strict=True) if keep)
    return Covariance(names, variance * unit * np.outer(rescale, rescale))
