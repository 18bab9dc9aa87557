"""Parameters of the joint that follow an input of the records, in a contest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.fault import Shape
from jointlib.loop.answer.following import FOLLOWING, Following, levels_of, points_of
from jointlib.loop.answer.report import Estimate
from jointlib.loop.balance.tangents import followed_slopes
from jointlib.loop.contest.contestant import InJoint, bare
from jointlib.loop.contest.fitted import Fitted, columns_of, fit
from jointlib.loop.contest.trial import Trial, trial

_WORTH = 10.0
"""Times ln n, by which a table must lower the loss of a straight line."""
_MANY = 8
"""Records with an input that stands still: a table over fewer has a point for each, over more five quartiles."""


@dataclass(frozen=True)
class OnInput(InJoint):
    """A role of parameters that follows one input; each pair competes by itself."""

    joint_effect: Following

    @property
    def label(self) -> str:
        return f"{self.effect.family} {self.site}"

    @property
    def site(self) -> str:
        return self.joint_effect.member

    def trials(self, fitted: Fitted, shapes: Sequence[Shape]) -> list[Trial]:
        found = [trial(fitted.model, s, self.block(fitted, s), joint_only=False) for s in shapes]
        return [t for t in found if t is not None]

    def block(self, fitted: Fitted, shape: Shape) -> Array:
        m = self.joint_effect.start(shape["points"], fitted.joint)
        joint = replace(fitted.joint, modulations=(*fitted.joint.modulations, m))
        return columns_of(fitted.records, followed_slopes(fitted.records, joint, m))

    def shapes(self, fitted: Fitted) -> tuple[Shape, ...]:
        """A straight line competes; it becomes a table in :meth:`grown` where that fits better."""
        return self.joint_effect.shapes(None, fitted.joint)[:1]

    def grown(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Fitted | None:
        effect = self.joint_effect
        mended = effect.apply(coefficients, shape, fitted.joint)
        if mended is None:
            return None
        straight = fit(fitted.raws, mended, fitted.free, fitted.found)
        if len(effect.shapes(None, fitted.joint)) == 1:
            return straight
        at = mended.modulations[-1]
        table = effect.start(float(len(effect.points)), fitted.joint)
        bent = replace(table, table=tuple((u, at.factor(u)) for u, _ in table.table))
        joint = replace(straight.joint, modulations=(*straight.joint.modulations[:-1], bent))
        curved = fit(fitted.raws, joint, fitted.free, fitted.found)
        return curved if curved.size < straight.size - _WORTH * np.log(curved.model.entries) else straight

    def parameters(self, coefficients: Array, shape: Shape, fitted: Fitted) -> Mapping[str, Estimate]:
        sizes = self.joint_effect.sizes(coefficients, shape, fitted.joint)
        return {n: bare(v, self.joint_effect.unit) for n, v in sizes.items()}


def on_inputs(fitted: Fitted) -> tuple[OnInput, ...]:
    """Every role of parameters by every input that all records have and that is not the same throughout."""
    raws, out = fitted.raws, list[OnInput]()
    for condition in raws[0].inputs.along:
        along = [r.inputs.along[condition] for r in raws]
        if all(len(u) == 1 for u in along) and len(raws) < _MANY:
            at = levels_of([float(u[0]) for u in along])
        else:
            at = points_of([np.broadcast_to(u, r.spectra.samples) for u, r in zip(along, raws, strict=True)])
        if at is not None:
            out += [OnInput(Following(role, condition, *at)) for role in FOLLOWING]
    return tuple(out)
