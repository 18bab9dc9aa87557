"""Inputs of a record that parameters may follow: a temperature, a voltage, a place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.answer.following import followed
from jointlib.measurement import Measurement, Record
from jointlib.modulation import CONDITION_OF, Modulation, acting, hats, names_of, scaled
from jointlib.parameter import Role

_STANDS = 0.02
"""Of the range of an input over all records: one that moves less along a record is held there."""
_PIECES = 4
"""Of a period, each so short that the mean of an input tells it in its middle."""
_EVEN = 1e-12
"""A factor that changes less along a record stands still."""
_LEAST = 1e-6
"""The least factor that a slope over its logarithm is told from."""
_LEVELS = 5
"""Of the factor of a parameter along a record, between which forces go in straight lines."""


@dataclass(frozen=True)
class Inputs:
    """What is known of the inputs along one record, and where a joint that follows them stands."""

    along: Mapping[str, Array] = field(default_factory=dict)
    """By condition, SI, without noise: (samples,), or (1,) for an input that stands still."""
    time_step: float = 1.0
    """s."""

    def active(self, modulations: Sequence[Modulation]) -> tuple[Modulation, ...]:
        """Those whose input this record has; the others stay at their reference, and what repeats with an input is
        fitted to each record by itself."""
        return tuple(m for m in modulations if m.condition in self.along and m.period is None)

    def reached(self, law: JointLaw, modulations: Sequence[Modulation]) -> list[tuple[Array, JointLaw]]:
        """The law at the factors that its parameters reach, each with its weight along the record.

        Of parameters that stand still one law and the weight 1; the law itself where none of them follows an input.
        """
        out: list[tuple[Array, JointLaw]] = [(np.ones(1), law)]
        for role, factor in self._factors(acting(law, self.active(modulations))).items():
            if np.ptp(factor) <= _EVEN:
                levels, weights = factor[:1], np.ones((1, 1))
            else:
                levels = np.linspace(factor.min(), factor.max(), _LEVELS)
                weights = np.array([np.interp(factor, levels, one) for one in np.eye(_LEVELS)])
            out = [
                (w * weight, scaled(there, [(role, np.asarray(level))]))
                for w, there in out
                for weight, level in zip(weights, levels, strict=True)
            ]
        return out

    def at(self, joint: Joint) -> Joint:
        """The joint at the mean inputs of this record."""
        active = self.active(joint.modulations)
        if not active:
            return joint
        return replace(joint, modulations=active).at({n: float(np.mean(u)) for n, u in self.along.items()})

    def held(self, ranges: Mapping[str, tuple[float, float]]) -> Inputs:
        """With the mean of each input that hardly moves along the record beside its range over all records."""

        def mean_or_all(condition: str, u: Array) -> Array:
            low, high = ranges.get(condition, (0.0, 0.0))
            return np.array([u.mean()]) if np.ptp(u) <= _STANDS * (high - low) else u

        return replace(self, along={n: mean_or_all(n, u) for n, u in self.along.items() if n in ranges})

    def moves(self, m: Modulation) -> Array:
        """(∂φ/∂c)/φ of each coefficient of a modulation along the record, (coefficient, samples or 1)."""
        if m.condition not in self.along:
            return np.zeros((len(names_of(m)), 1))
        course = m.followed(self.along[m.condition], self.time_step)
        return hats(m, course) / np.maximum(m.along(course), _LEAST)

    def _factors(self, modulations: Sequence[Modulation]) -> dict[Role, Array]:
        factors: dict[Role, Array] = {}
        for m in modulations:
            factor = m.along(m.followed(self.along[m.condition], self.time_step))
            factors[m.role] = factors.get(m.role, np.ones(1)) * factor
        return factors


NO_INPUTS = Inputs()


def inputs_of(measurement: Measurement, record: Record, steady: slice, period: int) -> Inputs:
    """The inputs along the steady part of a record, without what is faster than a period of the excitation."""
    along: dict[str, Array] = {}
    for c in followed(measurement):
        along.setdefault(CONDITION_OF[c.quantity], _smooth(record.channels[c.name][steady], period))
    return Inputs(along, 1 / record.sample_rate)


def _smooth(u: Array, period: int) -> Array:
    """A curve through the means of a few pieces of each period."""
    count = max(2, _PIECES * len(u) // period)
    ends = np.linspace(0, len(u), count + 1).astype(int)
    means = np.add.reduceat(u, ends[:-1]) / np.diff(ends)
    curve = scipy.interpolate.CubicSpline(0.5 * (ends[:-1] + ends[1:] - 1), means)
    return np.asarray(curve(np.arange(len(u))))


def ranges_of(records: Sequence[Inputs]) -> dict[str, tuple[float, float]]:
    """Lowest and highest of each input over several records that have it."""
    names = [n for n in (records[0].along if records else {}) if all(n in r.along for r in records)]
    lows, highs = ({n: f(float(f(r.along[n])) for r in records) for n in names} for f in (min, max))
    return {n: (lows[n], highs[n]) for n in names}
