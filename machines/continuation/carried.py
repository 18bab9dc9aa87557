"""Several harmonics on a single branch without folds: every point of the first harmonic carried over by itself.

What overtones change is small there, so that Newton's method leads from each point of the first harmonic to the
solution beside it, all points side by side, and no curve need be followed. Where the points do not look like one smooth
curve, a limit is met or Newton's method strays, nothing is said, and arc length follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..blocks import blocks
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.balance import excess
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import with_mean
from ..harmonic_balance.tangent import Tangent
from ..indices import Mask
from ..operating.branches import Branch, End
from ..operating.tops import tops
from .all_curves import started
from .arclength import Path, Stop
from .curve_results import Followed, followed
from .solution_curves import Curve, first_harmonics
from .validation import departs

_STRAY, _MOST = 0.2, 1.0
"""Of the largest joint's motion: where the first harmonic changes more, or overtones are larger, arc length follows."""
_SETTLED = 1e-10
_CHORDS, _FAST = 12, 0.1
_HALVINGS, _ROUNDS = 3, 3


@dataclass(frozen=True, eq=False)
class _Points:
    """Solutions over ascending frequency, with their tangents dz/dω."""

    omega: Array
    z: ComplexArray
    """m, (n, nh, r)."""
    slope: ComplexArray
    moved: ComplexArray
    """First harmonics of all joints and then of the outputs, m, (n, motions)."""

    def merged(self, other: _Points) -> _Points:
        omega = np.concatenate([self.omega, other.omega])
        order = np.argsort(omega, kind="stable")
        pairs = ((self.z, other.z), (self.slope, other.slope), (self.moved, other.moved))
        return _Points(omega[order], *(np.concatenate(pair)[order] for pair in pairs))

    def between(self, omega: Array) -> ComplexArray:
        """Motions between neighbouring points, by cubics with their tangents."""
        b = np.clip(np.searchsorted(self.omega, omega), 1, len(self.omega) - 1)
        a, width = b - 1, (self.omega[b] - self.omega[b - 1])[:, None, None]
        t = (omega - self.omega[a])[:, None, None] / width
        start, end = self.z[a], self.z[b]
        ahead, behind = width * self.slope[a], width * self.slope[b]
        rise = end - start
        bow = t * (1 - t) * ((1 - t) * (ahead - rise) - t * (behind - rise))
        return np.asarray(start + t * rise + bow)


def carried(
    assembly: Assembly, force: float, lines: Array, harmonics: Harmonics, branches: Sequence[Branch]
) -> Followed | None:
    """Solutions in several harmonics beside a branch in one that runs through the whole range; None where not sure."""
    if len(branches) != 1 or branches[0].ends != (End.RANGE, End.RANGE) or len(branches[0].frequency) < 2:
        return None
    (branch,) = branches
    own = with_mean(harmonics, assembly.biased is not None)
    frequency, rows = np.unique(branch.frequency, return_index=True)
    path = Path(assembly, own, 2 * np.pi * float(frequency[0]), 2 * np.pi * float(frequency[-1]))
    points = _beside(path, force, harmonics, 2 * np.pi * frequency, branch.joint[rows])
    if points is None:
        return None
    found = tops(points.omega, np.abs(points.moved))
    # Those of the outputs are points in the end.
    points = _at(path, force, points, found.omega[found.motion >= len(assembly.joints)])
    if points is None or np.any(_rough(points)):
        return None
    return followed(path, force, [_curve(points, lines)], lines, dense=True)


def carried_curve(
    path: Path, force: float, lines: Array, harmonics: Harmonics, frequency: Array, joint: ComplexArray
) -> Curve | None:
    """The curve in several harmonics beside solutions in one, motions ``joint`` (m) of all joints over ascending
    frequencies (Hz), with the tops of the joints among its points; None where not sure."""
    points = _beside(path, force, harmonics, 2 * np.pi * frequency, joint)
    if points is None:
        return None
    found = tops(points.omega, np.abs(points.moved))
    points = _at(path, force, points, found.omega)
    if points is None or np.any(_rough(points)):
        return None
    curve = _curve(points, lines)
    own = found.motion < len(path.assembly.joints)
    motion, place = found.motion[own], np.searchsorted(points.omega, found.omega[own])
    first = np.unique(place, return_index=True)[1]
    curve.top[place[first]] = motion[first]
    # Where several joints have their top at one point, it counts once for each.
    more = np.setdiff1d(np.arange(len(place)), first)
    rows = np.insert(np.arange(len(curve.p)), place[more], place[more])
    top, line = (np.insert(part, place[more], by) for part, by in ((curve.top, motion[more]), (curve.line, -1)))
    return Curve(curve.z[rows], curve.p[rows], line, curve.fold[rows], top, curve.ends)


