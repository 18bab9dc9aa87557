"""Static compliance at the tool: how far it gives way to a constant force, joints at their tangents."""

from __future__ import annotations

import numpy as np

from ..components.mode_sum import modes as undamped
from ..harmonic_balance.assembly import Assembly
from ..statics.working_point import tangents
from .free_vibration import held_again
from .natural_modes import NaturalModes

_HELD = 1e-9
"""Share of the tool's motion below which it takes no part in a free one: rounding."""
_SLOW = 1e-3
"""Frequency at which machines with state equations are asked, as a share of their lowest: right to its square."""


def static_compliance(modes: NaturalModes) -> dict[str, float | None]:
    """Displacement of the tool along each axis per force along it at rest, m/N; None where nothing holds it there.

    Σ φ²/ω² over the undamped modes. Friction that sticks holds with the stiffness that it has before it slips.
    """
    machine = modes.machine
    axes, rows = machine.tool_axes, machine.dof_rows(machine.tool_dofs, "[tool]")
    if modes.equations is None:
        slow = np.array([_SLOW * float(np.min(modes.frequency, initial=1.0))])
        loose = np.max(np.abs(rows @ modes.free), axis=1, initial=0.0) > _HELD
        H = Assembly(machine, machine.tool_dofs, machine.tool_dofs).coupled(2 * np.pi * slow, tangents(machine, slow))
        own = np.diag(H[0]).real
    else:
        e, K = modes.equations, tangents(machine, 1.0)[0].real
        found = undamped(e.mass, e.stiffness + e.joints.T @ (K[:, None] * e.joints))
        squared, shapes = held_again(e, K, *found)
        moved, held = np.abs(rows @ e.shapes @ shapes), squared > 0
        loose = np.max(moved[:, ~held], axis=1, initial=0.0) > _HELD * np.max(moved, axis=1, initial=0.0)
        own = np.sum(moved[:, held] ** 2 / squared[held], axis=1)
    return {axis: None if loose[i] else float(own[i]) for i, axis in enumerate(axes)}
