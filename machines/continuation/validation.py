"""Where Newton's method line by line may not be the whole answer: between its lines, and beside its solutions."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.shown.progress import Progress

from ..blocks import blocks
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.harmonics import with_mean
from ..harmonic_balance.newton import FULL, Effort
from ..harmonic_balance.tangent import Tangent
from ..harmonic_balance.view import View
from ..indices import Index, Mask
from ..operating.solutions import Solutions, by_newton, joints_balanced
from .all_curves import started
from .arclength import Path

_MISMATCH = 0.25
_ROUNDING = 1e-6
_HALVINGS = 3
_FURTHER = 3.0
_LEAST = 0.1
_STEP = 1.25
_PROPORTIONAL = 0.1
_ROUGHLY = Effort(settled=1e-4, left=1e-4)
"""What tells whether a motion is proportional to the force."""
_SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Solutions other than Newton's, one row each, and where there are some."""

    met: Mask
    """(forces, lines)."""
    force: Index
    line: Index
    z: ComplexArray
    """Motions of the nonlinear joints in m, (rows, nj)."""


Tangents = dict[tuple[int, float], ComplexArray]
"""dz/dω of the coordinates, by force number and frequency in Hz."""


def doubtful(assembly: Assembly, forces: Array, found: Solutions, known: Tangents) -> tuple[Solutions, Mask]:
    """Solutions on more lines, and (forces, lines) where they still do not look like one smooth curve.

    The change from one line to the next is compared with what the tangents dz/dω on both promise. Where they differ by
    more than a quarter the interval is halved, three times at most: a resonance is then resolved, a jump is not.
    Tangents that are ``known`` are taken from there, the others left there.
    """
    for _ in range(_HALVINGS):
        rough = _rough(assembly, forces, found, known)
        if not np.any(rough):
            break
        wide = np.flatnonzero(np.any(rough, axis=0))
        middle = (found.frequency[wide] + found.frequency[wide + 1]) / 2
        found = found.merged(by_newton(assembly, forces, middle))
    else:
        rough = _rough(assembly, forces, found, known)
    ends = np.zeros((len(forces), len(found.frequency)), dtype=bool)
    ends[:, :-1] |= rough
    ends[:, 1:] |= rough
    return found, ends


def _rough(assembly: Assembly, forces: Array, found: Solutions, known: Tangents) -> Mask:
    """(forces, intervals) between neighbouring lines with a solution each that do not fit together."""
    n = len(found.frequency)
    omega = 2 * np.pi * found.frequency
    points = list(zip(found.force.tolist(), found.frequency[found.line].tolist(), strict=True))
    new = np.array([i for i, point in enumerate(points) if point not in known], dtype=int)
    q = assembly.coordinates.of_motions(found.motion[:, list(assembly.nonlinear)])
    known |= dict(zip((points[i] for i in new), _tangents(assembly, forces, found, new), strict=True))
    tangent = np.array([known[point] for point in points], dtype=complex).reshape(q.shape)
    following = np.flatnonzero((np.diff(found.line) == 1) & (np.diff(found.force) == 0))
    a, b = following, following + 1
    width = np.diff(omega)[found.line[a]][:, None]
    size = np.stack([_size(q[a]), _size(q[b])])
    wrong = departs(q[b] - q[a], width * tangent[a], width * tangent[b], size)
    out = np.zeros((len(forces), n - 1), dtype=bool)
    out[found.force[a[wrong]], found.line[a[wrong]]] = True
    return out


def _tangents(assembly: Assembly, forces: Array, found: Solutions, rows: Index) -> ComplexArray:
    """dz/dω of the coordinates at some of the solutions, (rows, r)."""
    omega, force = 2 * np.pi * found.frequency[found.line[rows]], forces[found.force[rows]]
    low, high = 2 * np.pi * found.frequency[[0, -1]]
    path = Path(assembly, with_mean((1,), assembly.biased is not None), float(low), float(high))
    z = started(assembly, (1,), found.motion[rows][:, list(assembly.nonlinear)], omega)
    slope = np.empty(z.shape, dtype=complex)
    for some in blocks(len(z), 3 * z.shape[1] ** 2 * assembly.entries):
        balance = path.balance(omega[some], force[some])
        acting = balance.forces(z[some])
        right = path.by_p(z[some], omega[some], force[some], balance, acting).reshape(z[some].shape)
        slope[some] = -Tangent(balance, acting).solve(right)
    return slope[:, 0]


def departs(change: ComplexArray, before: ComplexArray, after: ComplexArray, size: Array) -> Mask:
    """Whether changes from point to point (n, …) are not what the tangents on both sides promise.

    ``size`` is that of the motions at both ends, (2, n).
    """
    scale = _size(change) + (_size(before) + _size(after)) / 2 + _ROUNDING * np.max(size, axis=0)
    return np.asarray(~(_size(change - (before + after) / 2) <= _MISMATCH * scale))


def _size(z: ComplexArray) -> Array:
    return np.asarray(np.max(np.abs(z), axis=tuple(range(1, z.ndim))))


