"""Parameters of the joint that follow an input along a path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.answer.following import FOLLOWING, Following, points_of
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.preparation import Run


@dataclass(frozen=True)
class Follower(Following, AlongInput):
    """:class:`Following` of an input that is recorded along the path."""

    def along(self, evidence: Evidence, shape: Mapping[str, float], joint: Joint) -> Array:
        return evidence.follower_columns(joint, self.start(shape["points"], joint))


def followers(runs: Sequence[Run]) -> tuple[Follower, ...]:
    """Every role of parameters by every input that moves."""
    out = []
    for condition in runs[0].inputs:
        at = points_of([run.inputs[condition][run.keep] for run in runs])
        if at is not None:
            out += [Follower(role, condition, *at) for role in FOLLOWING]
    return tuple(out)
