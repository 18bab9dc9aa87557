"""A channel that runs into its limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Setting, Shape

_FRACTIONS = 1 - np.geomspace(0.02, 0.5, 10)
_NEARLY = 0.999


class Clipping(Fault):
    """measured = clip(true, ±level).

    The true signal is not taken from the clipped channel but predicted from the others, through the redundancy or the
    balance; the error clip(x̂) − x̂ must then be there in full.
    """

    family: ClassVar[str] = "clipping"
    words: ClassVar[str] = "that {site} is cut off at its limits (clipping)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "contact-loss": "Repeat the top level with a wider input range: a lost contact stays.",
        "sensor-nonlinearity": "Repeat the top level with a wider input range, and the levels below it as they are.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"level": "channel"}
    shape_parameters: ClassVar[frozenset[str]] = frozenset({"level"})
    experiment: ClassVar[str] = "Measure the driving force too, and run the top level twice with a wider input range."

    def shapes(self, records: Sequence[RigRecord], site: str) -> tuple[Shape, ...]:
        """Levels between a half and nearly all of the largest value that the other channels predict."""
        peaks = [float(np.max(np.abs(x))) for x in (r.predicted(site) for r in records) if x is not None]
        top = max(peaks, default=0.0)
        return tuple({"level": float(c)} for c in top * _FRACTIONS) if top > 0 else ()

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        x = record.predicted(site)
        if x is None:
            return np.zeros((1, len(record.frequency), 3), dtype=complex)
        X = record.lines_of(np.clip(x, -shape["level"], shape["level"]) - x)
        return record.on_channel(site, X)[None]

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        whole = 0.5 <= float(coefficients[0]) <= 1.5 and shape["level"] > 0
        return {"level": shape["level"]} if whole else None

    def undo(
        self, channels: Mapping[str, Array], site: str, parameters: Mapping[str, float], setting: Setting
    ) -> Mapping[str, Array]:
        """Samples at the level, or predicted beyond it, take the value that the other channels predict."""
        x, other = channels[site], _predicted(channels, site, setting.masses)
        cut = np.maximum(np.abs(x), np.abs(other)) >= _NEARLY * parameters["level"]
        return {**channels, site: np.where(cut, other, x)}


def _predicted(channels: Mapping[str, Array], site: str, masses: Mapping[str, float]) -> Array:
    """A channel from a2 = a3, else from P = Σ m a."""
    twin = {"a2": "a3", "a3": "a2"}.get(site, "")
    if twin in channels:
        return channels[twin]
    weights = {"P": 1.0, **{a: -m for a, m in masses.items()}}
    if not {"P", "a1", "a2", site} <= weights.keys() or not weights.keys() <= channels.keys():
        raise InputError(
            f"correction clipping: nothing measured predicts {site}, expected a2 and a3, or the force P and all masses"
        )
    rest = sum((w * channels[c] for c, w in weights.items() if c != site), np.zeros(len(channels[site])))
    return -rest / weights[site]
