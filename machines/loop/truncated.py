"""What a describing function leaves out of a receptance, as an allowance beside the noise."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..assembly import Assembly
from ..balance import Balance, solve_complex
from ..machine import Machine
from ..reach import reached
from ..truncation import more_harmonics, unsuited
from .forward import Answer, Forward

_SAMPLES = 256
_POINTS = 2048


def allowance(forward: Forward, machine: Machine, answer: Answer) -> Array:
    """abs(error) of the first harmonic of the receptance in m/N, per point; 0 where it cannot be told.

    The harmonics that the joints raise come back to the first through the joints' tangents: δz, and with it
    δx = −Hoz δg, where δz + Hzz δg = 0. ``answer`` holds the motions of all joints of the machine.
    """
    points = forward.points
    out = np.zeros(len(points))
    assembly = Assembly(machine, forward.responses, forward.drives)
    if not assembly.nonlinear or machine.static is not None or unsuited(assembly):
        return out
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
            out[now] = np.abs((view.Hoz[now] @ back)[:, 0, 0]) / points.force[now]
    return np.where(np.isfinite(out), out, 0.0)


def _moved(assembly: Assembly, omega: Array, force: Array, z: ComplexArray, harmonics: tuple[int, ...]) -> Array:
    """First harmonic of a Newton step in several harmonics from motions of one, m, (points, moving)."""
    balance = Balance.of(assembly, omega, force, harmonics)
    coordinates = assembly.coordinates
    start = np.zeros((len(omega), len(harmonics), len(coordinates.rows)), dtype=complex)
    start[:, 0] = coordinates.of_motions(z)
    forces = balance.forces(start, _SAMPLES)
    r = balance.residual(start, forces.force)
    r[:, 0] = 0.0
    return np.asarray(coordinates.motions(solve_complex(balance.jacobian(forces), -r)[:, 0]))
