"""What is drawn of a machine: pieces by component and connection, each corner with the frame that it moves with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..indices import Index
from ..model.machine import Machine
from ..shapes.drawn import Frame
from .bodies import bodies
from .elements import elements
from .marks import Mark, marks
from .piece import Label, Piece
from .places import Places

Numbers = TypeVar("Numbers", Array, ComplexArray)


@dataclass(frozen=True, eq=False)
class Scene:
    """A machine in m, machine axes, as it stands; a mode shape moves it by its `frames`."""

    name: str
    frames: tuple[Frame, ...]
    """Over the degrees of freedom of the machine; the first one is the ground and stays."""
    pieces: tuple[Piece, ...]
    labels: tuple[Label, ...]
    placeless: tuple[str, ...]
    """What has no place in space and how it is shown all the same, a sentence each."""
    up: Array
    """Unit vector along a machine axis, against gravity; z where that is not given."""

    @cached_property
    def corners(self) -> tuple[Array, Index]:
        """All corners (n, 3) of what belongs to the machine, with the frame (n,) of each."""
        pieces = [piece for piece in self.pieces if not piece.backdrop]
        return np.concatenate([p.corners for p in pieces]), np.concatenate([p.frame for p in pieces])

    @property
    def box(self) -> tuple[Array, Array]:
        """Lowest and highest corner of what is drawn, m."""
        points = self.corners[0]
        return np.min(points, axis=0), np.max(points, axis=0)

    @property
    def size(self) -> float:
        """Diagonal of the box, m."""
        low, high = self.box
        return float(np.linalg.norm(high - low))

    def moves(self, shapes: ComplexArray) -> ComplexArray:
        """u and ϑ of every frame, (modes, frames, 6), for shapes (degrees of freedom, modes)."""
        rows = np.array([frame.rows for frame in self.frames])
        return np.asarray(np.moveaxis(np.tensordot(rows, shapes, axes=(2, 0)), 2, 0))

    def displaced(self, corners: Array, frame: Index, moved: Numbers) -> Numbers:
        """Displacement u + ϑ × ρ (n, 3) of corners that go with frames (n,), for u and ϑ (frames, 6) of all."""
        arms = corners - np.array([f.origin for f in self.frames])[frame]
        return np.asarray(moved[frame, :3] + np.cross(moved[frame, 3:], arms))


def scene(machine: Machine) -> Scene:
    """The picture of a machine.

    Raises
    ------
    InputError
        Where no part of it has a place in space.
    """
    places = Places(machine)
    points = np.array(list(places.points())).reshape(-1, 3)
    if not len(points):
        raise InputError(
            f"{machine.where}: no part has a place in space, expected a rigid body, a beam, nodes with positions or a "
            "connection with at and direction to draw"
        )
    size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-2)
    up = upwards(machine)
    drawn: list[Mark] = [*bodies(places, size), *elements(places, size), *marks(places, size, up)]
    pieces = tuple(mark for mark in drawn if isinstance(mark, Piece))
    labels = tuple(mark for mark in drawn if isinstance(mark, Label))
    said = tuple(mark for mark in drawn if isinstance(mark, str))
    return Scene(machine.name, tuple(places.frames), pieces, labels, said, up)


def upwards(machine: Machine) -> Array:
    """The machine axis that points most against gravity."""
    down = np.array((0.0, 0.0, -1.0) if machine.static is None else machine.static.gravity or (0.0, 0.0, -1.0))
    axis = int(np.argmax(np.abs(down)))
    return np.asarray(-np.sign(down[axis]) * np.eye(3)[axis])
