"""Bearings whose numbers do not go together, and shafts that are far too thick for theirs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..bundles.bearing_pair import BearingPair
from ..components.beam import Beam
from ..model.machine import Machine

_THICK = 5.0
"""Diameter over the pitch diameter of its largest bearing; chucks and rotors have up to 3, faceplates more, but these
are discs, shorter than that pitch diameter."""

_FILLED = 0.25, 1.02
"""Share of the circle of their centres that balls cover."""


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


def odd_bearings(machine: Machine) -> Iterator[str]:
    """Pairs whose balls lie far apart on their circle or overlap; with a cage they fill 0.4 to 0.95 of it."""
    for placed in machine.bundles:
        pair = placed.bundle
        if not isinstance(pair, BearingPair) or pair.measured is not None:
            continue
        filled = pair.balls * pair.ball_diameter / (np.pi * pair.pitch_diameter)
        if not _FILLED[0] < filled < _FILLED[1]:
            yield (
                f"{placed.name}: {pair.balls} balls of {pair.ball_diameter * 1e3:g} mm fill {100 * filled:.0f} % of a "
                f"circle of {pair.pitch_diameter * 1e3:g} mm, expected 40 to 95 %: is a unit or the number off?"
            )
