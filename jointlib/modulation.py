"""A modulation: what time, place, temperature or preload make of the parameters of one role."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.law import JointLaw
from jointlib.parameter import Role, parameters_of

CONDITIONS: Mapping[str, str] = {
    "time": "s",
    "position": "m",
    "temperature": "K",
    "preload": "N",
    "voltage": "V",
    "current": "A",
    "speed": "m/s",
    "spindle-speed": "rpm",
}
"""What a factor can depend on, in SI; the speed of a spindle in rpm."""

_ALIKE = ("voltage", "current", "temperature", "position", "time")
CONDITION_OF = {**{quantity: quantity for quantity in _ALIKE}, "force": "preload", "velocity": "speed"}
"""What an input of a record is, by the quantity of its channel."""

INPUTS = ("voltage", "current", "temperature")
"""Of these, what a channel measures that is neither force nor motion: parameters may follow it."""

_ROUNDING = 1e-9
_BELOW_ZERO = -0.15
"""A factor that a fit puts below this is not physical; between here and zero it counts as zero."""
_BENT = 0.1
"""Of the span of the factors, by which a fitted table may miss being monotone."""
_TINY = 1e-6
"""Of a parameter that may not be zero: what it is where its factor is zero."""


@dataclass(frozen=True)
class Modulation:
    """Every parameter of a role is its value at the reference times a factor, linear between the points of a table.

    Outside the table the factor stays what it is at its end; :meth:`covers` tells. A table that repeats, as that of
    balls passing, gives a ``period`` and covers everything.
    """

    role: Role
    condition: str
    """"time" (s), "position" (m), "temperature" (K), "preload" (N), "voltage" (V), "current" (A), "speed" of
    a feed (m/s) or "spindle-speed" (rpm)."""
    reference: float
    """Value of the condition, in SI, at which the parameters are those of the joint; the factor is 1 there."""
    table: tuple[tuple[float, float], ...]
    """Pairs of condition and factor, the condition rising."""
    period: float | None = None
    """After so much of the condition the table begins again."""
    lag: float = 0.0
    """s: the parameters follow v with lag · v̇ + v = condition, as a magnet follows its voltage; at rest v is that."""

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
        if not 0 <= self.lag < np.inf:
            raise InputError(f"{what}: lag is {self.lag:g}, expected at least 0")
        if self.period is not None:
            self._check_period(what, self.period, float(values[-1] - values[0]))
        at_reference = float(self._drawn(np.asarray(self.reference)))
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
        return float(self.along(np.asarray(value)))

    def along(self, values: Array) -> Array:
        """The factor at each of several values of the condition (SI); 1 to the last digit at the reference."""
        return np.where(values == self.reference, 1.0, self._drawn(values))

    def _drawn(self, values: Array) -> Array:
        """What the table says."""
        x, y = np.array(self.points, dtype=float).T
        at = values if self.period is None else x[0] + (values - x[0]) % self.period
        return np.asarray(np.interp(at, x, y))

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """The table, and where it repeats its first point once more, a period later."""
        if self.period is None or self.table[-1][0] >= self.table[0][0] + self.period:
            return self.table
        return (*self.table, (self.table[0][0] + self.period, self.table[0][1]))

    def followed(self, values: Array, time_step: float) -> Array:
        """What the parameters follow of a condition that is sampled every ``time_step`` s: itself, or with its lag."""
        return lagged(values, self.lag, time_step)

    def based(self, value: float) -> Modulation:
        """The same, with another value of the condition as its reference, at which the factor is not 0."""
        here = self.factor(value)
        if not here > 0:
            raise InputError(
                f"modulation of {self.role.value} by {self.condition}: the factor at {value:g} is 0, expected above 0"
            )
        return replace(self, reference=value, table=tuple((x, factor / here) for x, factor in self.table))

    def covers(self, value: float) -> bool:
        """True where the table tells the factor instead of its nearest end."""
        return self.period is not None or self.table[0][0] <= value <= self.table[-1][0]


def held(u: float, behind: float, lag: float, time_step: float) -> float:
    """v of lag · v̇ + v = u after ``time_step`` s at a held u, which began at ``behind``."""
    return behind - float(np.expm1(-time_step / lag)) * (u - behind)


def lagged(u: Array, lag: float, time_step: float) -> Array:
    """v of lag · v̇ + v = u for a u that runs in straight lines between its samples, from v = u at the first."""
    if not lag > 0:
        return u
    steps = time_step / lag
    left = float(np.exp(-steps))
    mean = -float(np.expm1(-steps)) / steps
    first = np.array([u[0] - (1 - mean) * u[0]])
    return np.asarray(scipy.signal.lfilter([1 - mean, mean - left], [1.0, -left], u, zi=first)[0])


def hats(m: Modulation, u: Array) -> Array:
    """∂φ/∂(coefficient) of a modulation along values of its condition, (coefficient, value).

    The coefficients are the factors at the points of the table other than that of the reference; of a table with two
    points, the rise of the factor from the first to the last.
    """
    at = np.array([point for point, _ in m.table])
    clipped = np.clip(u, at[0], at[-1])
    if len(at) == 2:
        return np.asarray((clipped - m.reference)[None] / (at[1] - at[0]))
    free = [i for i, point in enumerate(at) if point != m.reference]
    return np.array([np.interp(clipped, at, np.eye(len(at))[i]) for i in free])


def names_of(m: Modulation) -> tuple[str, ...]:
    """Of the coefficients of a modulation: ``slip_force_by_voltage``, of a table with the number of the point."""
    name = f"{m.role.value.replace(' ', '_')}_by_{m.condition}"
    if len(m.table) == 2:
        return (name,)
    return tuple(f"{name}[{i}]" for i, (point, _) in enumerate(m.table) if point != m.reference)


def factors_of(m: Modulation) -> dict[str, float]:
    """What the coefficients of a modulation are: factors less 1, or the rise of a straight line."""
    if len(m.table) == 2:
        return dict(zip(names_of(m), [m.table[1][1] - m.table[0][1]], strict=True))
    return dict(zip(names_of(m), [f - 1 for point, f in m.table if point != m.reference], strict=True))


def lags_of(modulations: Iterable[Modulation]) -> dict[str, float]:
    """The lag behind every condition that has one, s; it is the same for all that follow that condition."""
    return {m.condition: m.lag for m in modulations if m.lag}


def lag_name(condition: str) -> str:
    """Of the lag behind a condition: ``lag_behind_voltage``."""
    return f"lag_behind_{condition.replace('-', '_')}"


def is_fitted(m: Modulation) -> bool:
    """Whether a fit may move its factors: those of a straight line, or of a table that has the reference as a point."""
    return m.period is None and (len(m.table) == 2 or any(point == m.reference for point, _ in m.table))


def stepped(m: Modulation, step: Array) -> Modulation | None:
    """The modulation with its coefficients moved; None where a factor would be negative or the table turn back.

    A small overshoot below zero or back is taken for noise and cut off; the factor at the reference stays 1.
    """
    at, factors = (np.array(x) for x in zip(*m.table, strict=True))
    if len(at) == 2:
        slope = (at - m.reference) / (at[1] - at[0])
        moved = factors + float(step[0]) * slope
        if not moved.min() >= _BELOW_ZERO:
            return None
        even = 1 + (moved - 1) * min(1.0, 1.0 / max(1.0 - moved.min(), 1e-300))
    else:
        middle = int(np.flatnonzero(at == m.reference)[0])
        moved = factors + np.insert(step, middle, 0.0)
        rise = np.sign(moved[-1] - moved[0]) * (moved - 1)
        up, down = np.maximum.accumulate(rise[middle:]), np.minimum.accumulate(rise[middle::-1])[::-1]
        even = np.maximum(1 + np.sign(moved[-1] - moved[0]) * np.concatenate([down[:-1], up]), 0.0)
        if not (
            moved.min() >= _BELOW_ZERO and np.max(np.abs(even - moved)) <= max(_BENT * np.ptp(moved), -_BELOW_ZERO)
        ):
            return None
    return replace(m, table=tuple(zip(at.tolist(), even.tolist(), strict=True)))


def acting(law: JointLaw, modulations: Iterable[Modulation]) -> tuple[Modulation, ...]:
    """Those by which a parameter of the law moves."""
    roles = {p.role for p in parameters_of(law)}
    return tuple(m for m in modulations if m.role in roles)


def scaled(law: JointLaw, factors: Sequence[tuple[Role, Array]]) -> JointLaw:
    """A law with the parameters of some roles times factors, which may be arrays."""
    moved: dict[str, Any] = {}
    for p in parameters_of(law):
        for role, factor in factors:
            if p.role is role and not p.table:
                known = np.asarray(moved.get(p.name, getattr(law, p.name)))
                bare = p.above + _TINY * float(np.max(np.abs(known))) if np.isfinite(p.above) else -np.inf
                if p.listed and known.ndim == 1:  # Each entry by itself.
                    known = known.reshape(-1, *(1,) * factor.ndim)
                new = np.maximum(known * factor, max(p.lower, bare))
                moved[p.name] = tuple(new) if p.listed else new if np.ndim(new) else float(new)
    return replace(law, **moved) if moved else law  # type: ignore[type-var]
