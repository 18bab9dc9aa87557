"""Solutions of the forced response on a set of lines, by the amplitude map or by Newton's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..blocks import blocks
from ..harmonic_balance import newton as nonlinear
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.mean_motions import solve_with_means
from ..harmonic_balance.view import View
from ..indices import Index, Mask, Reasons
from ..model.limits import past_limits
from ..statics.bias import Together
from . import amplitude_map


@dataclass(frozen=True, eq=False)
class Solutions:
    """Every solution found: one row each, sorted by force, line and amplitude, beside the table of lines."""

    frequency: Array
    """Lines in Hz, (lines,), ascending."""
    regular: Mask
    """True for lines that belong in an FRF; the others only close a branch at its fold."""
    cut: Mask
    """(forces, lines): a solution is missing there because of a limit or because none was found."""
    reasons: Reasons
    """(forces, lines): the outcome that explains ``cut``."""
    force: Index
    """Index of the force, (solutions,)."""
    line: Index
    """Index of the line, (solutions,)."""
    size: Array
    """Amplitude of the nonlinear joint in m (of the largest where there are several), (solutions,)."""
    rising: Mask
    """True where no fold was passed."""
    motion: ComplexArray
    """Phasors of all joints and then of the outputs in m, (solutions, motions)."""

    def merged(self, other: Solutions) -> Solutions:
        """Solutions on the lines of both; lines of ``other`` that are already there are left out."""
        new = np.flatnonzero(~np.isin(other.frequency, self.frequency))
        keep = np.isin(other.line, new)
        frequency = np.concatenate([self.frequency, other.frequency[new]])
        order = np.argsort(frequency)
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        moved = np.full(len(other.frequency), -1)
        moved[new] = np.arange(len(self.frequency), len(frequency))
        force = np.concatenate([self.force, other.force[keep]])
        line = place[np.concatenate([self.line, moved[other.line[keep]]])]
        size = np.concatenate([self.size, other.size[keep]])
        rows = np.lexsort((size, line, force))
        return Solutions(
            frequency[order],
            np.concatenate([self.regular, other.regular[new]])[order],
            np.concatenate([self.cut, other.cut[:, new]], axis=1)[:, order],
            np.concatenate([self.reasons, other.reasons[:, new]], axis=1)[:, order],
            force[rows],
            line[rows],
            size[rows],
            np.concatenate([self.rising, other.rising[keep]])[rows],
            np.concatenate([self.motion, other.motion[keep]])[rows],
        )

    def counts(self) -> Index:
        """Number of solutions, (forces, lines)."""
        lines = self.cut.shape[1]
        counts = np.bincount(self.force * lines + self.line, minlength=self.cut.size)
        return np.asarray(counts).reshape(self.cut.shape)


def by_amplitude_map(assembly: Assembly, forces: Array, frequency: Array, count: int) -> Solutions:
    """All solutions of a machine with one nonlinear joint."""
    index = assembly.nonlinear[0]
    joint = assembly.joints[index]
    view = assembly.at(2 * np.pi * frequency)
    found = amplitude_map.roots(view, joint, forces, assembly.limits[0], count)
    there = view.at(found.line)
    F = forces[found.force]
    driven = there.Hzf[:, 0, 0] * F
    z = driven / (1 + there.Hzz[:, 0, 0] * found.gain)
    # The amplitude was solved for; only the phase is taken from here.
    z *= found.amplitude / np.maximum(np.abs(z), 1e-300)
    motion = there.Hof[:, :, 0] * F[:, None] - there.Hoz[:, :, 0] * (found.gain * z)[:, None]
    motion[:, index] = z
    return Solutions(
        frequency,
        np.ones(len(frequency), dtype=bool),
        found.cut,
        np.broadcast_to(np.array(found.reasons, dtype=object), found.cut.shape),
        found.force,
        found.line,
        found.amplitude,
        found.rising,
        motion,
    )


def by_newton(assembly: Assembly, forces: Array, frequency: Array) -> Solutions:
    """One solution per force and line for any number of nonlinear joints, from the linear response."""
    lines, count = len(frequency), len(forces)
    force, line = np.repeat(np.arange(count), lines), np.tile(np.arange(lines), count)
    motion, size, fine, rising, why = balance_at(assembly, frequency[line], forces[force])
    return Solutions(
        frequency,
        np.ones(lines, dtype=bool),
        ~fine.reshape(count, lines),
        why.reshape(count, lines),
        force[fine],
        line[fine],
        size[fine],
        rising[fine],
        motion[fine],
    )


def balance(
    assembly: Assembly, view: View, force: Array, start: ComplexArray | None = None, ramp: bool = True
) -> tuple[ComplexArray, Array, Mask, Mask, Reasons]:
    """Newton's method at points of a view: motions, size, whether it may be used, no fold passed, and why not."""
    points = len(force)
    if not assembly.nonlinear:
        fine, why = np.ones(points, dtype=bool), np.full(points, Outcome.STALLED, dtype=object)
        return assembly.moved(view.omega, force, view.Hzf[:, :, 0]), np.zeros(points), fine, fine, why
    found, fine, why = joints_balanced(assembly, view, force, start, ramp)
    motion = assembly.moved(view.omega, force, found.force)
    motion[:, list(assembly.nonlinear)] = found.z
    return motion, np.max(np.abs(found.z), axis=1), fine, ~found.turning, why


