"""The tool point of a machine as modes, its joints linearised."""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError

from ..assembly import Assembly
from ..machine import AXES, Machine
from ..operating import operating_point
from ..state_equations import machine_states
from .tool_model import ToolModel

_SAME = 1e-6
"""Of the largest receptance; what modes far above the band are taken together costs less."""
_COMPARED = 7
_INSTANT = 1e-12


def modes_at_rest(machine: Machine) -> ToolModel | None:
    """Modes of the tool point at rest; None where the machine has none, or a joint is no spring and damper in truth.

    Joints are: every tangent K + jωC. That is found out by comparing with the machine's own receptance.
    """
    if machine.frequency is None:
        return None
    try:
        model = machine_model(machine, float(np.mean(machine.frequency)))
    except InputError:
        return None
    lines = np.linspace(*machine.frequency, _COMPARED)
    G = operating_point(machine, lines, 0.0).frf.receptance
    error = np.linalg.norm(model(lines) - G, axis=(1, 2))
    return model if np.all(error <= _SAME * np.max(np.linalg.norm(G, axis=(1, 2)))) else None


def machine_model(machine: Machine, frequency: float, gain: ComplexArray | None = None) -> ToolModel:
    """Modes of the tool point with every joint a spring and a damper, K = Re G and C = Im G/ω.

    G is the gain of a joint in N/m at ``frequency`` (Hz), by default that at rest. Raises `InputError` for machines
    with measured components and for joints that are rigid there.
    """
    states = machine_states(machine)
    omega = 2 * np.pi * frequency
    G = _at_rest(machine, omega) if gain is None else gain
    K, C = G.real, G.imag / omega
    if not (np.all(np.isfinite(K)) and np.all(np.isfinite(C))):
        raise InputError(f"{machine.where}: a joint is rigid at that amplitude; use multi-frequency")
    axes = tuple(axis for axis in AXES if axis in machine.tool)
    rows = machine.dof_rows([machine.tool[axis] for axis in axes], "[tool]")
    A, B, out = (block_diag(*(getattr(b, key) for b in states.blocks)) for key in "ABC")
    copies = np.tile(np.eye(rows.shape[1]), (len(states.blocks), 1))
    B, out = B @ copies, copies.T @ out
    D = np.sum([b.D for b in states.blocks], axis=0)
    joints = states.joints
    if np.any(joints @ D) or np.any(D @ joints.T):
        raise InputError(f"{machine.where}: a joint holds what jumps with a force; use multi-frequency")
    speed = joints @ out @ A
    closed = A - B @ joints.T @ (K[:, None] * (joints @ out) + C[:, None] * speed)
    jump = np.abs(joints @ out @ B)[C != 0] if len(joints) else np.zeros(0)
    scale = np.max(np.abs(out), initial=0.0) * np.max(np.abs(B), initial=0.0)
    if np.any(jump > _INSTANT * scale):
        raise InputError(f"{machine.where}: a damper holds what gains speed at once; use multi-frequency")
    return ToolModel.from_states(closed, B @ rows.T, rows @ out, rows @ D @ rows.T, axes)


def _at_rest(machine: Machine, omega: float) -> ComplexArray:
    """Gains of the joints in N/m at one frequency in rad/s, at rest."""
    tool = tuple(machine.tool[axis] for axis in AXES if axis in machine.tool)
    joints = Assembly(machine, tool, tool).joints
    return np.array([complex(joint.first_harmonic(0.0, omega).gain) for joint in joints], dtype=complex)
