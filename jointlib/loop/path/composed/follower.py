"""Parameters of the joint that follow an input: a voltage, a temperature, a preload, a place, a speed or time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.preparation import Run
from jointlib.modulation import Modulation, factors_of, lags_of, stepped
from jointlib.parameter import Role, parameters_of

_POINTS = (2.0, 5.0)
"""Of the tables that are tried; two are a straight line."""
ROLES = (Role.STIFFNESS, Role.DAMPING, Role.SLIP_FORCE, Role.PRELOAD)


@dataclass(frozen=True)
class Follower(AlongInput):
    """All parameters of one role times a factor φ(u) of an input u, in a straight line or by a monotone table.

    f(z, ż; θ φ(u)) with φ = 1 at the median of u. Its coefficients are the factors less 1 at the points of the table
    other than that of the reference; for a straight line the rise of the factor over the range of the input.
    """

    role: Role
    condition: str
    """What the input is in :data:`jointlib.modulation.CONDITIONS`."""
    quantiles: tuple[float, ...]
    """The input at 0, 25, 50, 75 and 100 % of the samples, SI."""

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
        return f"that the {self.role.value} follows the {self.condition}"

    def shapes(self, scale: object, joint: Joint) -> tuple[Mapping[str, float], ...]:
        """Nothing where the joint has no such parameter, or it follows that input already."""
        has = any(
            p.role is self.role and np.any(np.asarray(getattr(law, p.name)))
            for law in joint.laws
            for p in parameters_of(law)
        )
        known = any((m.role, m.condition) == (self.role, self.condition) for m in joint.modulations)
        at_once = len(set(self.quantiles)) == len(self.quantiles)
        return tuple({"points": n} for n in _POINTS if n == 2 or at_once) if has and not known else ()

    def start(self, points: float, joint: Joint) -> Modulation:
        """The modulation with factor 1 throughout, as late as what follows the input already."""
        at = self.quantiles if points > 2 else (self.quantiles[0], self.quantiles[-1])
        lag = lags_of(joint.modulations).get(self.condition, 0.0)
        return Modulation(self.role, self.condition, self.quantiles[2], tuple((u, 1.0) for u in at), lag=lag)

    def along(self, evidence: Evidence, shape: Mapping[str, float], joint: Joint) -> Array:
        return evidence.follower_columns(joint, self.start(shape["points"], joint))

    def sizes(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> dict[str, float]:
        moved = stepped(self.start(shape["points"], joint), coefficients)
        return {} if moved is None else factors_of(moved)

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        moved = stepped(self.start(shape["points"], joint), coefficients)
        return None if moved is None else replace(joint, modulations=(*joint.modulations, moved), covariance=None)


def followers(runs: Sequence[Run]) -> tuple[Follower, ...]:
    """Every role of parameters by every input that moves."""
    out = []
    for condition in runs[0].inputs:
        u = np.concatenate([run.inputs[condition][run.keep] for run in runs])
        at = tuple(np.quantile(u, (0, 0.25, 0.5, 0.75, 1)).tolist())
        if at[-1] > at[0]:
            out += [Follower(role, condition, at) for role in ROLES]
    return tuple(out)
