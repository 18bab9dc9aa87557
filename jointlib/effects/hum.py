"""The mains in a channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Setting, Shape

_MAINS = (50.0, 60.0)
_WANDERS = 0.5
"""Hz by which the mains may stray."""


class MainsHum(Fault):
    """measured = true + cosine·cos ωt + sine·sin ωt + the same at 3ω, ω near that of the mains.

    t counts from the first sample of each record, which has a phase of its own.
    """

    family: ClassVar[str] = "hum"
    words: ClassVar[str] = "the mains in {site} (hum)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "hum": "Swap the inputs of the two channels: the hum goes with its sensor or stays with its input.",
    }
    declared_pairs: ClassVar[frozenset[str]] = frozenset({"hum"})
    parameters: ClassVar[Mapping[str, str]] = {
        "frequency": "Hz",
        "cosine": "channel",
        "sine": "channel",
        "cosine3": "channel",
        "sine3": "channel",
    }
    shape_parameters: ClassVar[frozenset[str]] = frozenset({"frequency"})
    per_record: ClassVar[bool] = True
    experiment: ClassVar[str] = "Record with the drive off, or measure the driving force too."

    def shapes(self, records: Sequence[RigRecord], site: str) -> tuple[Shape, ...]:
        """Around 50 and 60 Hz, in steps of a quarter of what the longest record resolves, 41 for each at most."""
        longest = max(float(np.ptp(r.time)) for r in records)
        beside = min(20, int(np.ceil(4 * _WANDERS * longest)))
        strays = np.linspace(-_WANDERS, _WANDERS, 2 * beside + 1)
        return tuple({"frequency": float(f)} for mains in _MAINS for f in mains + strays)

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        return record.on_channel(site, record.lines_of(_waves(record.time, shape["frequency"])))

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        if not min(_MAINS) - 2 < shape["frequency"] < max(_MAINS) + 2:
            return None
        return dict(zip(self.parameters, (shape["frequency"], *map(float, coefficients)), strict=True))

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        x = channels[site]
        waves = _waves(setting.time(len(x)), parameters["frequency"])
        strength = np.array([parameters[name] for name in ("cosine", "sine", "cosine3", "sine3")])
        return {**channels, site: x - strength @ waves}


def _waves(time: Array, frequency: float) -> Array:
    angle = 2 * np.pi * frequency * time
    return np.stack([np.cos(angle), np.sin(angle), np.cos(3 * angle), np.sin(3 * angle)])
