"""Parameters that follow an input late: a magnet, a valve or a heated part takes its time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.preparation import Run
from jointlib.modulation import lag_name

_LONGEST = 0.1
"""Of the longest record: what follows later than that is hardly told from what does not follow."""
_RATIO = 3.0


@dataclass(frozen=True)
class InputLag(AlongInput):
    """The parameters follow v with lag · v̇ + v = u instead of the input u itself.

    To first order the coefficient is the lag in s, round the lag of a grid that fits best. Only where the input changes
    does it show; a force that is recorded late is late wherever the motion turns.
    """

    condition: str
    """What the input is in :data:`jointlib.modulation.CONDITIONS`."""
    lags: tuple[float, ...]
    """That are tried, s."""

    family: ClassVar[str] = "input-lag"
    unit: ClassVar[str] = "s"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "lag": "Hold the input still and move: a late force is late there too, a lag of the input does not show.",
        "relaxation": "Hold the input still and move at several frequencies: there a lag of the input does not show.",
    }

    @property
    def member(self) -> str:  # type: ignore[override]
        return f"by {self.condition}"

    @property
    def words(self) -> str:  # type: ignore[override]
        return f"that what follows the {self.condition} follows it late (input-lag)"

    def shapes(self, scale: object, joint: Joint) -> tuple[Mapping[str, float], ...]:
        """Nothing where no parameter follows the input, or follows it late already."""
        own = [m for m in joint.modulations if m.condition == self.condition]
        return tuple({"lag": lag} for lag in self.lags) if own and not any(m.lag for m in own) else ()

    def along(self, evidence: Evidence, shape: Mapping[str, float], joint: Joint) -> Array:
        return evidence.lag_column(joint, self.condition, shape["lag"])

    def sizes(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> dict[str, float]:
        return {lag_name(self.condition): float(coefficients[0])}

    def apply(self, coefficients: Array, shape: Mapping[str, float], joint: Joint) -> Joint | None:
        lag = float(coefficients[0])
        return joint.lagging(self.condition, lag) if lag > 0 else None


def input_lags(runs: Sequence[Run]) -> tuple[InputLag, ...]:
    """One for every input that moves, from a sample to a tenth of the longest record."""
    step, most = runs[0].path.time_step, _LONGEST * max(len(run.force) * run.path.time_step for run in runs)
    count = max(1, int(np.log(most / step) / np.log(_RATIO)) + 1)
    lags = tuple((step * _RATIO ** np.arange(count)).tolist())
    return tuple(InputLag(c, lags) for c in runs[0].inputs if any(np.ptp(run.inputs[c]) > 0 for run in runs))
