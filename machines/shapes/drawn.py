"""How a component looks and moves: frames that are rigid each, and solids whose corners go with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from .solid import Solid


@dataclass(frozen=True, eq=False)
class Frame:
    """A place that moves as a small rigid piece does: a point at ρ from the origin moves by u + ϑ × ρ.

    ``origin`` in m, machine axes; ``rows`` (6, number of dofs) give u and ϑ of the origin over degrees of freedom.
    """

    origin: Array
    rows: Array

    def motion(self, point: Array) -> Array:
        """Rows (3, number of dofs) of the motion of a point that goes with it."""
        turned = np.cross(self.rows[3:].T, point - self.origin).T
        return np.asarray(self.rows[:3] + turned)


@dataclass(frozen=True, eq=False)
class Drawn:
    """A component in space, over its own degrees of freedom.

    The first ``holds`` frames are where connections find it: the body itself, stations, nodes. The first of them have
    ``names``: the dof ``nose.x`` is that of frame ``nose``, the dof ``ux`` of the frame without a name.
    """

    frames: tuple[Frame, ...]
    names: tuple[str, ...]
    holds: int
    solids: tuple[Solid, ...] = ()
    dots: bool = False
    """Whether the first frames are drawn as dots, joined to their nearest neighbours."""

    def nearest(self, point: Array, held: bool = True) -> int:
        """The frame next to a point, of those that a connection may hold or of all."""
        frames = self.frames[: self.holds] if held else self.frames
        return int(np.argmin([float(np.linalg.norm(frame.origin - point)) for frame in frames]))
