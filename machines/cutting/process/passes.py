"""Which edge is in the cut when, and in which directions it measures the chip and pushes the tool."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array

from .cutter import Cutter
from .cutting import Cutting

_SAME = 1e-9
_FEWEST, _FEWEST_WOUND = 8, 3
_SECTION, _MOST_SECTIONS = np.radians(4.0), 24
"""Angle of lag that a section along the depth takes, at most so many of them."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of the tooth period in which the same edges cut, in equal steps; nodes and the middles between them.

    First axes are (nodes or middles, edges in the cut).
    """

    step: float
    """s."""
    feed: Array
    """Share of the feed in the chip, sin φ in milling and 1 in turning, (nodes, edges)."""
    feed_between: Array
    radial: Array
    """Row over the tool's axes that gives its motion along the chip thickness, (nodes, edges, axes)."""
    radial_between: Array
    radial_rate: Array
    """Its time derivative in 1/s at the nodes."""
    force: Array
    """Force on the tool in N per metre of depth and of chip thickness, (nodes, axes, edges)."""
    force_between: Array
    rubbing: float = 0.0
    """C/v in N s/m² of depth with which each edge in the cut is damped along ``along``."""
    along: Array = field(default_factory=lambda: np.zeros(0))
    """`radial`, also where a motion is stepped that leaves no waves, (nodes, edges, axes)."""
    along_between: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def steps(self) -> int:
        """Steps from the first node to the last."""
        return len(self.feed_between)


def stretches(
    cutting: Cutting, axes: tuple[str, ...], speed: float, rate: float, depth: float = 0.0
) -> tuple[Stretch, ...]:
    """One tooth period (a revolution in turning) at a speed in rpm, split where an edge enters or leaves the cut.

    ``rate`` is the least number of steps per second. Edge j stands at φ = θ + 2πj/N while θ passes one pitch, so a
    node of the period belongs to fixed angles and meets there what the edge before it left one period earlier. With
    helix the ``depth`` in m is cut into sections, each a straight edge that comes later than the one below.
    """
    cutter = Cutter.of(cutting)
    found = _plain(cutting, axes, speed, rate, cutter.flutes[0].lag * depth)
    rubbing = cutter.rubbing(speed) / (_sections(cutter.flutes[0].lag * depth))
    return tuple(replace(s, rubbing=rubbing, along=s.radial, along_between=s.radial_between) for s in found)


def _sections(lag: float) -> int:
    """Into how many sections an edge is cut that comes later by an angle in rad at the top."""
    return int(np.clip(np.ceil(lag / _SECTION), 1, _MOST_SECTIONS))


def _plain(cutting: Cutting, axes: tuple[str, ...], speed: float, rate: float, lag: float) -> tuple[Stretch, ...]:
    turning = 2 * np.pi * speed / 60
    if cutting.process != "milling":
        count = max(_FEWEST, int(np.ceil(60 / speed * rate)))
        return (_stretch(cutting, axes, np.zeros((2 * count + 1, 1)), 60 / speed / count, turning),)
    pitch, entry, leave = 2 * np.pi / cutting.cuts_per_revolution, cutting.entry_angle, cutting.exit_angle
    many = _sections(lag)
    later = lag * (np.arange(many) + 0.5) / many if lag else np.zeros(1)
    inner = np.sort((np.array([entry, leave])[:, None] + later).ravel() % pitch)
    inner = inner[(inner > _SAME) & (inner < pitch - _SAME) & (np.diff(inner, prepend=0) > _SAME)]
    fewest = _FEWEST if many == 1 else _FEWEST_WOUND
    offset = (pitch * np.arange(cutting.cuts_per_revolution)[:, None] - later).ravel()
    found = []
    for first, last in pairwise([0.0, *inner, pitch]):
        turns = np.floor(((first + last) / 2 + offset) / (2 * np.pi))
        angles = (first + last) / 2 + offset - 2 * np.pi * turns
        cutters = (offset - 2 * np.pi * turns)[(angles > entry) & (angles < leave)]
        count = max(fewest, int(np.ceil((last - first) / turning * rate)))
        theta = np.linspace(first, last, 2 * count + 1)[:, None] + cutters
        found.append(_stretch(cutting, axes, theta, (last - first) / turning / count, turning, many))
    return tuple(found)


def _stretch(
    cutting: Cutting, axes: tuple[str, ...], angle: Array, step: float, turning: float, sections: int = 1
) -> Stretch:
    """A stretch from the angles φ at nodes and middles in turn, (2·steps + 1, edges)."""
    rows = ["xy".index(axis) for axis in axes]
    u, v = (part[:, :, rows] for part in cutting.tooth(angle))
    if cutting.process == "milling":
        share, turned = np.sin(angle), turning * cutting.tooth(angle + np.pi / 2)[1][:, :, rows]
    else:
        share, turned = np.ones_like(angle), np.zeros_like(v)
    force = -u.swapaxes(1, 2) / sections
    nodes, middles = slice(None, None, 2), slice(1, None, 2)
    return Stretch(
        step,
        share[nodes],
        share[middles],
        v[nodes],
        v[middles],
        turned[nodes],
        force[nodes],
        force[middles],
    )
