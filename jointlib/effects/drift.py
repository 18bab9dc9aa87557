"""A channel whose zero wanders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Setting, Shape


class SensorDrift(Fault):
    """measured = true + offset + slope·t + curvature·t², t from the first sample of each record.

    Judged in the balance and the redundancy, mostly below the excited band. Its first term is the offset of a sensor:
    a drift that is slow against the records is one.
    """

    family: ClassVar[str] = "drift"
    words: ClassVar[str] = "that the zero of {site} wanders (drift)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "drift": "Swap the inputs of the two channels: the drift goes with its sensor or stays with its input.",
        "offset": "Record for longer: an offset stays what it was.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"drift", "offset"})
    parameters: ClassVar[Mapping[str, str]] = {"offset": "channel", "slope": "channel/s", "curvature": "channel/s^2"}
    per_record: ClassVar[bool] = True
    experiment: ClassVar[str] = "Record with the drive off, or measure the driving force too."

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        powers = record.time ** [[0], [1], [2]]
        return record.on_channel(site, record.lines_of(powers))

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return dict(zip(self.parameters, map(float, coefficients), strict=True))

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        t = setting.time(len(channels[site]))
        error = parameters["offset"] + parameters["slope"] * t + parameters["curvature"] * t**2
        return {**channels, site: channels[site] - error}
