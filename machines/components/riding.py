"""A modal component that rides: known by the modes it has while its base is held, attached to something that moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..shapes.drawn import Drawn
from .component import Component, SecondOrder, checked_square, is_positive
from .lumped import receptance_of
from .modal import Modal
from .nodes import DIRECTIONS, TOLERANCE, Nodes, checked_nodes
from .rigid import inertia_of, read_points

BASE = "base"


@dataclass(frozen=True, eq=False)
class Riding(Component):
    """x = d·(u + ϑ × ρ) + Σ φ_r η_r: the base moves by u and ϑ and carries the part along, the modes bend it.

    With the base's motion b = (u, ϑ) and the modes' η the equations are

        [ M_b  L ] [b̈]   [0        0       ] [ḃ]   [0     0    ] [b]
        [ Lᵀ   m ] [η̈] + [0  2 m ζ ω       ] [η̇] + [0   m ω²   ] [η]  =  Φᵀ f

    where M_b is the mass of the rigid part about its base and L the participation of the modes in its motion (Craig and
    Bampton, AIAA J. 6, 1968: a part by its modes with the interface held).

    Parameters
    ----------
    modes
        What is known while the base is held: dofs, frequencies, damping ratios, shapes, modal masses; a dof is
        ``point.x`` … ``point.rz``, of a point below.
    base
        Point that the part is held at, m, machine axes; its motions are the dofs ``base.x`` … ``base.rz``.
    mass, centre, inertia
        kg; m, machine axes; kg m² about the centre, three principal values or a matrix: of the whole part.
    participation
        L = ∫ [1; ρ×] φ_r dm, shape (6, modes): what holds the base while a mode has unit acceleration, forces along
        x, y, z (kg) and moments about the base (kg m). Mass-normalised shapes have theirs in √kg.
    points
        Where the named points of the dofs lie, m, machine axes.
    tolerance
        m; how far the point of a connection may lie from the base or from a point.
    """

    modes: Modal
    base: Array
    mass: float
    centre: Array
    inertia: Array
    participation: Array
    points: Mapping[str, Array] = field(default_factory=dict)
    tolerance: float = TOLERANCE
    dofs: tuple[str, ...] = ()

    kind: ClassVar[str] = "modal"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        if not (np.isfinite(self.mass) and self.mass > 0):
            raise InputError(f"{where}: mass is {self.mass!r} kg, expected more than 0")
        inertia = np.array(self.inertia, dtype=float)
        inertia = checked_square(where, "inertia", np.diag(inertia) if inertia.shape == (3,) else inertia, 3)
        participation = np.array(self.participation, dtype=float)
        count = len(self.modes.frequency)
        if participation.shape != (6, count) or not np.all(np.isfinite(participation)):
            raise InputError(
                f"{where}: participation has shape {participation.shape}, expected finite values of shape "
                f"{(6, count)}: rows x, y, z, rx, ry, rz about the base, a column per mode"
            )
        for dof in self.modes.dofs:
            point, _, direction = dof.partition(".")
            if point not in self.points or direction not in DIRECTIONS:
                raise InputError(
                    f"{where}: dof {dof!r}, expected the name of a [[component.point]] and a direction, such as tip.x: "
                    "the base carries it along"
                )
        if BASE in self.points:
            raise InputError(f"{where}: a point is named 'base', as the base itself is, expected another name")
        own = tuple(f"{BASE}.{direction}" for direction in DIRECTIONS)
        values = {"base": np.array(self.base, dtype=float), "centre": np.array(self.centre, dtype=float)}
        values |= {"inertia": inertia, "participation": participation}
        for key, value in values.items():
            object.__setattr__(self, key, value)
        object.__setattr__(self, "points", {name: np.array(at, dtype=float) for name, at in self.points.items()})
        object.__setattr__(self, "dofs", (*own, *self.modes.dofs))
        assert self.nodes  # names and places are checked
        if not is_positive(self.second_order().mass):
            share = np.sum(participation[:3] ** 2 / self.modes.modal_mass, axis=1)
            words = ", ".join(f"{m:.4g} kg along {axis}" for m, axis in zip(share, "xyz", strict=True))
            raise InputError(
                f"{where}: its modes carry more than the part has ({words}, of {self.mass:.4g} kg, or too much "
                "about an axis), expected participation, modal_mass, mass and inertia of one part, about its base"
            )

    @classmethod
    def from_section(cls, section: Section) -> Riding:
        base, centre = (section.numbers(key, "m", length=3) for key in ("base", "centre"))
        mass, inertia = section.number("mass", "kg"), inertia_of(section)
        participation = section.matrix("participation", "1")
        points = read_points(section)
        tolerance = section.number("tolerance", "m", TOLERANCE)
        modes = Modal.from_section(section)
        return cls(modes, np.array(base), mass, np.array(centre), inertia, np.array(participation), points, tolerance)

    @property
    def name(self) -> str:  # type: ignore[override]
        """That of its modes."""
        return self.modes.name

    @cached_property
    def nodes(self) -> Nodes:
        """The base and its points."""
        places = np.array([self.base, *self.points.values()])
        return checked_nodes(f"component {self.name!r}", (BASE, *self.points), places, self.tolerance)

    def second_order(self) -> SecondOrder:
        return self._equations

    @cached_property
    def _equations(self) -> SecondOrder:
        held = self.modes.second_order()
        count = len(held.mass)
        arm = self.centre - self.base
        spin = np.cross(np.eye(3), arm)  # rows n × ρ: the centre moves with ϑ × ρ
        mass = np.zeros((6 + count, 6 + count))
        mass[:3, :3] = self.mass * np.eye(3)
        mass[:3, 3:6] = self.mass * spin.T
        mass[3:6, :3] = self.mass * spin
        mass[3:6, 3:6] = self.inertia + self.mass * spin @ spin.T
        mass[:6, 6:], mass[6:, :6] = self.participation, self.participation.T
        mass[6:, 6:] = held.mass
        damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
        damping[6:, 6:], stiffness[6:, 6:] = held.damping, held.stiffness
        shapes = np.zeros((len(self.dofs), 6 + count))
        shapes[:6, :6] = np.eye(6)
        shapes[6:, 6:] = held.shapes
        for row, dof in zip(shapes[6:], self.modes.dofs, strict=True):
            point, _, word = dof.partition(".")
            n = np.eye(3)[DIRECTIONS.index(word) % 3]
            row[:6] = [*np.zeros(3), *n] if word.startswith("r") else [*n, *np.cross(self.points[point] - self.base, n)]
        return SecondOrder(mass, damping, stiffness, shapes)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        return receptance_of(self.second_order(), omega, rows, columns)

    def remarks(self) -> tuple[str, ...]:
        return self.modes.remarks()

    def weight(self, gravity: Array) -> Array:
        """On its base, with the moment of its arm; its own sag between base and points is not part of it."""
        force = self.mass * gravity
        out = np.zeros(len(self.dofs))
        out[:6] = [*force, *np.cross(self.centre - self.base, force)]
        return out

    def drawn(self) -> Drawn:
        """Its base and points; motions that a point has no dof for are drawn as zero."""
        return Drawn(self.nodes.frames(self.dofs), self.nodes.names, len(self.nodes.names), dots=True)

    def motion_at(self, point: Array, direction: Array) -> Array:
        """Motion of the base or of the named point that lies there."""
        return self.nodes.motion(f"component {self.name!r}", self.dofs, point, direction)

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        """Rotation of the base or of the named point that lies there."""
        return self.nodes.rotation(f"component {self.name!r}", self.dofs, point, direction)


class HeldOrRiding(Component):
    """A ``[[component]]`` of kind modal: what holds it stands still (`Modal`), or its ``base`` moves (`Riding`)."""

    kind: ClassVar[str] = "modal"

    @classmethod
    def from_section(cls, section: Section) -> Component:
        return (Riding if section.has("base") else Modal).from_section(section)
