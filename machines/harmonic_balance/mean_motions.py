"""The motions of several joints and their means at once, one harmonic: by secants, else by Newton's method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError

from ..model.machine import Machine
from ..statics.statics import static_point
from .assembly import Assembly
from .balance import Balance
from .newton import FULL, Effort, Problem, Solution
from .secants import by_secants
from .view import View

_RAMP = 12


def solve_with_means(
    assembly: Assembly, view: View, force: Array, start: ComplexArray | None, ramp: bool, effort: Effort = FULL
) -> Solution:
    """As `nonlinear.solve` for joints whose means move: from the linear response, else with the force raised in steps.

    Parameters
    ----------
    view
        One line per point.
    start
        Motions of the joints in m, (points, nj), their means at rest.
    """
    biased, c, joints = assembly.biased, view.coordinates, assembly.moving
    assert biased is not None
    problem = Problem.of(view, joints, np.ones(len(force)), np.full(len(joints), np.inf))
    begun = problem.driven * force[:, None] if start is None else c.of_motions(start)
    held = by_secants(problem, begun, force, lambda lines, _q, _gain: force[lines], effort.left)
    left = np.flatnonzero(~held.settled)
    Z, gain, done = c.motions(held.q), held.gain, held.settled
    turning = np.zeros(len(force), dtype=bool)
    if len(left):
        found = _newton(assembly, view.at(left), force[left], None if start is None else begun[left], ramp)
        Z[left], gain[left], done[left], turning[left] = found.z, found.gain, found.converged, found.turning
    return Solution(Z, gain, done, turning, c)


def _newton(assembly: Assembly, view: View, force: Array, start: ComplexArray | None, ramp: bool) -> Solution:
    biased, c = assembly.biased, view.coordinates
    assert biased is not None
    held = view if np.all(np.diff(view.omega) >= 0) else None
    balance = Balance.of(assembly, view.omega, force, (1, 0), held)
    first = balance.driven * force[:, None] if start is None else start
    z, done = balance.settle(np.stack([first, np.zeros_like(first)], axis=1))
    left = np.flatnonzero(~done) if ramp else np.arange(0)
    share = np.array([1.0, 1.0])[:, None]
    s = np.stack([balance.driven[left] * force[left, None] / _RAMP, np.zeros_like(first[left])], axis=1)
    for k in range(1, _RAMP + 1):
        part = balance.at(left)
        s, fine = replace(part, force=part.force * k / _RAMP).settle(s)
        left, s = left[fine], s[fine]
        share[:, 0] = (k + 1) / k, ((k + 1) / k) ** 2
        if k < _RAMP:
            s = s * share
    z[left], done[left] = s, True
    Z, shift = c.motions(z[:, 0]), c.motions(z[:, 1]).real
    gain = biased.slopes(np.abs(Z), view.omega, shift).gain
    turning = np.linalg.slogdet(balance.jacobian(balance.forces(z)))[0] < 0
    return Solution(Z, gain, done, turning, c)


def mean_displacement(machine: Machine, amplitude: ArrayLike, frequency: ArrayLike) -> Array:
    """Where the joints of a machine under static load stand while they vibrate, m, (points, connections).

    Parameters
    ----------
    amplitude
        Of every flexible connection in m, (points, connections), as the absolute values of `Branch.joint`.
    frequency
        Hz, (points,).
    """
    if machine.static is None:
        raise InputError(f"{machine.where}: no [static] section, so joints vibrate about zero")
    assembly = Assembly(machine, (), ())
    A = np.atleast_2d(np.asarray(amplitude, dtype=float))
    rest = static_point(machine).displacement
    if assembly.biased is None:
        return np.tile(rest, (len(A), 1))
    omega = 2 * np.pi * np.broadcast_to(np.asarray(frequency, dtype=float), len(A))
    return rest + assembly.biased.everywhere(A[:, list(assembly.nonlinear)], omega)
