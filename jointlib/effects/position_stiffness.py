"""A joint whose stiffness depends on the place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.fault import Fault, RigRecord, Shape

_MOST = 40
_WAVES = np.arange(1.5, 1000.0, 0.5)
"""Waves in a record."""


class PositionStiffness(Fault):
    """The joint force gains (cosine·cos φ + sine·sin φ + the same of 2φ)·z as the carriage passes balls or pitches.

    φ = 2π·position/wavelength where the feed position is measured, else 2π·frequency·t, t from the first sample of
    each record: sidebands at feed speed/pitch beside the lines of the period. A change of the joint: nothing is
    undone on reading.
    """

    family: ClassVar[str] = "position-stiffness"
    words: ClassVar[str] = "a stiffness that depends on the place (position-stiffness)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "stiffness-drift": "Repeat at another feed speed and at a standstill: what depends on the place moves with it.",
        "hum": "Change the feed speed: sidebands of the place move, those of the mains stay.",
    }
    on: ClassVar[str] = "joint"
    parameters: ClassVar[Mapping[str, str]] = {
        "frequency": "Hz",
        "wavelength": "m",
        "cosine": "N/m",
        "sine": "N/m",
        "cosine2": "N/m",
        "sine2": "N/m",
    }
    """Of a correction either ``frequency`` or ``wavelength``."""
    shape_parameters: ClassVar[frozenset[str]] = frozenset({"frequency", "wavelength"})
    per_record: ClassVar[bool] = True
    needs: ClassVar[frozenset[str]] = frozenset()

    def shapes(self, records: Sequence[RigRecord], site: str) -> tuple[Shape, ...]:
        """From 1.5 waves a record in steps of a half, the slowest 40.

        Frequencies on the lines of the period, or nearer than the record resolves, are left out: there nothing tells
        them from an effect that repeats.
        """
        places = [r.position for r in records]
        if any(x is None for x in places):
            length = max(len(r.time) * float(r.time[1] - r.time[0]) for r in records)
            spacing = min(float(np.min(r.frequency[r.on_period & (r.frequency > 0)])) for r in records)
            waves = _WAVES / length
            apart = np.abs(waves - spacing * np.round(waves / spacing)) > 0.99 / length
            return tuple({"frequency": float(f)} for f in waves[apart][:_MOST])
        travel = max(float(np.ptp(x)) for x in places if x is not None)
        return tuple({"wavelength": float(travel / n)} for n in _WAVES[:_MOST]) if travel > 0 else ()

    def columns(self, record: RigRecord, site: str, shape: Shape) -> ComplexArray:
        phase, z = 2 * np.pi * _waves_passed(record, shape), record.displacement
        waves = [wave(n * phase) for n in (1, 2) for wave in (np.cos, np.sin)]
        return np.stack([record.on_equations(joint=record.lines_of(z * wave)) for wave in waves])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        if any(value <= 0 for value in shape.values()):
            return None
        names = ("cosine", "sine", "cosine2", "sine2")
        return {**shape, **dict(zip(names, coefficients.tolist(), strict=False))}


def _waves_passed(record: RigRecord, shape: Shape) -> Array:
    if "frequency" in shape:
        return shape["frequency"] * record.time
    if record.position is None:
        raise InputError(f"{record.name}: a wavelength but no feed position, expected a position channel")
    return record.position / shape["wavelength"]
