"""Machine elements: the contacts of one carriage, bearing, screw or face together, and what they hold."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array

from ..indices import Index
from ..model.machine import Machine
from ..statics.working_point import tangents

_ASKED = 100.0
"""Hz at which a joint is asked for its stiffness and damping."""


@dataclass(frozen=True, eq=False)
class Element:
    """Contacts that stand for one thing; a connection outside any bundle is one by itself."""

    name: str
    kind: str
    """The kind of its bundle, empty without one."""
    sides: tuple[str, str]
    """Components, or the ground, on either side."""
    words: tuple[str, str]
    """The sides as the file has them."""
    rows: Index
    """Of its contacts among `Machine.flexible`."""
    at: Array | None
    """Their places in m, (contacts, 3); None where they act on named degrees of freedom."""
    direction: Array | None
    """Unit vectors, (contacts, 3)."""
    stiffness: Array
    """Tangent stiffness of every contact in N/m, as it is before any load."""
    damping: Array
    """N s/m."""

    @property
    def holds(self) -> Array:
        """Σ K n nᵀ in N/m, (3, 3): what it holds of translations."""
        assert self.direction is not None
        return np.asarray(self.direction.T @ (self.stiffness[:, None] * self.direction))

    @property
    def six(self) -> Array:
        """Stiffness of three translations (N/m) and of turning about the middle of its contacts (N m/rad), (6,)."""
        assert self.direction is not None
        assert self.at is not None
        weight = np.abs(self.stiffness)
        middle = np.average(self.at, axis=0, weights=weight) if np.any(weight) else np.mean(self.at, axis=0)
        turns = np.cross(self.at - middle, self.direction)
        return np.asarray(self.stiffness @ np.concatenate([self.direction, turns], axis=1) ** 2)


def elements(machine: Machine, by_place: bool = True) -> tuple[Element, ...]:
    """The elements of a machine whose joints are known; ``by_place`` tells carriages of one bundle apart."""
    if not machine.flexible or any(c.joint is None for c in machine.flexible):
        return ()
    gain = tangents(replace(machine, static=None), _ASKED)[0]
    groups: dict[tuple[str, str], list[int]] = {}
    for i, connection in enumerate(machine.flexible):
        bundle, _, kind = connection.bundle.rstrip(")").partition(" (")
        own = connection.name.partition(".")[0] if by_place else bundle
        groups.setdefault((own if kind else connection.name, kind), []).append(i)
    return tuple(_element(machine, name, kind, np.array(rows), gain[rows]) for (name, kind), rows in groups.items())


def _element(machine: Machine, name: str, kind: str, rows: Index, gain: Array) -> Element:
    contacts = [machine.flexible[i] for i in rows]
    placed = all(c.at is not None and c.direction is not None for c in contacts)
    n = np.array([c.direction for c in contacts], dtype=float) if placed else None
    between = contacts[0].between
    finite = np.where(np.isfinite(gain), gain, 0.0)
    return Element(
        name,
        kind,
        (between[0].partition(".")[0], between[1].partition(".")[0]),
        between,
        rows,
        np.array([c.at for c in contacts], dtype=float) if placed else None,
        None if n is None else n / np.linalg.norm(n, axis=1, keepdims=True),
        finite.real,
        finite.imag / (2 * np.pi * _ASKED),
    )
