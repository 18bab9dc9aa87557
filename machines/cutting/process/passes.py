"""Which edge is in the cut when, and in which directions it measures the chip and pushes the tool."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .cutter import Cutter
from .cutting import Cutting
from .stretch import FEWEST, FEWEST_WOUND, SAME, Stretch, sections, stretch
from .uneven_passes import uneven_stretches


def stretches(
    cutting: Cutting, axes: tuple[str, ...], speed: float, rate: float, depth: float = 0.0
) -> tuple[Stretch, ...]:
    """One tooth period (a revolution in turning) at a speed in rpm, split where an edge enters or leaves the cut.

    ``rate`` is the least number of steps per second. Edge j stands at φ = θ + 2πj/N while θ passes one pitch, so a
    node of the period belongs to fixed angles and meets there what the edge before it left one period earlier. With
    helix the ``depth`` in m is cut into sections, each a straight edge that comes later than the one below. Flutes that
    do not follow one another alike have a period of their pattern, see `uneven_stretches`.
    """
    cutter = Cutter.of(cutting, runout=cutting.feed is not None)
    if len(cutter.flutes) > 1:
        found = uneven_stretches(cutter, axes, speed, rate, depth)
    else:
        found = _plain(cutting, axes, speed, rate, cutter.flutes[0].lag * depth)
    rubbing = cutter.rubbing(speed) / sections(max(flute.lag for flute in cutter.flutes) * depth)
    return tuple(replace(s, rubbing=rubbing, along=s.radial, along_between=s.radial_between) for s in found)


def _plain(cutting: Cutting, axes: tuple[str, ...], speed: float, rate: float, lag: float) -> tuple[Stretch, ...]:
    turning = 2 * np.pi * speed / 60
    if cutting.process != "milling":
        count = max(FEWEST, int(np.ceil(60 / speed * rate)))
        return (stretch(cutting, axes, np.zeros((2 * count + 1, 1)), 60 / speed / count, turning),)
    pitch, entry, leave = 2 * np.pi / cutting.cuts_per_revolution, cutting.entry_angle, cutting.exit_angle
    many = sections(lag)
    later = lag * (np.arange(many) + 0.5) / many if lag else np.zeros(1)
    inner = np.sort((np.array([entry, leave])[:, None] + later).ravel() % pitch)
    inner = inner[(inner > SAME) & (inner < pitch - SAME) & (np.diff(inner, prepend=0) > SAME)]
    fewest = FEWEST if many == 1 else FEWEST_WOUND
    offset = (pitch * np.arange(cutting.cuts_per_revolution)[:, None] - later).ravel()
    found = []
    for first, last in pairwise([0.0, *inner, pitch]):
        turns = np.floor(((first + last) / 2 + offset) / (2 * np.pi))
        angles = (first + last) / 2 + offset - 2 * np.pi * turns
        cutters = (offset - 2 * np.pi * turns)[(angles > entry) & (angles < leave)]
        count = max(fewest, int(np.ceil((last - first) / turning * rate)))
        theta = np.linspace(first, last, 2 * count + 1)[:, None] + cutters
        found.append(stretch(cutting, axes, theta, (last - first) / turning / count, turning, many))
    return tuple(found)
