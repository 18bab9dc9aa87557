"""What a describing function leaves out of a receptance, and how far that is known."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.balance import Balance
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.frequency_reach import reached
from ..harmonic_balance.truncation import more_harmonics, unsuited
from ..model.machine import Machine
from .forward import Answer, Forward

_SAMPLES = 256
_POINTS = 2048


_KNOWN = 0.5
"""Share of the estimate that stays in doubt."""
_NEAR_FOLD = 0.1
"""Share of the receptance above which the estimate is no correction any more: next to a fold it has no bound."""


def correction(forward: Forward, machine: Machine, answer: Answer) -> tuple[ComplexArray, Array]:
    """What further harmonics add to the first of the receptance, and what stays in doubt of it, m/N per point.

    Both are 0 where they cannot be told.

    The harmonics that the joints raise come back to the first through the joints' tangents: δz, and with it
    δx = −Hoz δg, where δz + Hzz δg = 0. ``answer`` holds the motions of all joints of the machine.
    """
    points = forward.points
    out: ComplexArray = np.zeros(len(points), dtype=complex)
    assembly = Assembly(machine, forward.responses, forward.drives)
    if not assembly.nonlinear or machine.static is not None or unsuited(assembly):
        return out, np.abs(out)
    moving = list(assembly.nonlinear)
    harmonics = more_harmonics(assembly, (1,))
    for drive in range(len(forward.drives)):
        own = Assembly(machine, forward.responses, (forward.drives[drive],))
        rows = np.flatnonzero((points.drive == drive) & answer.fine)
        rows = rows[reached(own.machine, 2 * np.pi * points.frequency[rows], harmonics)] if len(rows) else rows
        view = forward.view(tuple(moving))
        for begin in range(0, len(rows), _POINTS):
            now = rows[begin : begin + _POINTS]
            dz = _moved(own, 2 * np.pi * points.frequency[now], points.force[now], answer.z[now][:, moving], harmonics)
            back = np.linalg.pinv(view.Hzz[now]) @ dz[:, :, None]
            out[now] = (view.Hoz[now] @ back)[:, 0, 0] / points.force[now]
    out = np.where(np.isfinite(out), out, 0.0)
    size = np.abs(answer.receptance)
    wild = np.abs(out) > _NEAR_FOLD * size
    doubt = np.where(wild, np.minimum(np.abs(out), size), _KNOWN * np.abs(out))
    return np.where(wild, 0.0, out), doubt


def _moved(assembly: Assembly, omega: Array, force: Array, z: ComplexArray, harmonics: Harmonics) -> ComplexArray:
    """First harmonic of a Newton step in several harmonics from motions of one, m, (points, moving)."""
    balance = Balance.of(assembly, omega, force, harmonics)
    coordinates = assembly.coordinates
    start = np.zeros((len(omega), len(harmonics), len(coordinates.rows)), dtype=complex)
    start[:, 0] = coordinates.of_motions(z)
    forces = balance.forces(start, _SAMPLES)
    r = balance.residual(start, forces.force)
    r[:, 0] = 0.0
    return np.asarray(coordinates.motions(balance.tangent(forces).solve(-r)[:, 0]))