def joints_balanced(
    assembly: Assembly,
    view: View,
    force: Array,
    start: ComplexArray | None = None,
    ramp: bool = True,
    effort: nonlinear.Effort = nonlinear.FULL,
) -> tuple[nonlinear.Solution, Mask, Reasons]:
    """Newton's method at points of a view, which may be one without motions: joints, whether they may be used, and
    why not."""
    joints, why = assembly.moving, np.full(len(force), Outcome.STALLED, dtype=object)
    if isinstance(joints, Together):
        found = solve_with_means(assembly, view, force, start, ramp, effort)
    else:
        found = nonlinear.solve(view, joints, force, caps_of(assembly), start, ramp, effort)
    fine = found.converged.copy()
    for wrong, outcome in past_limits(assembly.limits, found.z, found.gain):
        why[wrong & fine] = outcome
        fine &= ~wrong
    return found, fine, why


def balance_at(
    assembly: Assembly, frequency: Array, force: Array, start: ComplexArray | None = None, ramp: bool = True
) -> tuple[ComplexArray, Array, Mask, Mask, Reasons]:
    """As `balance` at frequencies in Hz, without holding the receptances of all of them at a time."""
    parts = []
    lines, place = np.unique(frequency, return_inverse=True)
    order = np.argsort(place, kind="stable")
    count = np.bincount(place, minlength=len(lines))
    ends = np.concatenate([[0], np.cumsum(count)])
    most = int(np.max(count, initial=1))
    for some in blocks(len(lines), most * assembly.entries):
        rows = order[ends[some.start] : ends[some.stop]]
        view = assembly.at_rest(2 * np.pi * lines[some]).at(place[rows] - some.start)
        found = balance(assembly, view, force[rows], None if start is None else start[rows], ramp)
        parts.append(found)
    back = np.argsort(order)
    motion, size, fine, rising, why = (np.concatenate(part)[back] for part in zip(*parts, strict=True))
    return motion, size, fine, rising, why


def caps_of(assembly: Assembly) -> Array:
    """Longest step of each nonlinear joint in m."""
    return np.array([limit.amplitude / 4 for limit in assembly.limits])


def along(assembly: Assembly, found: Solutions, path: Index, omega: Array) -> ComplexArray:
    """Motions of the nonlinear joints between the solutions of a path, shape (len(omega), nj)."""
    z = found.motion[path][:, list(assembly.nonlinear)]
    at, lines = omega / (2 * np.pi), found.frequency[found.line[path]]
    columns = [np.interp(at, lines, c.real) + 1j * np.interp(at, lines, c.imag) for c in z.T]
    return np.array(columns, dtype=complex).reshape(z.shape[1], len(omega)).T
