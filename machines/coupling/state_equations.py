"""First-order equations of a machine with components that have no second-order ones, rigid connections eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..components.component import FirstOrder, SecondOrder
from ..components.mode_sum import modes
from ..model.groups import groups
from ..model.machine import Machine
from .second_order import motions

_RANK = 1e-9
_SLOW = 1e-6
"""Share of the fastest ω² below which a mode is scaled as if it were at that share."""


@dataclass(frozen=True, eq=False)
class MachineStates:
    """State equations of every group of components that rigid connections tie together, joints open.

    Every block takes forces on all dofs of the machine and adds to the motion of all of them; ``joints`` are the
    rows of the flexible connections over the dofs.
    """

    blocks: tuple[FirstOrder, ...]
    joints: Array

    def natural_frequencies(self, joint_stiffness: Array) -> Array:
        """Size of the oscillating poles in Hz, ascending, with these joint stiffnesses in N/m; free motions are 0."""
        A, B, C = (scipy.linalg.block_diag(*(getattr(b, key) for b in self.blocks)) for key in "ABC")
        copies = np.tile(np.eye(self.joints.shape[1]), (len(self.blocks), 1))
        Bz, Cz = B @ copies @ self.joints.T, self.joints @ copies.T @ C
        Dzz = self.joints @ sum(b.D for b in self.blocks) @ self.joints.T
        K = np.diag(np.asarray(joint_stiffness, dtype=float))
        poles = np.linalg.eigvals(A - Bz @ K @ np.linalg.solve(np.eye(len(K)) + Dzz @ K, Cz))
        largest = float(np.max(np.abs(poles), initial=0.0))
        free = np.abs(poles) < 1e-5 * largest
        kept = poles[free | (poles.imag > 1e-9 * largest)]
        found = np.where(np.abs(kept) < 1e-5 * largest, 0.0, np.abs(kept))
        return np.asarray(np.sort(found) / (2 * np.pi))


def machine_states(machine: Machine) -> MachineStates:
    """Assemble the components' state equations, group by group.

    Rigid connections between components with second-order equations are eliminated there, as `machine_equations`
    does; those that hold a component with states only, in the states.
    """
    sizes = [len(c.dofs) for c in machine.components]
    starts = np.cumsum([0, *sizes])
    owner = np.repeat(np.arange(len(sizes)), sizes)
    rigid = machine.rows([c for c in machine.connections if c.rigid])
    seconds = [c.second_order() for c in machine.components]
    of_states = np.array([second is None for second in seconds])
    hard = np.array([bool(np.any(row[of_states[owner]] != 0)) for row in rigid], dtype=bool)
    easy = groups(rigid[~hard], owner, len(sizes))
    blocks = []
    for group in groups(rigid, owner, len(sizes)):
        inside = np.concatenate([np.arange(starts[i], starts[i + 1]) for i in group])
        parts = []
        for family in (family for family in easy if set(family) <= set(group)):
            own = np.concatenate([np.arange(starts[i], starts[i + 1]) for i in family])
            found = (
                _states(machine, family[0])
                if seconds[family[0]] is None
                else _joined([second for i in family if (second := seconds[i]) is not None], rigid[~hard][:, own])
            )
            parts.append((found, own))
        whole = FirstOrder(*(scipy.linalg.block_diag(*(getattr(p, key) for p, _ in parts)) for key in "ABCD"))
        order = np.concatenate([own for _, own in parts])
        whole = _held(machine, whole, rigid[hard][:, order][np.any(rigid[hard][:, inside] != 0, axis=1)])
        placed = np.zeros((len(order), len(machine.dofs)))
        placed[np.arange(len(order)), order] = 1.0
        blocks.append(FirstOrder(whole.A, whole.B @ placed, placed.T @ whole.C, placed.T @ whole.D @ placed))
    return MachineStates(tuple(blocks), machine.rows(machine.flexible))


def _states(machine: Machine, index: int) -> FirstOrder:
    component = machine.components[index]
    first = component.first_order()
    if first is None:
        raise InputError(f"{machine.where}: component {component.name!r} has no equations of motion, only an FRF")
    return first


def _joined(parts: Sequence[SecondOrder], rows: Array) -> FirstOrder:
    """Components that these rows over their dofs hold together."""
    M, C, K, shapes = (
        scipy.linalg.block_diag(*(getattr(p, k) for p in parts)) for k in ("mass", "damping", "stiffness", "shapes")
    )
    N = motions(rows @ shapes)
    return as_first_order(SecondOrder(N.T @ M @ N, N.T @ C @ N, N.T @ K @ N, shapes @ N))


def as_first_order(model: SecondOrder) -> FirstOrder:
    """In modal coordinates r the states are ω_r r and ṙ, so that slow modes keep their digits beside fast ones."""
    squared, shapes, fastest = modes(model.mass, model.stiffness)
    scale = np.sqrt(np.maximum(squared, _SLOW * fastest))
    n, S = len(squared), model.shapes @ shapes
    ports, zero = len(S), np.zeros((n, n))
    A = np.block([[zero, np.diag(scale)], [np.diag(-squared / scale), -shapes.T @ model.damping @ shapes]])
    return FirstOrder(
        A,
        np.concatenate([np.zeros((n, ports)), S.T]),
        np.concatenate([S / scale, np.zeros((ports, n))], axis=1),
        np.zeros((ports, ports)),
    )


def _held(machine: Machine, free: FirstOrder, rows: Array) -> FirstOrder:
    """The same with rows · x = 0, held by forces λ along the rows.

    Where λ does not appear in a constraint, the constraint binds the states and its time derivative is the next one
    (Silverman's structure algorithm); for masses that takes two derivatives. What is left determines λ.
    """
    if not len(rows):
        return free
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    B_held = free.B @ rows.T
    motion, own, other = rows @ free.C, rows @ free.D @ rows.T, rows @ free.D
    # Each row is measured against what it could be, so that a rank is one of physics and not of units.
    reach = np.linalg.norm(B_held)
    size = np.linalg.norm(motion, axis=1) * reach / (np.linalg.norm(free.A, 2) or 1.0) + np.linalg.norm(own, axis=1)
    bound: list[Array] = []
    while True:
        if not np.all(size > 0) or len(bound) > len(free.A):
            raise InputError(f"{machine.where}: the rigid connections ask for motions that the components cannot make")
        motion, own, other = (m / size[:, None] for m in (motion, own, other))
        U, singular, _ = np.linalg.svd(own)
        rank = int(np.sum(singular > _RANK))
        if rank == len(own):
            break
        motion, own, other = (U.T @ m for m in (motion, own, other))
        if np.any(np.abs(other[rank:]) > _RANK * max(1.0, float(np.max(np.abs(other))))):
            raise InputError(f"{machine.where}: the rigid connections leave a displacement that jumps with a force")
        loose = motion[rank:]
        bound.append(loose)
        size = np.concatenate([np.ones(rank), np.linalg.norm(loose, axis=1) * reach])
        motion, own, other = (
            np.concatenate([kept[:rank], loose @ fresh])
            for kept, fresh in ((motion, free.A), (own, B_held), (other, free.B))
        )
    by_state, by_force = np.linalg.solve(own, motion), np.linalg.solve(own, other)
    stack = np.concatenate(bound) if bound else np.zeros((0, len(free.A)))
    N = (
        scipy.linalg.null_space(stack / np.linalg.norm(stack, axis=1, keepdims=True))
        if len(stack)
        else np.eye(len(free.A))
    )
    return FirstOrder(
        N.T @ (free.A - B_held @ by_state) @ N,
        N.T @ (free.B - B_held @ by_force),
        (free.C - free.D @ rows.T @ by_state) @ N,
        free.D - free.D @ rows.T @ by_force,
    )
