"""Rigid body: mass and inertia about its centre, free in space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from ..shapes.drawn import Drawn, Frame
from ..shapes.solid import block
from .component import Component, SecondOrder, checked_square
from .nodes import DIRECTIONS, checked_nodes

DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")
_FLAT = 0.02
"""Least edge of the block that is drawn, over its largest."""


@dataclass(frozen=True, eq=False)
class Rigid(Component):
    """H = −diag(m, m, m, J)⁻¹/ω² in the translation u of the centre of mass and the rotation ϑ of the body.

    Parameters
    ----------
    mass
        kg.
    inertia
        About the centre, machine axes, kg m²: three principal values or a (3, 3) matrix.
    centre
        Position of the centre of mass in m, machine axes; the points of connections are taken relative to it.
    points
        Named points in m, machine axes; each adds the dofs ``name.x``, ``name.y``, ``name.z``, its translations.
    """

    name: str
    mass: float
    inertia: Array
    centre: Array | None = None
    dofs: tuple[str, ...] = DOFS
    points: Mapping[str, Array] = field(default_factory=dict)

    kind: ClassVar[str] = "rigid"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        if not (np.isfinite(self.mass) and self.mass > 0):
            raise InputError(f"{where}: mass is {self.mass!r} kg, expected more than 0")
        if tuple(self.dofs) != DOFS:
            raise InputError(f"{where}: dofs is {list(self.dofs)}, expected {', '.join(DOFS)}, or leave it out")
        inertia = np.array(self.inertia, dtype=float)
        if inertia.shape == (3,):
            inertia = np.diag(inertia)
        inertia = checked_square(where, "inertia", inertia, 3)
        if not np.linalg.eigvalsh(inertia)[0] > 0:
            raise InputError(f"{where}: inertia is singular, expected every rotation to carry inertia")
        centre = np.zeros(3) if self.centre is None else np.array(self.centre, dtype=float)
        if centre.shape != (3,) or not np.all(np.isfinite(centre)):
            raise InputError(f"{where}: centre is {centre.tolist()}, expected three finite coordinates in m")
        points = {name: np.array(at, dtype=float) for name, at in self.points.items()}
        if points:
            checked_nodes(where, tuple(points), np.array(list(points.values())))
        named = tuple(f"{name}.{axis}" for name in points for axis in DIRECTIONS[:3])
        for key, value in (("inertia", inertia), ("centre", centre), ("points", points), ("dofs", DOFS + named)):
            object.__setattr__(self, key, value)

    @classmethod
    def from_section(cls, section: Section) -> Rigid:
        name, mass, inertia = section.text("name"), section.number("mass", "kg"), inertia_of(section)
        centre = section.numbers("centre", "m", None, length=3)
        dofs = section.words("dofs", DOFS)
        points = read_points(section)
        return cls(name, mass, inertia, None if centre is None else np.array(centre), dofs, points)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        model = self.second_order()
        accelerance = rows @ model.shapes @ np.linalg.solve(model.mass, (columns @ model.shapes).T)
        return np.asarray(-accelerance / omega[:, None, None] ** 2 + 0j)

    def second_order(self) -> SecondOrder:
        mass = np.zeros((6, 6))
        mass[:3, :3] = self.mass * np.eye(3)
        mass[3:, 3:] = self.inertia
        moved = [self._twist(at, n) for at in self.points.values() for n in np.eye(3)]
        return SecondOrder(mass, np.zeros((6, 6)), np.zeros((6, 6)), np.array([*np.eye(6), *moved]))

    def weight(self, gravity: Array) -> Array:
        """It acts at the centre of mass."""
        return np.concatenate([self.mass * gravity, np.zeros(len(self.dofs) - 3)])

    def motion_at(self, point: Array, direction: Array) -> Array:
        """n·(u + ϑ × ρ) = n·u + (ρ × n)·ϑ with ρ from the centre to the point."""
        return np.concatenate([self._twist(point, direction), np.zeros(len(self.dofs) - 6)])

    def drawn(self) -> Drawn:
        """The even block that has its mass and inertia: of edges a, b, c with J_x = m (b² + c²)/12 and so on."""
        assert self.centre is not None
        J, axes = np.linalg.eigh(self.inertia)
        edges = np.sqrt(np.clip(6 * (np.sum(J) - 2 * J) / self.mass, 0.0, None))
        if np.linalg.det(axes) < 0:
            axes = -axes
        solid = block(np.zeros(3), np.maximum(edges, _FLAT * max(edges))).placed(self.centre, axes.T)
        own = Frame(self.centre, np.eye(6, len(self.dofs)))
        named = [Frame(at, np.concatenate([own.motion(at), own.rows[3:]])) for at in self.points.values()]
        return Drawn((own, *named), ("", *self.points), 1, (solid,))

    def rotation_at(self, point: Array, direction: Array) -> Array:
        """n·ϑ, the same everywhere."""
        return np.concatenate([np.zeros(3), direction, np.zeros(len(self.dofs) - 6)])

    def _twist(self, point: Array, direction: Array) -> Array:
        assert self.centre is not None
        return np.concatenate([direction, np.cross(point - self.centre, direction)])


def inertia_of(section: Section) -> Array:
    """The key ``inertia``: three principal values, or a 3 × 3 matrix, kg m²."""
    raw = section.take("inertia")
    again = section.within({"inertia": raw})
    nested = isinstance(raw, list) and bool(raw) and isinstance(raw[0], list)
    return np.array(again.matrix("inertia", "kg m^2") if nested else again.numbers("inertia", "kg m^2", length=3))


def read_points(section: Section) -> dict[str, Array]:
    """The named points of a ``[[component]]``, m in machine axes."""
    points: dict[str, Array] = {}
    for part in section.sections("point"):
        point = part.text("name")
        if point in points:
            raise InputError(f"{section.where}: point {point!r} is named twice, expected different names")
        points[point] = np.array(part.numbers("at", "m", length=3))
        part.done()
    return points
