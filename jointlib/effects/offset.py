"""A channel that does not read zero at zero."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Setting, Shape


class SensorOffset(Fault):
    """measured = true + offset: the mean alone, judged in the balance and the redundancy."""

    family: ClassVar[str] = "offset"
    words: ClassVar[str] = "that {site} does not read zero at zero (offset)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "offset": "Record with the drive off: each channel then shows its own offset.",
        "drift": "Record for longer: an offset stays what it was.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"offset"})
    parameters: ClassVar[Mapping[str, str]] = {"offset": "channel"}
    experiment: ClassVar[str] = "Record with the drive off, or measure the driving force too."

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        # Exactly on the mean; a transform of ones would leave rounding on the other lines.
        X = np.where(record.frequency == 0, len(record.time), 0).astype(complex)
        return record.on_channel(site, X)[None]

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return {"offset": float(coefficients[0])}

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        return {**channels, site: channels[site] - parameters["offset"]}
