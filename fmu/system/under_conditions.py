"""A joint stepped while its conditions change: the rule that its FMU follows too."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.modulation import held, lags_of

Conditions = Mapping[str, float]


@dataclass(frozen=True)
class UnderConditions:
    """f(z, ż, state; θ φ(v)) of a joint whose conditions are held over a step, with v behind them by their lags.

    A step is one of the joint as it is at the end of it, from the state before: what remembers stays where it is while
    parameters change, and then follows the laws with the new ones.
    """

    joint: Joint

    def begun(self, conditions: Conditions) -> dict[str, float]:
        """What lags behind a condition, at rest: the condition itself."""
        return {name: float(conditions[name]) for name in lags_of(self.joint.modulations)}

    def step(
        self, motion: Motion, conditions: Conditions, state: Array, behind: Conditions
    ) -> tuple[Array, Array, dict[str, float]]:
        """Force in N at the end of the step, the new state, and what then lags behind the conditions (SI)."""
        lags = lags_of(self.joint.modulations)
        after = {name: held(conditions[name], v, lags[name], float(motion.duration)) for name, v in behind.items()}
        joint = self.joint.at({**conditions, **after}) if self.joint.modulations else self.joint
        return *joint.step(motion, state), after


def extremes(joint: Joint) -> tuple[Joint, ...]:
    """The joint with the least and the largest factors that its modulations can have together, one by one.

    Refused where a law refuses its parameters there.
    """
    at: dict[str, list[float]] = {}
    for m in joint.modulations:
        points = sorted(m.table, key=lambda point: point[1])
        at.setdefault(m.condition, []).extend(point for point, _ in (points[0], points[-1]))
    found = []
    for values in product(*map(np.unique, at.values())):
        conditions = {name: float(x) for name, x in zip(at, values, strict=True)}
        try:
            found.append(joint.at(conditions))
        except InputError as error:
            where = ", ".join(f"{name} {x:g}" for name, x in conditions.items())
            raise InputError(f"joint {joint.name!r}: at {where}: {error}") from None
    return tuple(found)
