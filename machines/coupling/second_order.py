"""Equations of motion of a whole machine, for the check by a second route and for natural frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..components.component import is_positive
from ..model.groups import groups
from ..model.machine import Machine


@dataclass(frozen=True, eq=False)
class MachineEquations:
    """M p̈ + C ṗ + K p = Φᵀ f, x = Φ p over all dofs of a machine, rigid connections eliminated, joints open.

    ``joints`` are the rows of the flexible connections in p: z = joints · p. ``blocks`` names, per group of
    components that rigid connections tie together, the entries of p that belong to it.
    """

    mass: Array
    damping: Array
    stiffness: Array
    shapes: Array
    joints: Array
    blocks: tuple[slice, ...]
    motions: Array
    """N: the components' own generalised coordinates q = N p, one component after the other."""

    def natural_frequencies(self, joint_stiffness: Array) -> Array:
        """Undamped natural frequencies in Hz, ascending, with these joint stiffnesses in N/m; free motions are 0."""
        K = self.stiffness + self.joints.T @ (np.asarray(joint_stiffness)[:, None] * self.joints)
        squared = scipy.linalg.eigh(K, self.mass, eigvals_only=True)
        floor = 1e-9 * max(float(np.max(np.abs(squared), initial=0.0)), 1e-300)
        return np.asarray(np.sqrt(np.where(np.abs(squared) < floor, 0.0, np.maximum(squared, 0.0))) / (2 * np.pi))


def machine_equations(machine: Machine) -> MachineEquations:
    """Assemble the components' matrices; a rigid connection removes one generalised coordinate.

    Constraints R Φ q = 0 are solved by q = N p with N an orthonormal null space, group by group.
    """
    parts = []
    for component in machine.components:
        part = component.second_order()
        if part is None:
            raise InputError(f"{machine.where}: component {component.name!r} has no equations of motion, only an FRF")
        parts.append(part)
    shapes = scipy.linalg.block_diag(*(p.shapes for p in parts))
    rigid = machine.rows([c for c in machine.connections if c.rigid]) @ shapes
    owner = np.repeat(np.arange(len(parts)), [len(p.mass) for p in parts])
    columns, blocks, start = [], [], 0
    for group in groups(rigid, owner, len(parts)):
        inside = np.flatnonzero(np.isin(owner, group))
        kept = motions(rigid[:, inside])
        placed = np.zeros((len(owner), kept.shape[1]))
        placed[inside] = kept
        columns.append(placed)
        blocks.append(slice(start, start + kept.shape[1]))
        start += kept.shape[1]
    N = np.concatenate(columns, axis=1)
    M, C, K = (scipy.linalg.block_diag(*(getattr(p, key) for p in parts)) for key in ("mass", "damping", "stiffness"))
    mass = N.T @ M @ N
    if not all(is_positive(mass[b, b]) for b in blocks):
        raise InputError(
            f"{machine.where}: the masses that rigid connections tie together lie too far apart for floats, expected "
            "ones of like size"
        )
    return MachineEquations(
        mass,
        N.T @ C @ N,
        N.T @ K @ N,
        shapes @ N,
        machine.rows(machine.flexible) @ shapes @ N,
        tuple(blocks),
        N,
    )


def motions(held: Array) -> Array:
    """Orthonormal motions that the rows ``held`` leave free, one per column."""
    rows = held[np.any(held != 0, axis=1)]
    return (
        scipy.linalg.null_space(rows / np.linalg.norm(rows, axis=1, keepdims=True))
        if len(rows)
        else np.eye(held.shape[1])
    )
