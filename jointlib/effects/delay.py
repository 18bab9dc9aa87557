"""A channel that comes late."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Setting, Shape, shifted

_LONGEST = 1e-3
"""s; filters and converters delay one channel against another by microseconds, at worst by a few samples."""


class ChannelDelay(Fault):
    """measured(t) = true(t − delay); a negative delay means that the other channels come late.

    To the first order the error is −delay·jω times the channel. Undone by the exact shift.
    """

    family: ClassVar[str] = "delay"
    words: ClassVar[str] = "that {site} comes early or late (delay)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "structural-damping": "Keep the driving force in the test and swap the cables of two channels.",
        "rocking-mode": "Widen the band beyond the resonance, or measure at a second lever arm.",
        "delay": "Swap the cables of the two channels: a delay goes with its cable or stays with its input.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"delay": "s"}
    experiment: ClassVar[str] = (
        "Measure the driving force too: the joint's damping hides a delay, the balance does not."
    )

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        return record.on_channel(site, 1j * record.omega * record.masked(site))[None]

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        delay = -float(coefficients[0])
        return {"delay": delay} if abs(delay) <= _LONGEST else None

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        advance = parameters["delay"] * setting.sample_rate
        return {**channels, site: shifted(channels[site], advance, setting.periodic)}
