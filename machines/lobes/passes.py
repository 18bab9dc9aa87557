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
    feed_rate: Array
    """Its time derivative in 1/s at the nodes."""
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
    if cutting.specific is not None:
        count = max(_FEWEST, int(np.ceil(60 / speed * rate)))
        one = np.ones((count + 1, 1))
        along_x = np.array([float(axis == "x") for axis in axes])
        radial = one[:, :, None] * along_x
        force = -cutting.specific * one[:, :, None] * along_x[:, None]
        step = 60 / speed / count
        return (Stretch(step, one, one[1:], 0 * one, radial, radial[1:], 0 * radial, force, force[1:]),)
    pitch, turning = 2 * np.pi / cutting.cuts_per_revolution, 2 * np.pi * speed / 60
    entry, leave = cutting.entry_angle, cutting.exit_angle
    edges = np.unique(np.array([0.0, entry % pitch, leave % pitch, pitch]))
    edges = np.append(edges[:-1][np.diff(edges) > _SAME], pitch)
    if len(edges) > 2 and edges[1] < _SAME:
        edges = np.delete(edges, 1)
    found = []
    for first, last in pairwise(edges):
        angles = (first + last) / 2 + pitch * np.arange(cutting.cuts_per_revolution)
        cutters = pitch * np.flatnonzero((angles > entry) & (angles < leave))
        count = max(_FEWEST, int(np.ceil((last - first) / turning * rate)))
        theta = np.linspace(first, last, 2 * count + 1)[:, None] + cutters
        found.append(_milled(cutting, axes, theta, (last - first) / turning / count, turning))
    return tuple(found)


def _milled(cutting: Cutting, axes: tuple[str, ...], angle: Array, step: float, turning: float) -> Stretch:
    """A stretch of milling from the angles φ at nodes and middles in turn, (2·steps + 1, edges)."""
    assert cutting.tangential is not None
    assert cutting.normal is not None
    chosen = ["xy".index(axis) for axis in axes]
    s, c = np.sin(angle), np.cos(angle)
    K_t, K_n = cutting.tangential, cutting.normal
    radial = np.stack([s, c], axis=-1)[:, :, chosen]
    rate = turning * np.stack([c, -s], axis=-1)[:, :, chosen]
    force = np.stack([-K_t * c - K_n * s, K_t * s - K_n * c], axis=1)[:, chosen]
    nodes, middles = slice(None, None, 2), slice(1, None, 2)
    return Stretch(
        step,
        s[nodes],
        s[middles],
        turning * c[nodes],
        radial[nodes],
        radial[middles],
        rate[nodes],
        force[nodes],
        force[middles],
    )
