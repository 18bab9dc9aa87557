"""Which edge is in the cut when, and in which directions it measures the chip and pushes the tool."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from jointlib.arrays import Array

from .cutting import Cutting

_SAME = 1e-9
_FEWEST = 8


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

    @property
    def steps(self) -> int:
        """Steps from the first node to the last."""
        return len(self.feed_between)


def stretches(cutting: Cutting, axes: tuple[str, ...], speed: float, rate: float) -> tuple[Stretch, ...]:
    """One tooth period (a revolution in turning) at a speed in rpm, split where an edge enters or leaves the cut.

    ``rate`` is the least number of steps per second. Edge j stands at φ = θ + 2πj/N while θ passes one pitch, so a
    node of the period belongs to fixed angles and meets there what the edge before it left one period earlier.
    """
    turning = 2 * np.pi * speed / 60
    if cutting.process != "milling":
        count = max(_FEWEST, int(np.ceil(60 / speed * rate)))
        return (_stretch(cutting, axes, np.zeros((2 * count + 1, 1)), 60 / speed / count, turning),)
    pitch, entry, leave = 2 * np.pi / cutting.cuts_per_revolution, cutting.entry_angle, cutting.exit_angle
    inner = np.sort(np.array([entry % pitch, leave % pitch]))
    inner = inner[(inner > _SAME) & (inner < pitch - _SAME) & (np.diff(inner, prepend=0) > _SAME)]
    found = []
    for first, last in pairwise([0.0, *inner, pitch]):
        angles = (first + last) / 2 + pitch * np.arange(cutting.cuts_per_revolution)
        cutters = pitch * np.flatnonzero((angles > entry) & (angles < leave))
        count = max(_FEWEST, int(np.ceil((last - first) / turning * rate)))
        theta = np.linspace(first, last, 2 * count + 1)[:, None] + cutters
        found.append(_stretch(cutting, axes, theta, (last - first) / turning / count, turning))
    return tuple(found)


def _stretch(cutting: Cutting, axes: tuple[str, ...], angle: Array, step: float, turning: float) -> Stretch:
    """A stretch from the angles φ at nodes and middles in turn, (2·steps + 1, edges)."""
    rows = ["xy".index(axis) for axis in axes]
    u, v = (part[:, :, rows] for part in cutting.tooth(angle))
    if cutting.process == "milling":
        share, turned = np.sin(angle), turning * cutting.tooth(angle + np.pi / 2)[1][:, :, rows]
    else:
        share, turned = np.ones_like(angle), np.zeros_like(v)
    force = -u.swapaxes(1, 2)
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