def elsewhere(assembly: Assembly, forces: Array, found: Solutions, during: Progress) -> Elsewhere:
    """Where the force, raised from little to three times the largest and lowered again, leads to another solution.

    A second solution at a force is joined to the first by a curve over the force. Where that turns back below three
    times the force, the solution there is far from proportional; only those lines are swept.
    """
    n, nj = len(found.frequency), len(assembly.nonlinear)
    table = np.full((len(forces), n, nj), np.nan, dtype=complex)
    table[found.force, found.line] = found.motion[:, list(assembly.nonlinear)]
    none = np.empty(0, dtype=int)
    hits = [(none, none, np.empty((0, nj), dtype=complex))]
    for some in blocks(n, (assembly.tangent_entries(1) + assembly.entries // 2) // 4):
        lines = _Lines(assembly, assembly.at_rest(2 * np.pi * found.frequency[some]), table[:, some])
        hits += [(F, L + some.start, z) for F, L, z in lines.swept(forces, during)]
    F, L, z = (np.concatenate([hit[k] for hit in hits]) for k in range(3))
    met = np.zeros((len(forces), n), dtype=bool)
    met[F, L] = True
    order = np.lexsort((L, F))
    return Elsewhere(met, F[order], L[order], z[order])


@dataclass(frozen=True, eq=False)
class _Lines:
    """Some lines with what is known on them."""

    assembly: Assembly
    view: View
    known: ComplexArray
    """Motions of the nonlinear joints at every force, (forces, lines, nj); nan where there is none."""

    def at(self, lines: Index | Mask) -> _Lines:
        return _Lines(self.assembly, self.view.at(lines), self.known[:, lines])

    def solve(self, force: float, start: ComplexArray | None, effort: Effort = FULL) -> tuple[ComplexArray, Mask]:
        """Joint motions by Newton's method, without a ramp, and where they may be used."""
        every = np.full(len(self.view.omega), force)
        found, fine, _ = joints_balanced(self.assembly, self.view, every, start, ramp=False, effort=effort)
        return found.z, fine & ~found.turning if start is None else fine

    def swept(self, forces: Array, during: Progress) -> list[tuple[Index, Index, ComplexArray]]:
        """Force, line and motions of solutions other than those known."""
        most = int(np.argmax(forces))
        top = _FURTHER * forces[most]
        z0 = self.known[most]
        with during.step(f"raising the force threefold on {len(self.view.omega)} lines"):
            raised, fine = self.solve(top, None, _ROUGHLY)
        apart = np.max(np.abs(raised * forces[most] / top - z0), axis=1)
        bent = ~(fine & (apart <= _PROPORTIONAL * np.max(np.abs(z0), axis=1)))
        chosen = np.flatnonzero(~np.isnan(z0[:, 0]) & bent)
        if not len(chosen):
            return []
        least = _LEAST * np.min(forces)
        steps = int(np.ceil(np.log(top / least) / np.log(_STEP)))
        levels = np.unique(np.concatenate([forces, np.geomspace(least, top, steps)]))
        part = self.at(chosen)
        begun = time.perf_counter()
        low, fine = part.solve(levels[0], None)
        needed = 2 * len(levels) * (time.perf_counter() - begun)
        part, chosen, low = part.at(fine), chosen[fine], low[fine]
        sweep = _Sweep(low, low * 0, np.full(len(low), levels[0]), np.zeros(len(low)), np.ones(len(low), dtype=bool))
        hits = []
        # Below the least of the forces nothing is compared any more.
        ways = (levels[1:], levels[levels >= np.min(forces)][::-1])
        with during.step(f"raising the force to {top:g} N and back on {len(chosen)} lines, about {needed:.0f} s"):
            for order in ways:
                # What followed its tangent all the way up comes back the same way.
                going = np.ones(len(chosen), dtype=bool) if order is ways[0] else ~sweep.smooth
                for level in order:
                    moving = going & ((sweep.force < level) if order[0] < order[-1] else (sweep.force > level))
                    sweep, ok = sweep.to(part, float(level), moving)
                    going &= ok | ~moving
                    for f in np.flatnonzero(forces == level):
                        other = moving & ok & ~(_size(sweep.z - part.known[f]) <= _SAME * _size(part.known[f]))
                        rows = np.flatnonzero(other & ~np.isnan(part.known[f, :, 0]))
                        hits.append((np.full(len(rows), f), chosen[rows], sweep.z[rows]))
        return hits


@dataclass(frozen=True, eq=False)
class _Sweep:
    """Solutions at fixed frequencies while the force moves: where they are, and where they were a step before."""

    z: ComplexArray
    before: ComplexArray
    force: Array
    last: Array
    smooth: Mask
    """Whether every step so far ended near its secant."""

    def to(self, lines: _Lines, level: float, moving: Mask) -> tuple[_Sweep, Mask]:
        """Solutions at another force, by the secant; those that are not found stay where they were."""
        rows, ok = np.flatnonzero(moving), np.zeros(len(moving), dtype=bool)
        if not len(rows):
            return self, ok
        gap = self.force[rows] - self.last[rows]
        share = np.where(gap != 0, (level - self.force[rows]) / np.where(gap != 0, gap, 1.0), 0.0)
        guess = self.z[rows] + share[:, None] * (self.z[rows] - self.before[rows])
        new, fine = lines.at(rows).solve(level, guess)
        good = rows[fine]
        ok[good] = True
        z, before, force, last = self.z.copy(), self.before.copy(), self.force.copy(), self.last.copy()
        smooth = self.smooth.copy()
        size = _MISMATCH * _size(new - z[rows]) + _ROUNDING * _size(new)
        smooth[rows] &= fine & (_size(new - guess) <= size)
        before[good], last[good] = z[good], force[good]
        z[good], force[good] = new[fine], level
        return _Sweep(z, before, force, last, smooth), ok
