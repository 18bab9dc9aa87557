"""The machine as a python-control system: blocks appended, joints closed by feedback."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.shown.progress import each

from ..deadline import in_time
from ..model.machine import Machine
from .state_equations import MachineStates

_AT_ONCE = 8
"""Lines between two looks at the time."""


def by_control(machine: Machine, states: MachineStates, rows: Array, K: Array, C: Array, omega: Array) -> ComplexArray:
    """Receptance between ``rows`` of the dofs from blocks per group of components, appended and closed by the joints.

    K (N/m) and C (N s/m) are those of the joints. Velocities come from the states: ż = C_z A x + C_z B f; a damped
    joint on a displacement that jumps with a force has none, see `_closed_on_jump`.
    """
    import control

    # Time is counted in units that make the fastest motion of order one: the states stay comparable.
    fastest = 2 * np.pi * float(np.max(states.natural_frequencies(np.maximum(K, 0.0)), initial=0.0)) or 1.0
    ports = np.concatenate([states.joints, rows])
    blocks = [
        control.ss(b.A / fastest, b.B @ ports.T / fastest, ports @ b.C, ports @ b.D @ ports.T) for b in states.blocks
    ]
    apart = control.append(*blocks)
    count, nj = len(ports), len(K)
    # Every block has all ports; the same force acts on all blocks and their motions add up.
    spread = np.tile(np.eye(count), (len(blocks), 1))
    plant = control.ss(apart.A, apart.B @ spread, spread.T @ apart.C, spread.T @ apart.D @ spread)
    open_joints, jump = [], float(np.max(np.abs(plant.D), initial=0.0))
    for j in range(nj):
        if C[j] and np.any(plant.D[j]):
            plant = _closed_on_jump(control, machine, plant, j, K[j], C[j] * fastest)
            plant.D[np.abs(plant.D) < 1e-12 * jump] = 0.0
        else:
            open_joints.append(j)
    # Damping after the closing above, so that no velocity is asked of what still jumps.
    damped = [j for j in open_joints if C[j]]
    if any(np.any(plant.D[j]) for j in damped):
        raise _jump(machine)
    speed = control.ss(
        plant.A,
        plant.B,
        np.concatenate([plant.C, plant.C[damped] @ plant.A]),
        np.concatenate([plant.D, plant.C[damped] @ plant.B]),
    )
    law = np.zeros((count, count + len(damped)))
    for j in open_joints:
        law[j, j] = K[j]
    for k, j in enumerate(damped):
        law[j, count + k] = C[j] * fastest
    closed = control.feedback(speed, control.ss([], [], [], law), sign=-1)
    # States scaled by powers of two: the same system, whose matrix is no larger than its poles are fast.
    balanced, (scale, _) = scipy.linalg.matrix_balance(closed.A, permute=False, separate=True)
    wanted = slice(nj, count)
    seen = control.ss(
        balanced, closed.B[:, wanted] / scale[:, None], closed.C[wanted] * scale, closed.D[wanted, wanted]
    )
    parts = []
    for start in each("groups of lines by python-control", range(0, len(omega), _AT_ONCE), -(-len(omega) // _AT_ONCE)):
        in_time()
        parts.append(seen(1j * omega[start : start + _AT_ONCE] / fastest, squeeze=False))
    return np.moveaxis(np.concatenate(parts, axis=2), 2, 0)


def _closed_on_jump(control: Any, machine: Machine, plant: Any, j: int, stiffness: float, damping: float) -> Any:
    """Close a damped joint whose displacement z = C_j x + D_jj f + … jumps with a force.

    The joint, c ż = g − k z, is then the integrator: it takes the force and gives the displacement. The plant is
    solved for the force f_j that makes the given z, which D_jj allows, and the two are closed by feedback.
    """
    jump = plant.D[j, j]
    if not abs(jump) > 1e-12 * np.max(np.abs(plant.D)):
        raise _jump(machine)
    others = [i for i in range(len(plant.D)) if i != j]
    B, row, D = plant.B[:, [j]], plant.C[[j]], plant.D
    # f_j = (z − C_j x − D_jo f_o)/D_jj. The plant now takes z in place of f_j and gives f_j in place of z.
    A = plant.A - B @ row / jump
    taken, given, feed = plant.B.copy(), plant.C.copy(), D.copy()
    taken[:, others] -= B @ D[[j]][:, others] / jump
    taken[:, [j]] = B / jump
    given[others] -= D[others][:, [j]] @ row / jump
    given[[j]] = -row / jump
    feed[np.ix_(others, others)] -= D[others][:, [j]] @ D[[j]][:, others] / jump
    feed[others, j] = D[others, j] / jump
    feed[j, others] = -D[j, others] / jump
    feed[j, j] = 1 / jump
    turned = control.ss(A, taken, given, feed)
    # The joint pulls back with g = −f_j + F_j, F_j the force from outside on this port, always zero here.
    size = len(D)
    gather, push = np.zeros((1, size)), np.zeros((size, 1))
    gather[0, j], push[j, 0] = 1.0, 1.0
    joint = control.ss([[-stiffness / damping]], gather / damping, push, np.zeros((size, size)))
    closed = control.feedback(turned, joint, sign=-1)
    # Outside forces on port j and its displacement are no longer of interest.
    keep = np.eye(size)
    keep[j, j] = 0.0
    return control.ss(closed.A, closed.B @ keep, keep @ closed.C, keep @ closed.D @ keep)


def _jump(machine: Machine) -> InputError:
    return InputError(
        f"{machine.where}: damped joints act on displacements that jump with a force in several directions at once "
        "(D of a state-space component), which the check cannot close; leave D out, or move the damping"
    )
