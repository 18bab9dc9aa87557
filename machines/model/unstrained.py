"""How a part known by its matrices moves while nothing strains it, beside how its nodes move as one rigid body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..components.matrices import Matrices
from ..components.mode_sum import modes
from ..components.nodes import DIRECTIONS

_RANK = 1e-6
_SAME = 1e-3
"""Share of a translation that the motions without strain may miss where it tells a mass."""


@dataclass(frozen=True, eq=False)
class Unstrained:
    """Motions of the named dofs that store no energy, each with the mass matrix as the identity."""

    part: Matrices
    shapes: Array
    """(dofs, motions)."""

    @classmethod
    def of(cls, part: Matrices) -> Unstrained | None:
        """None where its matrices tie it to the ground, or tell no modes."""
        equations = part.second_order()
        try:
            squared, shapes, _ = modes(equations.mass, equations.stiffness)
        except InputError:
            return None
        free = squared == 0
        return cls(part, equations.shapes @ shapes[:, free]) if np.any(free) else None

    @property
    def mass(self) -> tuple[float | None, Array | None]:
        """kg, and the centre of gravity in m, machine axes: rᵀ M r of the rigid motions r of the nodes.

        None where the named dofs do not tell every motion without strain, or none of these is a translation.
        """
        rank = int(np.linalg.matrix_rank(self.shapes, tol=_RANK * float(np.linalg.norm(self.shapes, 2))))
        words = [dof.rpartition(".")[2] for dof in self.part.dofs]
        shifts = [np.array([float(word == axis) for word in words]) for axis in DIRECTIONS[:3]]
        told = []
        for shift in shifts:
            weights = np.linalg.lstsq(self.shapes, shift, rcond=None)[0]
            missed = np.linalg.norm(self.shapes @ weights - shift)
            told.append(weights if np.any(shift) and missed <= _SAME * np.linalg.norm(shift) else None)
        known = [weights for weights in told if weights is not None]
        if rank < self.shapes.shape[1] or not known:
            return None, None
        mass = float(np.mean([weights @ weights for weights in known]))
        turned = self.turns()
        if len(known) < 3 or turned is None:
            return mass, None
        whole = np.linalg.lstsq(self.shapes, turned, rcond=None)[0]
        if np.any(np.linalg.norm(self.shapes @ whole - turned, axis=0) > _SAME * np.linalg.norm(turned, axis=0)):
            return mass, None
        # Of rotations about the axes through the origin and of translations: m (0 −c_z c_y, …).
        coupled = np.array(known) @ whole
        return mass, np.array([coupled[1, 2], coupled[2, 0], coupled[0, 1]]) / mass

    def turns(self) -> Array | None:
        """Rotations of all nodes about the machine axes, (dofs, 3); None where the place of one is not known."""
        moved = rigid(self.part)
        return None if moved is None or np.any(np.isnan(moved)) else moved[:, 3:]


def rigid(part: Matrices) -> Array | None:
    """Translations along and rotations about the machine axes, (dofs, 6); nan on nodes whose place is not known."""
    if part.nodes is None:
        return None
    out = np.full((len(part.dofs), 6), np.nan)
    for i, dof in enumerate(part.dofs):
        name, _, word = dof.rpartition(".")
        if name in part.nodes.names and word in DIRECTIONS:
            at, axis = part.nodes.positions[part.nodes.names.index(name)], DIRECTIONS.index(word)
            out[i] = 0.0
            if axis < 3:
                out[i, axis] = 1.0
                out[i, 3:] = np.cross(np.eye(3), at)[:, axis]
            else:
                out[i, axis] = 1.0
    return out
