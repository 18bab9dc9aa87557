"""Shafts that are far too thick for the bearings that they run in."""

from __future__ import annotations

from collections.abc import Iterator

from ..bundles.bearing_pair import BearingPair
from ..components.beam import Beam
from ..model.machine import Machine

_THICK = 5.0
"""Diameter over the pitch diameter of its largest bearing; chucks and rotors have up to 3, faceplates more, but these
are discs, shorter than that pitch diameter."""


def thick_shafts(machine: Machine) -> Iterator[str]:
    """Segments of a beam in bearings whose diameter no such bearing goes with."""
    for beam in machine.components:
        if not isinstance(beam, Beam):
            continue
        pitches = {
            placed.name: placed.bundle.pitch_diameter
            for placed in machine.bundles
            if isinstance(placed.bundle, BearingPair)
            and beam.name in (side.partition(".")[0] for side in placed.between)
        }
        if not pitches:
            continue
        largest = max(pitches, key=lambda name: pitches[name])
        for number, segment in enumerate(beam.segments, start=1):
            size = segment.diameter
            if size is not None and size > _THICK * pitches[largest] and segment.length > pitches[largest]:
                yield (
                    f"{beam.name}: segment {number} has a diameter of {size * 1e3:g} mm over {segment.length * 1e3:g} "
                    f"mm, and the largest of its bearings, {largest}, a pitch diameter of "
                    f"{pitches[largest] * 1e3:g} mm: is its unit right?"
                )
