"""Every curve of solutions at given forces: starts, both directions from each, and no curve twice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..harmonic_balance import newton as nonlinear
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import with_mean
from ..indices import Index
from ..operating.branches import Branch, End
from ..operating.solutions import caps_of
from .arclength import SHARE, Path, Stop, march
from .curve_points import Points
from .solution_curves import PARTS, Curve, curves_of

_PROBES = 17
_FURTHER = 3.0
_LOWEST = 0.05
_ROUND = 20
_NEAR = 0.1
"""Share of a chord that the curve may bow out."""
_TOUCHING = 1e-6
_ON_THE_EDGE = 1e-12


@dataclass(frozen=True, eq=False)
class Starts:
    """Solutions from which curves are followed, one row each."""

    force: Index
    """Index of the force."""
    omega: Array
    """rad/s."""
    z: ComplexArray
    """m, (starts, nh, r); the mean, where it moves, is the last."""

    def and_then(self, others: Starts) -> Starts:
        """These and then others."""
        pairs = zip(_fields(self), _fields(others), strict=True)
        return Starts(*(np.concatenate(pair) for pair in pairs))

    def at(self, rows: Index | Sequence[int]) -> Starts:
        chosen = np.asarray(rows, dtype=int)
        return Starts(self.force[chosen], self.omega[chosen], self.z[chosen])


def from_branches(assembly: Assembly, branches: Sequence[Sequence[Branch]], harmonics: Harmonics) -> Starts:
    """A point well inside every branch and those on the edges of the range, per force, with other harmonics at rest."""
    force, omega, z = [], [], []
    for f, of_force in enumerate(branches):
        for branch in of_force:
            n = len(branch.frequency)
            rows = {n // 2, *(i for i, end in ((0, branch.ends[0]), (n - 1, branch.ends[1])) if end is End.RANGE)}
            for row in sorted(rows):
                force.append(f)
                omega.append(2 * np.pi * branch.frequency[row])
                z.append(branch.joint[row][list(assembly.nonlinear)])
    motions = np.array(z, dtype=complex).reshape(len(z), len(assembly.nonlinear))
    return Starts(np.array(force, dtype=int), np.array(omega), started(assembly, harmonics, motions, np.array(omega)))


def started(assembly: Assembly, harmonics: Harmonics, first: ComplexArray, omega: Array) -> ComplexArray:
    """First harmonics (points, nj) with others at rest, and the mean where it balances: (points, nh, r)."""
    biased, coordinates = assembly.biased, assembly.coordinates
    every = with_mean(harmonics, biased is not None)
    whole = np.zeros((len(first), len(every), len(coordinates.rows)), dtype=complex)
    whole[:, 0] = coordinates.of_motions(first)
    if biased is not None and len(first):
        whole[:, -1] = coordinates.of_motions(biased.shift(np.abs(first), omega)[0])
    return whole


def by_raising_the_force(assembly: Assembly, forces: Array, low: float, high: float) -> Starts:
    """All solutions met at these forces while the force rises from next to nothing to three times the largest.

    That is done in one harmonic at fixed frequencies, round every fold in the force, and so finds isolated curves: at
    the edges of the range (rad/s), between them, and round every resonance of the curve at three times the force.
    """
    ends = np.array([low, high])
    coarse = np.linspace(low, high, _PROBES)
    first = raised(assembly, forces, coarse)
    most = np.array([_FURTHER * float(np.max(forces))])
    path = Path(assembly, with_mean((1,), assembly.biased is not None), low, high)
    tall = raised(assembly, most, ends)
    fine = [_round_resonances(curve) for curve in follow(path, most, tall, ends)[0]]
    further = np.setdiff1d(np.concatenate([coarse[:0], *fine]), coarse)
    second = raised(assembly, forces, further)
    every = first.and_then(second)
    # Edges first: their curves are the longest.
    return every.at(np.lexsort((np.minimum(every.omega - low, high - every.omega), every.force)))


def _fields(starts: Starts) -> tuple[np.ndarray, ...]:
    return starts.force, starts.omega, starts.z


def _round_resonances(curve: Curve) -> Array:
    """Frequencies of the points next to the tops of a curve, and next to a limit that cuts one off."""
    n = len(curve.p)
    middle = [
        *np.flatnonzero(curve.top >= 0),
        *(i for i, end in ((0, 0), (n - 1, 1)) if curve.ends[end][0] is Stop.LIMIT),
    ]
    near = np.unique(np.concatenate([np.arange(0), *(np.arange(max(i - _ROUND, 0), i + _ROUND, 2) for i in middle)]))
    return np.unique(curve.p[near[near < n]])


def raised(assembly: Assembly, forces: Array, omega: Array) -> Starts:
    """Solutions at these forces along curves over the force at fixed frequencies (rad/s), one harmonic."""
    joints, harmonics = assembly.moving, with_mean((1,), assembly.biased is not None)
    if not len(omega):
        shape = (0, len(harmonics), len(assembly.coordinates.rows))
        return Starts(np.empty(0, dtype=int), omega, np.empty(shape, dtype=complex))
    first = np.full(len(omega), _LOWEST * np.min(forces))
    view = assembly.at_rest(omega)
    rest = nonlinear.solve(view, joints, first, caps_of(assembly))
    fine = rest.converged
    path = Path(assembly, harmonics, float(first[0]) / 2, _FURTHER * float(np.max(forces)), False, view)
    z = started(assembly, (1,), rest.z[fine], omega[fine])
    start = path.begin(z, first[fine], omega[fine], np.ones(len(z), dtype=bool))
    levels = np.unique(forces)
    found = curves_of(path, march(path, start), levels)
    force, at, found_z = [], [], []
    for w, curve in zip(omega[fine], found, strict=True):
        for row in np.flatnonzero(curve.line >= 0):
            for f in np.flatnonzero(forces == levels[curve.line[row]]):
                force.append(f)
                at.append(w)
                found_z.append(curve.z[row])
    shape = (len(force), len(harmonics), len(assembly.coordinates.rows))
    return Starts(np.array(force, dtype=int), np.array(at), np.array(found_z, dtype=complex).reshape(shape))


def follow(path: Path, forces: Array, starts: Starts, lines: Array) -> list[list[Curve]]:
    """The curves through all starts, per force, with their crossings of ``lines`` (rad/s) put in."""
    found: list[list[Curve]] = [[] for _ in forces]
    if not len(starts.omega):
        return found
    ends = np.array([path.low, path.high])
    near = np.abs(starts.omega[:, None] / ends - 1) < _ON_THE_EDGE
    omega = np.where(np.any(near, axis=1), ends[np.argmax(near, axis=1)], starts.omega)
    z, settled = path.balance(omega, forces[starts.force]).settle(starts.z)
    left = Starts(starts.force, omega, z).at(np.flatnonzero(settled))
    while len(left.omega):
        now = np.unique(left.force, return_index=True)[1]
        chosen = left.at(now)
        both = [path.begin(chosen.z, chosen.omega, forces[chosen.force], np.full(len(now), up)) for up in (False, True)]
        traces = march(path, Points.joined(both))
        curves = curves_of(path, traces, lines)
        for i, f in enumerate(chosen.force):
            found[f].append(_merged(curves[i], curves[len(now) + i]))
        open_ = []
        for i in np.setdiff1d(np.arange(len(left.omega)), now):
            last = found[left.force[i]][-1]
            if not passes(last.z, last.p, float(left.omega[i]), left.z[i]):
                open_.append(int(i))
        left = left.at(open_)
    return found


def _merged(down: Curve, up: Curve) -> Curve:
    """One curve from its two halves, which share their start."""
    if up.ends[1][0] is Stop.CLOSED:
        return up
    back = slice(None, 0, -1)
    parts = {n: np.concatenate([getattr(down, n)[back], getattr(up, n)]) for n in PARTS}
    return replace(up, **parts, ends=(down.ends[1], up.ends[1]))


def passes(points_z: ComplexArray, points_p: Array, p: float, z: ComplexArray) -> bool:
    """Whether a curve through these points has that solution: its distance from the chords in motion and p."""
    scale, pace = max(float(np.max(np.abs(z))), 1e-300), SHARE[True] * p
    points = np.concatenate([points_z.reshape(len(points_p), -1) / scale, (points_p / pace)[:, None]], axis=1)
    gap = np.append(z.ravel() / scale, p / pace) - points[:-1]
    chord = np.diff(points, axis=0)
    length = np.linalg.norm(chord, axis=1)
    along = np.sum(chord.conj() * gap, axis=1).real / np.maximum(length**2, 1e-300)
    aside = np.linalg.norm(gap - np.clip(along, 0.0, 1.0)[:, None] * chord, axis=1)
    return bool(np.any(aside <= _NEAR * length + _TOUCHING))
