"""A connection: one scalar relative displacement between two sides of a machine, and the joint that acts along it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.joint import Joint

from .component import Component
from .static_load import turns

GROUND = "ground"
_OF_MOMENTS = {
    "N/m": "N m/rad",
    "N s/m": "N m s/rad",
    "N": "N m",
    "m": "rad",
    "m/s": "rad/s",
    "N/m^3": "N m/rad^3",
    "N/m^2": "N m/rad^2",
}


def units_between(sides: Sequence[str]) -> Mapping[str, str]:
    """The units of moments by those that joints are given in, where the sides are rotations; else none."""
    return _OF_MOMENTS if all(turns(side) for side in sides if side != GROUND) else {}


@dataclass(frozen=True)
class Identify:
    """The joint is still to be identified, from these measurement files and from this starting joint."""

    records: tuple[Path, ...]
    start: Path | None = None


@dataclass(frozen=True)
class Connection:
    """z = x_p − x_q along one line; the joint pulls with −f on the first side and +f on the second.

    Parameters
    ----------
    between
        Two sides, each ``component.dof``, ``"ground"`` or the name of a component with a shape in space: a
        rigid body, or a beam or matrices at one of their nodes.
    joint
        Restoring force along z; None where ``rigid`` holds z at zero, or where ``identify`` says how to get it.
    at, direction
        Point (m, machine axes) and direction on which such a component is held; the direction is made a unit vector.
    turns
        z is then the relative rotation about the direction, in rad, of what lies at the point on either side.
    """

    name: str
    between: tuple[str, str]
    joint: Joint | None = None
    rigid: bool = False
    identify: Identify | None = None
    at: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    turns: bool = False

    def __post_init__(self) -> None:
        where = f"connection {self.name!r}"
        if not re.fullmatch(r"\w[\w .-]*", self.name):
            raise InputError(f"{where}: expected a name of letters, digits, blanks, '_', '-' and '.', as files get it")
        if len(self.between) != 2 or not all(isinstance(side, str) for side in self.between):
            raise InputError(f"{where}: between is {self.between!r}, expected two sides")
        if self.between[0] == self.between[1]:
            raise InputError(f"{where}: both sides are {self.between[0]!r}, expected two different ones")
        given = [self.joint is not None or self.identify is not None, self.rigid]
        if sum(given) != 1:
            found = "neither" if not any(given) else "both"
            raise InputError(f"{where}: {found} a joint and rigid = true, expected one of joint, identify or rigid")
        if (self.at is None) != (self.direction is None):
            raise InputError(f"{where}: expected at and direction together, or neither")
        if self.direction is not None and not np.linalg.norm(self.direction) > 0:
            raise InputError(f"{where}: direction is {list(self.direction)}, expected a vector that is not zero")

    @property
    def bundle(self) -> str:
        """The bundle that made it and its kind, ``x_guide (linear-guide)``; empty for one that stands alone."""
        return str(self.joint.provenance.get("bundle", "")) if self.joint is not None else ""

    @property
    def rotates(self) -> bool:
        """Whether z is an angle in rad, and the joint's force a moment."""
        return self.turns or all(turns(side) for side in self.between if side != GROUND)

    def own_unit(self, unit: str) -> str:
        """The unit of a parameter of its joint, which for an angle is that of a moment: N m/rad for N/m."""
        return _OF_MOMENTS.get(unit, unit) if self.rotates else unit

    def row(self, components: Sequence[Component]) -> Array:
        """Row of B: z = B x over the dofs of all components in their order; a lever arm adds ρ × n."""
        where = f"connection {self.name!r}"
        rows = [self._side(side, components, where) for side in self.between]
        bodies = any(side != GROUND and "." not in side for side in self.between)
        if self.at is not None and not bodies:
            raise InputError(f"{where}: at and direction are given, but neither side is the name of a component alone")
        return rows[0] - rows[1]

    def _side(self, side: str, components: Sequence[Component], where: str) -> Array:
        if side == GROUND:
            return np.zeros(sum(len(c.dofs) for c in components))
        if "." in side:
            return unit_row(side, components, where)
        known: Mapping[str, Component] = {c.name: c for c in components}
        if side not in known:
            raise InputError(f"{where}: no component {side!r}, {nearest(side, [*known, GROUND])}")
        if self.at is None or self.direction is None:
            dofs = ", ".join(f"{side}.{dof}" for dof in known[side].dofs)
            raise InputError(f"{where}: side {side!r} needs a dof ({dofs}) or at and direction")
        direction = np.array(self.direction, dtype=float)
        motion = known[side].rotation_at if self.turns else known[side].motion_at
        held = motion(np.array(self.at, dtype=float), direction / np.linalg.norm(direction))
        if (
            held is None
            and self.turns
            and known[side].motion_at(np.array(self.at, dtype=float), np.eye(3)[0]) is not None
        ):
            raise InputError(f"{where}: component {side!r} has no rotation there, so expected holds without rotations")
        if held is None:
            raise InputError(f"{where}: component {side!r} has no shape in space, so its side must name a dof")
        before = [c is known[side] for c in components].index(True)
        pieces = [np.zeros(len(c.dofs)) for c in components]
        pieces[before] = held
        return np.concatenate(pieces)


def motion_row(motion: str, components: Sequence[Component], where: str) -> Array:
    """The row of one ``component.dof``, or of the motion of one relative to another, ``component.dof - component.dof``.

    A force on a relative motion acts on the first and, the other way round, on the second.
    """
    first, minus, second = motion.partition(" - ")
    row = unit_row(first, components, where)
    return row - unit_row(second, components, where) if minus else row


def unit_row(dof: str, components: Sequence[Component], where: str) -> Array:
    """The row that picks one ``component.dof``; an unknown name is refused with the nearest one."""
    names = [f"{c.name}.{d}" for c in components for d in c.dofs]
    if dof not in names:
        raise InputError(f"{where}: no degree of freedom {dof!r}, {nearest(dof, names)}")
    row = np.zeros(len(names))
    row[names.index(dof)] = 1.0
    return row
