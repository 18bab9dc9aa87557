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
_TOLD = 4


class NoNode(InputError):
    """A point at which a component has no node; ``station`` in m along a beam would be one."""

    def __init__(self, where: str, point: Array, nearest: str, station: float | None = None) -> None:
        self.where, self.point, self.nearest, self.station = where, point, nearest, station
        expected = "" if station is None else f"; expected a [[component.station]] at {station:.4g} m"
        super().__init__(f"{where}: no node at {_words(point)} m; the nearest, {nearest}{expected}")


def no_nodes(found: Sequence[tuple[str, NoNode]]) -> str:
    """One sentence for all points at which one component has no node, each beside the connection that it is of."""
    first = found[0][1]
    if len(found) == 1:
        return str(first)
    stations = sorted({one.station for _, one in found if one.station is not None})
    expected = f"; expected a [[component.station]] at {_listed([f'{at:.4g} m' for at in stations])}"
    points = f"{len(found)} points of {_listed(list(dict.fromkeys(name for name, _ in found)))}"
    lies = f"the nearest to {_words(first.point)} m, {first.nearest}"
    return f"{first.where}: no node at {points}; {lies}{expected if stations else ''}"


def _listed(words: Sequence[str]) -> str:
    """Some of them."""
    return ", ".join(words if len(words) <= _TOLD else [*words[: _TOLD - 1], f"… {words[-1]}"])


@dataclass(frozen=True, eq=False)
class Nodes:
    """Named points (m, machine axes); the motion of a point is that of the node that lies there.

    The dof ``nose.x`` is the translation of node ``nose`` along x, ``nose.rx`` its rotation about x.
    """

    names: tuple[str, ...]
    positions: Array
    tolerance: float = TOLERANCE
    line: Array | None = None
    """Both ends of the line on which more of them may lie, (2, 3) in m."""
    sized: bool = False
    """Whether they are of a tool by its sizes, whose tolerance no file can tell."""

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
            lies = f"lies {distance[near]:.3g} m away at {_words(self.positions[near])} m"
            station = self._station(point)
            more = f" (tolerance {self.tolerance:g} m)"
            if self.sized:
                more = (
                    "" if station is not None else "; expected a flange there, or the tool as a beam with a tolerance"
                )
            raise NoNode(where, point, f"{self.names[near]!r}, {lies}{more}", station)
        return near

    def _station(self, point: Array) -> float | None:
        """Where along its line a node of this point would lie, in m; None where none would be near enough."""
        if self.line is None:
            return None
        along = self.line[1] - self.line[0]
        length = float(np.linalg.norm(along))
        if not length > 0:
            return None
        at = float(np.clip((point - self.line[0]) @ along / length, 0, length))
        near = np.linalg.norm(self.line[0] + at * along / length - point) <= self.tolerance
        return at if near else None


def checked_nodes(
    where: str,
    names: Sequence[str],
    positions: Array,
    tolerance: float = TOLERANCE,
    line: Array | None = None,
    sized: bool = False,
) -> Nodes:
    """Nodes with different names, none with a dot, and finite positions."""
    checked_dofs(where, tuple(names))
    for name in names:
        if "." in name:
            raise InputError(f"{where}: node {name!r}, expected a name without a dot")
    if positions.shape != (len(names), 3) or not np.all(np.isfinite(positions)):
        raise InputError(f"{where}: node positions {positions.tolist()}, expected three finite coordinates each, in m")
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise InputError(f"{where}: tolerance is {tolerance!r} m, expected at least 0")
    return Nodes(tuple(names), positions, tolerance, line, sized)


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
