"""The tool point of a machine as modes, its joints linearised."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from jointlib.arrays import Array
from jointlib.errors import InputError

from ..assembly import Assembly
from ..machine import AXES, Machine
from ..operating import operating_point
from ..state_equations import machine_states
from .tool_model import ToolModel

_SAME = 1e-9
_INSTANT = 1e-12


def machine_model(machine: Machine, frequency: float, amplitude: float = 0.0) -> tuple[ToolModel, float]:
    """Modes of the tool point with every joint a spring and a damper, K = Re G and C = Im G/ω.

    G is the gain of the joint at rest (amplitude 0), or while the tool point vibrates with ``amplitude`` (m), at
    ``frequency`` (Hz). Also returns by how much the receptance of these modes differs from that of the machine over
    its band, relative to the largest: none where all joints are springs and dampers in truth.

    Raises `InputError` for machines with measured components or with joints that are rigid at rest.
    """
    states = machine_states(machine)
    omega = 2 * np.pi * np.array([frequency])
    K, C = (np.array(part) for part in _linearised(machine, omega, amplitude))
    if not (np.all(np.isfinite(K)) and np.all(np.isfinite(C))):
        raise InputError(f"{machine.where}: a joint is rigid at that amplitude, so it has no spring; use multi-frequency")
    axes = tuple(axis for axis in AXES if axis in machine.tool)
    rows = machine.dof_rows([machine.tool[axis] for axis in axes], "[tool]")
    A, B, out = (block_diag(*(getattr(b, key) for b in states.blocks)) for key in "ABC")
    copies = np.tile(np.eye(rows.shape[1]), (len(states.blocks), 1))
    B, out = B @ copies, copies.T @ out
    D = np.sum([b.D for b in states.blocks], axis=0)
    joints = states.joints
    if np.any(joints @ D) or np.any(D @ joints.T):
        raise InputError(f"{machine.where}: a joint sits where the displacement jumps with a force; use multi-frequency")
    speed = joints @ out @ A
    closed = A - B @ joints.T @ (K[:, None] * (joints @ out) + C[:, None] * speed)
    jump = np.abs(joints @ out @ B)[C != 0] if len(joints) else np.zeros(0)
    scale = np.max(np.abs(out), initial=0.0) * np.max(np.abs(B), initial=0.0)
    if np.any(jump > _INSTANT * scale):
        raise InputError(f"{machine.where}: a damper sits where the speed jumps with a force; use multi-frequency")
    model = ToolModel.from_states(closed, B @ rows.T, rows @ out, rows @ D @ rows.T, axes)
    return model, _difference(machine, model, amplitude)


def _linearised(machine: Machine, omega: Array, amplitude: float) -> tuple[Array, Array]:
    """K in N/m and C in N s/m of every joint at one frequency."""
    tool = tuple(machine.tool[axis] for axis in AXES if axis in machine.tool)
    joints = Assembly(machine, tool, tool).joints
    size = np.zeros(len(joints))
    if amplitude > 0:
        size = operating_point(machine, omega / (2 * np.pi), amplitude).joint_amplitude[0]
    gain = np.array([joint.first_harmonic(A, omega).gain.ravel()[0] for joint, A in zip(joints, size, strict=True)])
    return np.real(gain), np.imag(gain) / omega[0]


def _difference(machine: Machine, model: ToolModel, amplitude: float) -> float:
    if machine.frequency is None:
        return 0.0
    lines = np.linspace(*machine.frequency, 60)
    G = operating_point(machine, lines, amplitude).frf.receptance
    error = np.linalg.norm(model(lines) - G, axis=(1, 2))
    largest = np.max(np.linalg.norm(G, axis=(1, 2)))
    found = float(np.max(error) / largest)
    return 0.0 if found < _SAME else found
