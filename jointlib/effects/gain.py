"""A sensor that reads too much or too little."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Setting, Shape


class SensorGain(Fault):
    """measured = (1 + gain)·true.

    The error is gain/(1 + gain) of what was measured, so the column is the measured channel itself. Of four gains on
    a rig only three ratios show; common to all channels, a gain scales every force alike.
    """

    family: ClassVar[str] = "gain"
    words: ClassVar[str] = "that {site} reads too much or too little (gain)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "missing-mass": "Weigh the bodies, or bolt on a known mass, and excite an octave or more.",
        "rocking-mode": "Widen the band beyond the resonance, or measure at a second lever arm.",
        "gain": "Calibrate the sensors back to back: these records show ratios of gains alone.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"gain": "1"}
    experiment: ClassVar[str] = "Measure the driving force too: no joint law can hide a gain in the balance of forces."

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        return record.on_channel(site, record.masked(site))[None]

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        share = float(coefficients[0])
        return {"gain": share / (1 - share)} if share < 1 else None

    def combined(self, known: Mapping[str, float], further: Mapping[str, float]) -> Mapping[str, float]:
        return {"gain": (1 + known["gain"]) * (1 + further["gain"]) - 1}

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        return {**channels, site: channels[site] / (1 + parameters["gain"])}
