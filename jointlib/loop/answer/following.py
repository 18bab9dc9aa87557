"""Parameters of the joint that follow an input: a voltage, a temperature, a preload, a place, a speed or time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.joint import Joint
from jointlib.loop.answer.report import Estimate
from jointlib.measurement import Channel, Measurement
from jointlib.modulation import CONDITION_OF, CONDITIONS, INPUTS, Modulation, factors_of, lags_of, names_of, stepped
from jointlib.parameter import Role, parameters_of
from jointlib.units import with_error

STRAIGHT = 2.0
"""Points of a table that is a straight line."""
_APART = 0.03
"""Of the range of an input: points of a table that are nearer are one level of it, and its noise."""
FOLLOWING = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE, Role.PRELOAD)
"""Roles whose parameters may follow an input."""


@dataclass(frozen=True)
class Following(JointEffect):
    """All parameters of one role times a factor φ(u) of an input u, in a straight line or by a monotone table.

    f(z, ż; θ φ(u)) with φ = 1 at the median of u. Its coefficients are the factors less 1 at the points of the table
    other than that of the reference; for a straight line the rise of the factor over the range of the input.
    """

    role: Role
    condition: str
    """What the input is in :data:`jointlib.modulation.CONDITIONS`."""
    points: tuple[float, ...]
    """Of the table: the input at 0, 25, 50, 75 and 100 % of the samples, SI; one for each of its levels."""
    reference: float
    """The median of the input."""

    family: ClassVar[str] = "modulation"
    unit: ClassVar[str] = "1"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "modulation": "Hold each input still in turn: what a parameter follows moves it alone."
    }

    @property
    def member(self) -> str:  # type: ignore[override]
        return f"{self.role.value.replace(' ', '-')} by {self.condition}"

    @property
    def words(self) -> str:  # type: ignore[override]
        return following_in_words(self.member)

    def shapes(self, scale: object, joint: Joint) -> tuple[Mapping[str, float], ...]:
        """Nothing where the joint has no such parameter, or it follows that input already."""
        has = any(
            p.role is self.role and np.any(np.asarray(getattr(law, p.name)))
            for law in joint.laws
            for p in parameters_of(law)
        )
        known = any((m.role, m.condition) == (self.role, self.condition) for m in joint.modulations)
        counts = sorted({STRAIGHT, float(len(self.points))})
        return tuple({"points": n} for n in counts) if has and not known else ()

    def size_of(self, joint: Joint) -> float:
        """Sum of the parameters of the role in a joint, which the factors multiply; each in its SI unit."""
        own = [
            np.abs(np.asarray(getattr(law, p.name))).sum()
            for law in joint.laws
            for p in parameters_of(law)
            if p.role is self.role
        ]
        return float(sum(own))

    def start(self, points: float, joint: Joint) -> Modulation:
        """The modulation with factor 1 throughout, as late as what follows the input already."""
        at = self.points if points > STRAIGHT else (self.points[0], self.points[-1])
        lag = lags_of(joint.modulations).get(self.condition, 0.0)
        return Modulation(self.role, self.condition, self.reference, tuple((u, 1.0) for u in at), lag=lag)

    def columns(self, path: Path, shape: Mapping[str, float], joint: Joint) -> Array:
        raise NotImplementedError("columns need the input beside the path")

    def sizes(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> dict[str, float]:
        """Its parameters in a joint that lacks it, by name: factors less 1."""
        moved = stepped(self.start(shape["points"], joint), coefficients)
        return {} if moved is None else factors_of(moved)

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        moved = stepped(self.start(shape["points"], joint), coefficients)
        return None if moved is None else replace(joint, modulations=(*joint.modulations, moved), covariance=None)


def followed(measurement: Measurement) -> tuple[Channel, ...]:
    """The channels that parameters may follow."""
    return tuple(c for c in measurement.channels if c.is_input and c.quantity in CONDITION_OF)


def unfollowed(channels: Sequence[Channel]) -> list[str]:
    """Voltages, currents and temperatures that nothing says parameters may follow."""
    told = "takes no part; with input = true in its [[channel]] parameters may follow it."
    idle = [c for c in channels if c.quantity in INPUTS and not c.is_input]
    return [f"Channel {c.name} ({c.quantity}) {told}" for c in idle]


def points_of(along: Sequence[Array]) -> tuple[tuple[float, ...], float] | None:
    """Points of a table over an input along several records, its quartiles, and its median; None where it is the same
    throughout."""
    at = np.quantile(np.concatenate(along), (0, 0.25, 0.5, 0.75, 1))
    return (_apart(at, at[2]), float(at[2])) if at[-1] > at[0] else None


def levels_of(values: Sequence[float]) -> tuple[tuple[float, ...], float] | None:
    """The same of a few values at which an input stood still: a point for each, as no record tells what is between."""
    at = np.sort(values)
    middle = at[len(at) // 2]
    return (_apart(at, middle), float(middle)) if at[-1] > at[0] else None


def _apart(at: Array, middle: float) -> tuple[float, ...]:
    """Rising values with one for those that lie close together: the middle one or their mean."""
    ends = np.flatnonzero(np.diff(at) > _APART * (at[-1] - at[0])) + 1
    return tuple(float(middle if middle in level else np.mean(level)) for level in np.split(at, ends))


def following_in_words(member: str) -> str:
    """The effect in a sentence that begins "The joint lacks", from its member."""
    role, condition = member.split(" by ")
    return f"that the {role.replace('-', ' ')} follows the {condition}"


def changes_in_words(parameters: Mapping[str, Estimate], joint: Joint) -> str | None:
    """What a modulation of a joint makes of its parameters at each value of the input, with 95 % intervals.

    None where these are not the parameters of one of its modulations.
    """
    for m in joint.modulations:
        if parameters.keys() == set(names_of(m)):
            unit = CONDITIONS[m.condition]
            sizes = [100.0 * parameters[n].value for n in names_of(m)]
            errors = [100.0 * 1.96 * parameters[n].standard_error for n in names_of(m)]
            span = m.table[-1][0] - m.table[0][0]
            at = [f"{_rounded(point, span):.5g}" for point, _ in m.table]
            beside = f"of that at {_rounded(m.reference, span):.5g} {unit}"
            shares = [with_error(v, e, "%") for v, e in zip(sizes, errors, strict=True)]
            if len(m.table) == 2:
                return f"{shares[0]} from {at[0]} to {at[1]} {unit}, {beside}"
            places = [place for place, (point, _) in zip(at, m.table, strict=True) if point != m.reference]
            listed = ", ".join(f"{s} at {place} {unit}" for s, place in zip(shares, places, strict=True))
            return f"{listed}, {beside}"
    return None


def _rounded(value: float, span: float) -> float:
    """A value of an input to a ten-thousandth of the range that it had."""
    return round(value, 4 - math.floor(math.log10(span))) + 0.0 if span > 0 else value
