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
from ..harmonic_balance.balance import excess
from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.tangent import Tangent
from ..indices import Index, Mask
from ..operating.tops import tops
from .all_curves import started
from .arclength import Path, Stop
from .solution_curves import Curve, first_harmonics
from .validation import departs

_STRAY, _MOST = 0.2, 1.0
"""Of the largest joint's motion: where the first harmonic changes more, or overtones are larger, arc length follows."""
_SETTLED = 1e-10
_CHORDS, _FAST = 12, 0.1
_HALVINGS, _ROUNDS = 3, 3


class Strayed(Exception):
    """What lies beside the first harmonic at some frequencies is not sure: ``omega`` in rad/s."""

    def __init__(self, omega: Array) -> None:
        super().__init__(omega)
        self.omega = omega


@dataclass(eq=False)
class Carried:
    """Solutions in several harmonics at one force (N) beside those in one; points once found are kept."""

    path: Path
    force: float
    harmonics: Harmonics
    lines: Array
    """Hz."""
    known: _Points | None = None

    def curve(self, frequency: Array, joint: ComplexArray) -> Curve:
        """The curve beside a single branch, motions ``joint`` (m) of all joints over ascending frequencies (Hz), with
        points so close that tops of joints follow from them; `Strayed` where not sure."""
        points = self._beside(2 * np.pi * frequency, joint)
        found = tops(points.omega, np.abs(points.moved))
        # Those of the outputs are points in the end.
        points = self._smooth(points, found.omega[found.motion >= len(self.path.assembly.joints)])
        return _curve(points, self.lines)

    def _beside(self, omega: Array, joint: ComplexArray) -> _Points:
        """Points close enough for their tops to follow."""
        new = slice(None) if self.known is None else ~np.isin(omega, self.known.omega)
        first = joint[new][:, list(self.path.assembly.nonlinear)]
        self._settle(omega[new], started(self.path.assembly, self.harmonics, first, omega[new]))
        points = self._within(omega)
        for _ in range(_HALVINGS):
            rough = np.flatnonzero(_rough(points))
            if not len(rough):
                break
            points = self._with(points, (points.omega[rough] + points.omega[rough + 1]) / 2)
        for _ in range(_ROUNDS):
            points = self._with(points, tops(points.omega, np.abs(points.moved)).wanted(points.omega))
        return points

    def _smooth(self, points: _Points, omega: Array) -> _Points:
        """With points at these frequencies, if all are those of one smooth curve."""
        points = self._with(points, omega)
        rough = np.flatnonzero(_rough(points))
        if len(rough):
            raise Strayed((points.omega[rough] + points.omega[rough + 1]) / 2)
        return points

    def _with(self, points: _Points, omega: Array) -> _Points:
        """With points at these frequencies as well."""
        further = np.setdiff1d(omega, points.omega)
        if not len(further):
            return points
        self._settle(further, points.between(further))
        return self._within(points.omega)

    def _within(self, omega: Array) -> _Points:
        """The points that are known from the first to the last of these frequencies."""
        assert self.known is not None
        return self.known.at((self.known.omega >= omega[0]) & (self.known.omega <= omega[-1]))

    def _settle(self, omega: Array, start: ComplexArray) -> None:
        """Know the solutions that Newton's method leads to from each start."""
        parts, lost = [] if self.known is None else [self.known], list[Array]()
        for some in blocks(len(omega), self.path.assembly.tangent_entries(len(self.path.harmonics))):
            try:
                parts.append(_settled(self.path, np.full(len(omega[some]), self.force), omega[some], start[some]))
            except Strayed as where:
                lost.append(where.omega)
        if parts:
            self.known = _Points.joined(parts)
        if lost:
            raise Strayed(np.concatenate(lost))


@dataclass(frozen=True, eq=False)
class _Points:
    """Solutions over ascending frequency, with their tangents dz/dω."""

    omega: Array
    z: ComplexArray
    """m, (n, nh, r)."""
    slope: ComplexArray
    moved: ComplexArray
    """First harmonics of all joints and then of the outputs, m, (n, motions)."""

    @staticmethod
    def joined(parts: Sequence[_Points]) -> _Points:
        every = [np.concatenate(part) for part in zip(*((p.omega, p.z, p.slope, p.moved) for p in parts), strict=True)]
        return _Points(*every).at(np.argsort(every[0], kind="stable"))

    def at(self, rows: Index | Mask) -> _Points:
        return _Points(self.omega[rows], self.z[rows], self.slope[rows], self.moved[rows])

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


def _curve(points: _Points, lines: Array) -> Curve:
    """Points as a curve without folds through its range."""
    none, nowhere = np.full(len(points.omega), -1), np.zeros(len(points.omega), dtype=bool)
    place = np.minimum(np.searchsorted(2 * np.pi * lines, points.omega), len(lines) - 1)
    on = np.where(2 * np.pi * lines[place] == points.omega, place, none)
    end = (Stop.RANGE, Outcome.CONVERGED)
    return Curve(points.z, points.omega, on, nowhere, none, ~nowhere, (end, end))


def _settled(path: Path, force: Array, omega: Array, start: ComplexArray) -> _Points:
    """Newton's method from each start; `Strayed` where one does not settle near it or meets a limit."""
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
        near = (np.max(away[:, 0], axis=1) <= _STRAY * size) & (_largest(away) <= _MOST * size)
        if not np.all(near):
            raise Strayed(omega[~near])
        left = _largest(step) / (_SETTLED * size + floor)
        length = float(np.max(left))
        if length <= 1.0:
            break
        # The tangents of the start serve as long as they lead on fast.
        turn = length > _FAST * before
        forces = balance.forces(z, slopes=turn)
        tangent, before = (Tangent(balance, forces), np.inf) if turn else (tangent, length)
    else:
        raise Strayed(omega[left > 1.0])
    # The last step moved less than shows in the forces before it.
    past = excess(forces, path.assembly.coordinates.motions(z), path.harmonics, path.assembly.limits)
    within = np.all(past <= 0, axis=1)
    if not np.all(within):
        raise Strayed(omega[~within])
    return _Points(omega, z, slope, first_harmonics(path, z, omega, force, forces))


def _rough(points: _Points) -> Mask:
    """Intervals whose change is not what the tangents on both sides promise."""
    width = np.diff(points.omega)[:, None, None]
    size = _largest(points.z)
    before, after = width * points.slope[:-1], width * points.slope[1:]
    return departs(np.diff(points.z, axis=0), before, after, np.stack([size[:-1], size[1:]]))


def _largest(part: ComplexArray) -> Array:
    return np.asarray(np.max(np.abs(part), axis=(1, 2)))
