"""Where the degrees of freedom of a machine are in space, and the frames that move with them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from jointlib.arrays import Array

from ..components.connection import GROUND, Connection, unit_row
from ..components.static_load import axis_of
from ..model.machine import Machine
from ..shapes.drawn import Drawn, Frame


class Places:
    """The frames of a machine, over all its degrees of freedom; the first one is the ground."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.frames = [Frame(np.zeros(3), np.zeros((6, len(machine.dofs))))]
        self.drawn: dict[str, Drawn] = {}
        self.first: dict[str, int] = {}
        """Number of the first frame of every component that is drawn."""
        before = 0
        for component in machine.components:
            drawn = component.drawn()
            after = len(machine.dofs) - before - len(component.dofs)
            if drawn is not None:
                self.drawn[component.name], self.first[component.name] = drawn, len(self.frames)
                wide = ((0, 0), (before, after))
                self.frames += [Frame(frame.origin, np.pad(frame.rows, wide)) for frame in drawn.frames]
            before += len(component.dofs)

    def of_dof(self, dof: str) -> int | None:
        """The frame that a ``component.dof`` belongs to; None where its component is not drawn."""
        component, _, rest = dof.partition(".")
        drawn, name = self.drawn.get(component), rest.rpartition(".")[0]
        return None if drawn is None or name not in drawn.names else self.first[component] + drawn.names.index(name)

    def near(self, component: str, point: Array, held: bool = True) -> int:
        """The frame of a component next to a point, or the ground."""
        drawn = self.drawn.get(component)
        return 0 if drawn is None else self.first[component] + drawn.nearest(point, held)

    def line(self, connection: Connection) -> tuple[Array, Array] | None:
        """Point and unit direction of a connection; of one between dofs those of the dof that has a place."""
        if connection.at is not None and connection.direction is not None:
            direction = np.array(connection.direction)
            return np.array(connection.at), direction / np.linalg.norm(direction)
        for side in connection.between:
            frame, axis = self.of_dof(side), axis_of(side.rpartition(".")[2])
            if frame is not None and axis is not None:
                return self.frames[frame].origin, np.eye(3)[axis]
        return None

    def side(self, side: str, at: Array, direction: Array) -> int:
        """The frame of one side of a connection there; a dof without a place moves it along the direction alone."""
        component = side.partition(".")[0]
        if side == GROUND:
            return 0
        if side == component and component in self.drawn:
            return self.near(component, at)
        known = self.of_dof(side)
        if known is not None and np.array_equal(self.frames[known].origin, at):
            return known
        return self.along(self._row(side, at, direction), at, direction)

    def shifted(self, frame: int) -> int:
        """A new frame that moves as this one does, but does not turn."""
        known = self.frames[frame]
        self.frames.append(Frame(known.origin, np.concatenate([known.rows[:3], np.zeros_like(known.rows[3:])])))
        return len(self.frames) - 1

    def along(self, row: Array, at: Array, direction: Array) -> int:
        """A new frame that moves along a direction as a row over the degrees of freedom tells."""
        self.frames.append(Frame(at, np.concatenate([np.outer(direction, row), np.zeros((3, len(row)))])))
        return len(self.frames) - 1

    def _row(self, side: str, at: Array, direction: Array) -> Array:
        if "." in side:
            return unit_row(side, self.machine.components, side)
        rows = []
        for component in self.machine.components:
            own = component.motion_at(at, direction) if component.name == side else None
            rows.append(np.zeros(len(component.dofs)) if own is None else own)
        return np.concatenate(rows)

    @cached_property
    def loose(self) -> dict[str, list[tuple[str, Array, Array]]]:
        """Dof, point and direction at which every component without a place is held by the others."""
        found: dict[str, list[tuple[str, Array, Array]]] = {
            c.name: [] for c in self.machine.components if c.name not in self.drawn
        }
        for connection in self.machine.connections:
            line = self.line(connection)
            for side in connection.between:
                if line is not None and side.partition(".")[0] in found:
                    found[side.partition(".")[0]].append((side, *line))
        return found

    def points(self) -> Iterator[Array]:
        """What the picture has to hold: solids, frames, and where connections are."""
        for drawn in self.drawn.values():
            yield from (frame.origin for frame in drawn.frames)
            for solid in drawn.solids:
                yield from solid.corners
        for connection in self.machine.connections:
            line = self.line(connection)
            if line is not None:
                yield line[0]
