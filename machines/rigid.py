"""Rigid body: mass and inertia about its centre, free in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.toml import Section

from .component import Component, SecondOrder, checked_square

DOFS = ("ux", "uy", "uz", "rx", "ry", "rz")


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
    """

    name: str
    mass: float
    inertia: Array
    centre: Array | None = None
    dofs: tuple[str, ...] = DOFS

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
        object.__setattr__(self, "dofs", DOFS)
        object.__setattr__(self, "inertia", inertia)
        object.__setattr__(self, "centre", centre)

    @classmethod
    def from_section(cls, section: Section) -> Rigid:
        name, mass = section.text("name"), section.number("mass", "kg")
        raw = section.take("inertia")
        again = Section({"inertia": raw}, section.where, section.folder)
        nested = isinstance(raw, list) and bool(raw) and isinstance(raw[0], list)
        inertia = again.matrix("inertia", "kg m^2") if nested else again.numbers("inertia", "kg m^2", length=3)
        centre = section.numbers("centre", "m", None, length=3)
        dofs = section.words("dofs", DOFS)
        return cls(name, mass, np.array(inertia), None if centre is None else np.array(centre), dofs)

    def receptance(self, omega: Array, ports: Array | None = None) -> ComplexArray:
        P = np.eye(6) if ports is None else ports
        return self.between(omega, P, P)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        accelerance = rows @ np.linalg.solve(self.second_order().mass, columns.T)
        return np.asarray(-accelerance / omega[:, None, None] ** 2 + 0j)

    def second_order(self) -> SecondOrder:
        mass = np.zeros((6, 6))
        mass[:3, :3] = self.mass * np.eye(3)
        mass[3:, 3:] = self.inertia
        return SecondOrder(mass, np.zeros((6, 6)), np.zeros((6, 6)), np.eye(6))

    def weight(self, gravity: Array) -> Array:
        """It acts at the centre of mass."""
        return np.concatenate([self.mass * gravity, np.zeros(3)])

    def motion_at(self, point: Array, direction: Array) -> Array:
        """n·(u + ϑ × ρ) = n·u + (ρ × n)·ϑ with ρ from the centre to the point."""
        assert self.centre is not None
        return np.concatenate([direction, np.cross(point - self.centre, direction)])
