"""A modulation: what time, place, temperature or preload make of the parameters of one role."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from jointlib.errors import InputError, nearest
from jointlib.parameter import Role

CONDITIONS: Mapping[str, str] = {"time": "s", "position": "m", "temperature": "K", "preload": "N"}
"""What a factor can depend on, in SI."""

_ROUNDING = 1e-9


@dataclass(frozen=True)
class Modulation:
    """Every parameter of a role is its value at the reference times a factor, linear between the points of a table.

    Outside the table the factor stays what it is at its end; :meth:`covers` tells. A table that repeats, as that of
    balls passing, gives a ``period`` and covers everything.
    """

    role: Role
    condition: str
    """"time" (s), "position" (m), "temperature" (K) or "preload" (N)."""
    reference: float
    """Value of the condition, in SI, at which the parameters are those of the joint; the factor is 1 there."""
    table: tuple[tuple[float, float], ...]
    """Pairs of condition and factor, the condition rising."""
    period: float | None = None
    """After so much of the condition the table begins again."""

    def __post_init__(self) -> None:
        what = f"modulation of {self.role.value} by {self.condition}"
        if self.condition not in CONDITIONS:
            raise InputError(f"modulation: condition is {self.condition!r}, {nearest(self.condition, CONDITIONS)}")
        values, factors = np.array(self.table, dtype=float).reshape(-1, 2).T
        if not len(values):
            raise InputError(f"{what}: the table is empty, expected rows of condition and factor")
        if not np.all(np.isfinite([*values, *factors, self.reference])):
            raise InputError(f"{what}: a value is not finite, expected finite ones")
        if np.any(np.diff(values) <= 0):
            row = int(np.argmax(np.diff(values) <= 0)) + 1
            raise InputError(f"{what}: row {row} of the table is not above the one before, expected rising conditions")
        if np.any(factors < 0):
            raise InputError(f"{what}: a factor is {float(factors.min()):g}, expected at least 0")
        if self.period is not None:
            self._check_period(what, self.period, float(values[-1] - values[0]))
        at_reference = self.factor(self.reference)
        if abs(at_reference - 1) > _ROUNDING:
            raise InputError(f"{what}: the factor at the reference is {at_reference:g}, expected 1")

    def _check_period(self, what: str, period: float, span: float) -> None:
        if not 0 < period < np.inf:
            raise InputError(f"{what}: period is {period:g}, expected more than 0")
        if span > period * (1 + _ROUNDING):
            raise InputError(f"{what}: the table spans {span:g}, expected at most the period of {period:g}")
        jump = self.table[-1][1] - self.table[0][1]
        if span >= period * (1 - _ROUNDING) and abs(jump) > _ROUNDING:
            raise InputError(f"{what}: the factor jumps by {jump:g} after a period, expected the table to close")

    def factor(self, value: float) -> float:
        """What the parameters of the role are multiplied by at a value of the condition (SI)."""
        x, y = np.array(self.table, dtype=float).T
        if self.period is None:
            return float(np.interp(value, x, y))
        value = x[0] + (value - x[0]) % self.period
        return float(np.interp(value, [*x, x[0] + self.period], [*y, y[0]]))

    def covers(self, value: float) -> bool:
        """True where the table tells the factor instead of its nearest end."""
        return self.period is not None or self.table[0][0] <= value <= self.table[-1][0]
