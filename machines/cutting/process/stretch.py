"""A part of the tooth period in which the same edges cut: where they stand, what they meet and how they push."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from jointlib.arrays import Array

from .chart import Integers
from .cutting import Cutting

SAME = 1e-9
"""rad; two angles no further apart are one."""
FEWEST, FEWEST_WOUND = 8, 3
"""Steps in a stretch, of a straight edge and of sections of a wound one."""
_SECTION, _MOST_SECTIONS = np.radians(4.0), 24
"""Angle of lag that a section along the depth takes, at most so many of them."""


@dataclass(frozen=True, eq=False)
class Origin:
    """Where a stretch finds the surface that it meets, in the surfaces of all stretches laid end to end.

    Flat indices of the nodes on both sides and of the middle between them, and the share of the way from left to
    right, each (nodes and middles in turn, edges).
    """

    left: Integers
    right: Integers
    middle: Integers
    share: Array


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
    beyond: Array = field(default_factory=lambda: np.zeros(1))
    """m by which each edge stands out beyond the one before it, (edges,)."""
    edge: Array | None = None
    """Force on the tool in N per metre of depth whatever the chip, (nodes, axes, edges); None where there is none."""
    edge_between: Array | None = None
    origin: Origin | None = None
    """None where each edge meets, node by node, what was left in this stretch one period earlier."""

    @property
    def steps(self) -> int:
        """Steps from the first node to the last."""
        return len(self.feed_between)


def sections(lag: float) -> int:
    """Into how many sections an edge is cut that comes later by an angle in rad at the top."""
    return int(np.clip(np.ceil(lag / _SECTION), 1, _MOST_SECTIONS))


def stretch(
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
    edge = None
    if cutting.edge_tangential or cutting.edge_normal:
        edge = -cutting.edge(angle)[:, :, rows].swapaxes(1, 2) / sections
    return Stretch(
        step,
        share[nodes],
        share[middles],
        v[nodes],
        v[middles],
        turned[nodes],
        force[nodes],
        force[middles],
        edge=None if edge is None else edge[nodes],
        edge_between=None if edge is None else edge[middles],
    )
