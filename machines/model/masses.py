"""Masses and centres of gravity of the parts of a machine, as far as they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..components.beam import Beam
from ..components.component import Component
from ..components.matrices import Matrices
from ..components.modal import Modal
from ..components.riding import Riding
from ..components.rigid import Rigid
from .machine import Machine
from .unstrained import Unstrained


@dataclass(frozen=True, eq=False)
class PartMass:
    """Mass of a part in kg and its centre in m, machine axes; None where a part does not tell."""

    name: str
    mass: float | None
    centre: Array | None


def part_masses(machine: Machine) -> tuple[PartMass, ...]:
    """Of every component, in order."""
    return tuple(PartMass(part.name, *_of(part)) for part in machine.components)


def whole_mass(parts: tuple[PartMass, ...]) -> PartMass:
    """All parts whose mass is known together; the centre is that of those that tell theirs, None if any does not."""
    known = [p for p in parts if p.mass is not None]
    total = float(sum(p.mass for p in known if p.mass is not None))
    if not known or any(p.centre is None for p in known):
        return PartMass("whole", total or None, None)
    moment = np.sum([p.mass * p.centre for p in known if p.mass is not None and p.centre is not None], axis=0)
    return PartMass("whole", total, np.asarray(moment / total))


def _of(part: Component) -> tuple[float | None, Array | None]:
    if isinstance(part, Rigid | Riding):
        return part.mass, part.centre
    if isinstance(part, Modal):
        return part.mass, None
    if isinstance(part, Beam):
        assert part.start is not None
        ends = np.cumsum([0.0, *(s.length for s in part.segments)])
        mass = np.array([s.material.density * s.profile.area * s.length for s in part.segments])
        middle = float(mass @ (ends[1:] + ends[:-1]) / 2 / np.sum(mass))
        return float(np.sum(mass)), np.asarray(part.start + middle * part.frame[0])
    if isinstance(part, Matrices):
        free = Unstrained.of(part)
        return (None, None) if free is None else free.mass
    return None, None
