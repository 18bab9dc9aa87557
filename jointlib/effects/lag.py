"""A force that is recorded late."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.fault import shifted, slope_of
from jointlib.path_fault import PathFault, PathRecord, Shape


class ForceLag(PathFault):
    """measured(t) = F(t − lag): to first order −lag·dF/dt is added, exactly undone by a band-limited shift.

    The lag is that of the force behind the displacement; a negative one means that the force comes first.
    """

    family: ClassVar[str] = "lag"
    words: ClassVar[str] = "that the force comes late (lag)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "viscous-by-direction": "Repeat at two speeds: a lag shifts a reversal in time, friction does not.",
        "coulomb": "Repeat at two speeds: the loop that a lag opens grows with speed.",
        "hysteresis": "Repeat at two speeds: the loop that a lag opens grows with speed, that of slip does not.",
    }
    of_joint: ClassVar[str] = (
        "A joint that builds up its force so slowly shows the same: tap the force sensor beside an accelerometer, a "
        "channel is late there too."
    )
    parameters: ClassVar[Mapping[str, str]] = {"lag": "s"}

    def columns(self, record: PathRecord, shape: Shape) -> Array:
        return -slope_of(record.force)[None] / record.path.time_step

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"lag": float(coefficients[0])}

    def undo(self, force: Array, time: Array, position: Array, parameters: Mapping[str, float]) -> Array:
        rate = (len(time) - 1) / (time[-1] - time[0])
        return shifted(force, float(parameters["lag"] * rate), False)
