"""Nodes: named points of a component in space, whose degrees of freedom are translations and rotations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..shapes.drawn import Frame
from .component import checked_dofs

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
"""Translations along and rotations about the machine axes."""
TOLERANCE = 1e-4
"""How far, in m, a connection's point may lie from the node that it is meant for, where a file does not say."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Named points (m, machine axes); the motion of a point is that of the node that lies there.

    The dof ``nose.x`` is the translation of node ``nose`` along x, ``nose.rx`` its rotation about x.
    """

    names: tuple[str, ...]
    positions: Array
    tolerance: float = TOLERANCE

    def motion(self, where: str, dofs: Sequence[str], point: Array, direction: Array) -> Array:
        """n·(u + ϑ × ρ) of the nearest node, ρ from the node to the point; rotations that a node lacks are zero.

        Raises
        ------
        InputError
            Where no node lies within the tolerance, or the node has no translation along the direction.
        """
        near = self._nearest(where, point)
        name = self.names[near]
        arm = np.cross(point - self.positions[near], direction)
        row = np.zeros(len(dofs))
        for axis, share in zip(DIRECTIONS, np.concatenate([direction, arm]), strict=True):
            dof = f"{name}.{axis}"
            if dof in dofs:
                row[list(dofs).index(dof)] = share
            elif axis in "xyz" and abs(share) > 1e-12:
                raise InputError(
                    f"{where}: node {name!r} has no dof {axis!r}, which direction {_words(direction)} needs"
                )
        return row

    def frames(self, dofs: Sequence[str]) -> tuple[Frame, ...]:
        """Every node as a frame over these dofs; motions that a node lacks are zero."""
        wanted = [[f"{name}.{axis}" for axis in DIRECTIONS] for name in self.names]
        rows = [np.array([[float(dof == row) for dof in dofs] for row in six]) for six in wanted]
        return tuple(Frame(at, row) for at, row in zip(self.positions, rows, strict=True))

    def rotation(self, where: str, dofs: Sequence[str], point: Array, direction: Array) -> Array | None:
        """n·ϑ of the nearest node; None where it does not turn about all that the direction needs."""
        name = self.names[self._nearest(where, point)]
        row = np.zeros(len(dofs))
        for axis, share in zip(DIRECTIONS[3:], direction, strict=True):
            dof = f"{name}.{axis}"
            if dof in dofs:
                row[list(dofs).index(dof)] = share
            elif abs(share) > 1e-12:
                return None
        return row

    def _nearest(self, where: str, point: Array) -> int:
        """The node that lies there, within the tolerance."""
        distance = np.linalg.norm(self.positions - point, axis=1)
        near = int(np.argmin(distance))
        if not distance[near] <= self.tolerance:
            raise InputError(
                f"{where}: no node at {_words(point)} m; the nearest, {self.names[near]!r}, lies "
                f"{distance[near]:.3g} m away at {_words(self.positions[near])} m (tolerance {self.tolerance:g} m)"
            )
        return near


def checked_nodes(where: str, names: Sequence[str], positions: Array, tolerance: float = TOLERANCE) -> Nodes:
    """Nodes with different names, none with a dot, and finite positions."""
    checked_dofs(where, tuple(names))
    for name in names:
        if "." in name:
            raise InputError(f"{where}: node {name!r}, expected a name without a dot")
    if positions.shape != (len(names), 3) or not np.all(np.isfinite(positions)):
        raise InputError(f"{where}: node positions {positions.tolist()}, expected three finite coordinates each, in m")
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"{where}: tolerance is {tolerance!r} m, expected at least 0")
    return Nodes(tuple(names), positions, tolerance)


def read_nodes(section: Section) -> Nodes | None:
    """The tables ``[[node]]`` of a component, a name and a position in m each; None where there are none."""
    names, places = [], []
    for part in section.sections("node"):
        names.append(part.text("name"))
        places.append(part.numbers("at", "m", length=3))
        part.done()
    return checked_nodes(section.where, names, np.array(places)) if names else None


def _words(vector: Array) -> str:
    return "(" + ", ".join(f"{v:g}" for v in vector) + ")"
