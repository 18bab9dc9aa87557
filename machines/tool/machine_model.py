"""The tool point of a machine as modes, its joints linearised."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ..coupling.state_equations import machine_states
from ..indices import Mask
from ..model.machine import Machine
from ..statics.working_point import tangents
from .tool_model import ToolModel

_INSTANT = 1e-12
_TOGETHER = 2**19
"""Entries of the matrices decomposed at once."""


def machine_model(machine: Machine, frequency: float, gain: ComplexArray | None = None) -> ToolModel:
    """Modes of the tool point with every joint a spring and a damper, K = Re G and C = Im G/ω.

    G is the gain of a joint in N/m at ``frequency`` (Hz), by default that at rest. Raises `InputError` for machines
    with measured components and for joints that are rigid there.
    """
    gains = tangents(machine, frequency) if gain is None else gain[None]
    return OpenJoints.of(machine).models(gains, frequency)[0]


@dataclass(frozen=True, eq=False)
class OpenJoints:
    """A machine with every joint open: ẋ = Ax + B·F, the tool at Cx + D·F, and what its joints see of it."""

    where: str
    axes: tuple[str, ...]
    A: Array
    B: Array
    C: Array
    D: Array
    push: Array
    """Of the forces of the joints on the states, (n, joints)."""
    stretch: Array
    """Displacements of the joints by the states, (joints, n)."""
    speed: Array
    """Their time derivatives."""
    jumps: Mask
    """Joints that some force gives a speed at once."""

    @classmethod
    def of(cls, machine: Machine) -> OpenJoints:
        """From the equations of motion of the components; `InputError` where one has none."""
        states = machine_states(machine)
        rows = machine.dof_rows(machine.tool_dofs, "[tool]")
        A, B, out = (scipy.linalg.block_diag(*(getattr(b, key) for b in states.blocks)) for key in "ABC")
        copies = np.tile(np.eye(rows.shape[1]), (len(states.blocks), 1))
        B, out = B @ copies, copies.T @ out
        D = np.sum([b.D for b in states.blocks], axis=0)
        joints = states.joints
        if np.any(joints @ D) or np.any(D @ joints.T):
            raise InputError(f"{machine.where}: a joint holds what jumps with a force; use multi-frequency")
        stretch = joints @ out
        scale = np.max(np.abs(out), initial=0.0) * np.max(np.abs(B), initial=0.0)
        jumps = np.any(np.abs(stretch @ B) > _INSTANT * scale, axis=1)
        return cls(
            machine.where,
            machine.tool_axes,
            A,
            B @ rows.T,
            rows @ out,
            rows @ D @ rows.T,
            B @ joints.T,
            stretch,
            stretch @ A,
            jumps,
        )

    def models(self, gain: ComplexArray, frequency: float) -> list[ToolModel]:
        """Modes of the tool point with joints of these gains in N/m, (models, joints), at a frequency in Hz."""
        K, C = gain.real, gain.imag / (2 * np.pi * frequency)
        if not (np.all(np.isfinite(K)) and np.all(np.isfinite(C))):
            raise InputError(f"{self.where}: a joint is rigid at that amplitude; use multi-frequency")
        if np.any(self.jumps & (C != 0)):
            raise InputError(f"{self.where}: a damper holds what gains speed at once; use multi-frequency")
        models: list[ToolModel] = []
        together = max(1, _TOGETHER // max(self.A.size, 1))
        for first in range(0, len(gain), together):
            k, c = (part[first : first + together, :, None] for part in (K, C))
            closed = self.A - self.push @ (k * self.stretch + c * self.speed)
            models += ToolModel.several(closed, self.B, self.C, self.D, self.axes)
        return models
