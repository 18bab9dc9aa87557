"""A force that depends on the place of the feed, pitch by pitch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import Scale
from jointlib.path_fault import PathFault, PathRecord, Shape

_PLACES = 1000
"""Of the travel, at which the residual is averaged: ten in the shortest wave."""
_LIKELY = 12
"""Wavelengths that are tried of those in the grid."""


class FeedRipple(PathFault):
    """F gains cosine·cos φ + sine·sin φ, φ = 2π·position/wavelength, as balls, screw or scale pass pitch by pitch.

    Its slope over the position, 2π/wavelength times as large, is a stiffness that depends on the place.
    """

    family: ClassVar[str] = "position-stiffness"
    words: ClassVar[str] = "a force that repeats with the place of the feed (position-stiffness)"
    look_alikes: ClassVar[Mapping[str, str]] = {
        "drift": "Repeat the same cycle at another place of the travel and at another time.",
    }
    parameters: ClassVar[Mapping[str, str]] = {"wavelength": "m", "cosine": "channel", "sine": "channel"}
    shape_parameters: ClassVar[frozenset[str]] = frozenset({"wavelength"})

    def shapes(self, scale: Scale, records: Sequence[PathRecord]) -> tuple[Shape, ...]:
        """5 to 100 waves in the travel, close enough that none falls between; fewer are the curve of a spring."""
        travel = max(float(np.ptp(r.position)) for r in records)
        return tuple({"wavelength": float(travel / n)} for n in np.arange(5.0, 100.0, 0.5)) if travel > 0 else ()

    def likely(self, shapes: Sequence[Shape], position: Array, residual: Array) -> Sequence[Shape]:
        """The strongest waves of the mean residual over the place, to which a stop counts no more than any place."""
        if len(shapes) <= _LIKELY:
            return shapes
        begin, travel = float(np.min(position)), float(np.ptp(position))
        bins = np.minimum(((position - begin) / travel * _PLACES).astype(np.int64), _PLACES - 1)
        count = np.bincount(bins, minlength=_PLACES)
        mean = np.bincount(bins, residual - residual.mean(), _PLACES) / np.maximum(count, 1)
        waves = np.array([travel / shape["wavelength"] for shape in shapes])
        phase = 2 * np.pi * np.outer(waves, (np.arange(_PLACES) + 0.5) / _PLACES)
        strongest = np.argsort(-np.abs(np.exp(1j * phase) @ mean))[:_LIKELY]
        return [shapes[i] for i in np.sort(strongest)]

    def columns(self, record: PathRecord, shape: Shape) -> Array:
        phase = 2 * np.pi * record.position / shape["wavelength"]
        return np.array([np.cos(phase), np.sin(phase)])

    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        if shape["wavelength"] <= 0:
            return None
        return {**shape, "cosine": float(coefficients[0]), "sine": float(coefficients[1])}

    def undo(self, force: Array, time: Array, position: Array, parameters: Mapping[str, float]) -> Array:
        phase = 2 * np.pi * position / parameters["wavelength"]
        return np.asarray(force - parameters["cosine"] * np.cos(phase) - parameters["sine"] * np.sin(phase))