def _curve(points: _Points, lines: Array) -> Curve:
    """Points as a curve without folds through its range."""
    none, nowhere = np.full(len(points.omega), -1), np.zeros(len(points.omega), dtype=bool)
    place = np.minimum(np.searchsorted(2 * np.pi * lines, points.omega), len(lines) - 1)
    on = np.where(2 * np.pi * lines[place] == points.omega, place, none)
    end = (Stop.RANGE, Outcome.CONVERGED)
    return Curve(points.z, points.omega, on, nowhere, none, (end, end))


def _beside(path: Path, force: float, harmonics: Harmonics, omega: Array, joint: ComplexArray) -> _Points | None:
    """Points in several harmonics beside those in one, close enough for their tops to follow."""
    first = joint[:, list(path.assembly.nonlinear)]
    points = _settled(path, force, omega, started(path.assembly, harmonics, first, omega))
    for _ in range(_HALVINGS):
        rough = np.flatnonzero(_rough(points)) if points is not None else np.empty(0, dtype=int)
        if points is None or not len(rough):
            break
        points = _with(path, force, points, (points.omega[rough] + points.omega[rough + 1]) / 2)
    for _ in range(_ROUNDS):
        if points is None:
            return None
        points = _at(path, force, points, tops(points.omega, np.abs(points.moved)).wanted(points.omega))
    return points


def _at(path: Path, force: float, points: _Points, omega: Array) -> _Points | None:
    """With points at these frequencies as well."""
    further = np.setdiff1d(omega, points.omega)
    return _with(path, force, points, further) if len(further) else points


def _with(path: Path, force: float, points: _Points, omega: Array) -> _Points | None:
    new = _settled(path, force, omega, points.between(omega))
    return None if new is None else points.merged(new)


def _settled(path: Path, force: float, omega: Array, start: ComplexArray) -> _Points | None:
    """Newton's method from each start; None where one does not settle near it or meets a limit."""
    parts = []
    for some in blocks(len(omega), (2 * start[0].size + 1) ** 2):
        part = _settled_block(path, np.full(len(omega[some]), force), omega[some], start[some])
        if part is None:
            return None
        parts.append(part)
    z, slope, moved = (np.concatenate(part) for part in zip(*parts, strict=True))
    return _Points(omega, z, slope, moved)


def _settled_block(
    path: Path, force: Array, omega: Array, start: ComplexArray
) -> tuple[ComplexArray, ComplexArray, ComplexArray] | None:
    z, balance = start.astype(complex), path.balance(omega, force)
    floor = 0.0 if path.assembly.biased is None else path.assembly.biased.floor
    forces = balance.forces(z)
    tangent = Tangent(balance, forces)
    # What the tangents are good for asks no more than the start gives.
    slope = tangent.solve(-path.by_p(z, omega, force, balance, forces).reshape(z.shape))
    before = np.inf
    for _ in range(_CHORDS):
        step = tangent.solve(-balance.residual(z, forces.force))
        z = z + step
        size, away = _largest(z), np.abs(z - start)
        if not np.all(np.max(away[:, 0], axis=1) <= _STRAY * size) or not np.all(_largest(away) <= _MOST * size):
            return None
        length = float(np.max(_largest(step) / (_SETTLED * size + floor)))
        if length <= 1.0:
            break
        # The tangents of the start serve as long as they lead on fast.
        turn = length > _FAST * before
        forces = balance.forces(z, slopes=turn)
        tangent, before = (Tangent(balance, forces), np.inf) if turn else (tangent, length)
    else:
        return None
    # The last step moved less than shows in the forces before it.
    past = excess(forces, path.assembly.coordinates.motions(z), path.harmonics, path.assembly.limits)
    return None if np.any(past > 0) else (z, slope, first_harmonics(path, z, omega, force, forces))


def _rough(points: _Points) -> Mask:
    """Intervals whose change is not what the tangents on both sides promise."""
    width = np.diff(points.omega)[:, None, None]
    size = _largest(points.z)
    before, after = width * points.slope[:-1], width * points.slope[1:]
    return departs(np.diff(points.z, axis=0), before, after, np.stack([size[:-1], size[1:]]))


def _largest(part: ComplexArray) -> Array:
    return np.asarray(np.max(np.abs(part), axis=(1, 2)))
