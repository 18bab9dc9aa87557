"""A joint whose stiffness changes while it is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.fault import Fault, RigRecord, Shape

_ALONG = 0.5
"""Of the spread of the mean stiffness over the records, how much it must change along them."""


class StiffnessDrift(Fault):
    """The joint force gains (stiffness + stiffness_rate·t + stiffness_bend·t²)·z, t from the first sample of a record.

    Skirts around the lines of the period, with a level, a rate and a bend for each record. A change of the joint, not
    of what was measured: nothing is undone on reading.
    """

    family: ClassVar[str] = "stiffness-drift"
    words: ClassVar[str] = "a stiffness that changes with time (stiffness-drift)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "position-stiffness": "Repeat at a standstill, from cold, with the temperature logged.",
    }
    on: ClassVar[str] = "joint"
    parameters: ClassVar[Mapping[str, str]] = {
        "stiffness_rate": "N/(m s)",
        "stiffness": "N/m",
        "stiffness_bend": "N/(m s^2)",
    }
    per_record: ClassVar[bool] = True
    biased: ClassVar[bool] = True
    """z comes from accelerations over one record, at whose ends a drifting motion does not close."""
    needs: ClassVar[frozenset[str]] = frozenset()

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        z, t = record.displacement, record.time
        return np.stack([record.on_equations(joint=record.lines_of(f)) for f in (z * t, z, z * t**2)])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        return dict(zip(self.parameters, coefficients.tolist(), strict=False))

    def shows(self, parameters: Sequence[Mapping[str, float]], records: Sequence[RigRecord]) -> bool:
        """The stiffness changes along the records, and not mainly from record to record, as with any effect of the
        amplitude."""
        along, between = [], []
        for p, record in zip(parameters, records, strict=True):
            t = record.time
            k = p["stiffness"] + p["stiffness_rate"] * t + p["stiffness_bend"] * t**2
            along.append(float(np.std(k)))
            between.append(float(np.mean(k)))
        return bool(np.sqrt(np.mean(np.square(along))) >= _ALONG * np.std(between))
