"""What a machine answers at the measured lines and levels, with the slopes by parameters of its joints.

Receptances of the components do not change with the joints: they are computed once, and only gains change between
hypotheses. z + Hzz g(z) = Hzf F and x = Hof F − Hoz g hold at every point (a line of a record).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint

from ..coupling.coordinates import Coordinates
from ..coupling.coupling import couple
from ..harmonic_balance.assembly import Assembly, independent
from ..harmonic_balance.newton import Effort, gains, own_slopes, real_form, solve
from ..harmonic_balance.view import View
from ..indices import Index, Mask
from ..model.machine import Machine
from ..solved import solve_each
from ..statics.bias import Biased, Together, force_slopes
from ..statics.working_point import at_working_point
from .records import LevelFRF

_PATIENCE = Effort(15, 1e-8)
"""A point that takes more steps is next to a fold or has no solution; the last step squares the tolerance."""


@dataclass(frozen=True, eq=False)
class Points:
    """Every line of every record, one after the other."""

    frequency: Array
    force: Array
    record: Index
    drive: Index
    """Index into `Forward.drives`."""
    response: Index
    measured: ComplexArray
    deviation: Array

    def at(self, rows: Index | Mask) -> Points:
        """Some of the points."""
        parts = (self.frequency, self.force, self.record, self.drive, self.response, self.measured, self.deviation)
        return Points(*(part[rows] for part in parts))  # type: ignore[arg-type]

    def __len__(self) -> int:
        return len(self.frequency)


@dataclass(frozen=True, eq=False)
class Answer:
    """Solved motions at points."""

    z: ComplexArray
    """Moving joints in m, (points, moving)."""
    receptance: ComplexArray
    """m/N, (points,)."""
    fine: Mask
    """Where a solution was found."""
    force: ComplexArray
    """Of the moving joints in N, (points, moving)."""


@dataclass(frozen=True, eq=False)
class Forward:
    """A machine at points; ``moving`` joints are solved for, all others are linear and coupled beforehand."""

    machine: Machine
    points: Points
    drives: tuple[str, ...]
    responses: tuple[str, ...]
    lines: Array
    """Hz, the different ones, (lines,)."""
    line: Index
    """Of each point."""
    free: ComplexArray
    """Receptance between all joints, responses and drives with every joint open, (lines, ports, ports)."""
    nonlinear: tuple[int, ...]
    """Joints of the machine as it is whose gain depends on amplitude."""
    cap: Array | None = None
    """Longest step of every joint in m, (joints,)."""
    _views: dict[tuple[int, ...], View] = field(default_factory=dict)
    _coordinates: dict[tuple[int, ...], Coordinates] = field(default_factory=dict)

    @classmethod
    def of(cls, machine: Machine, frfs: Sequence[LevelFRF]) -> Forward:
        drives, responses = (tuple(dict.fromkeys(getattr(r, side) for r in frfs)) for side in ("drive", "response"))
        sizes = [len(r.frequency) for r in frfs]
        record = np.repeat(np.arange(len(frfs)), sizes)
        points = Points(
            np.concatenate([r.frequency for r in frfs]),
            np.concatenate([r.line_forces for r in frfs]),
            record,
            np.array([drives.index(r.drive) for r in frfs])[record],
            np.array([responses.index(r.response) for r in frfs])[record],
            np.concatenate([r.receptance for r in frfs]),
            np.concatenate([r.deviation for r in frfs]),
        )
        return cls.at_points(machine, points, drives, responses)

    @classmethod
    def at_points(
        cls, machine: Machine, points: Points, drives: tuple[str, ...], responses: tuple[str, ...]
    ) -> Forward:
        """The same for points that are laid out already."""
        assembly = Assembly(machine, responses, drives)
        lines, line = np.unique(points.frequency, return_inverse=True)
        free = assembly.free(2 * np.pi * lines)
        return cls(machine, points, drives, responses, lines, line, free, assembly.nonlinear)

    def with_caps(self, cap: Array | None) -> Forward:
        """The same with a longest step for every joint."""
        return replace(self, cap=cap)

    @cached_property
    def standing(self) -> tuple[Joint, ...]:
        """Joints as small vibrations see them."""
        return at_working_point(self.machine).joints()

    def view(self, moving: tuple[int, ...]) -> View:
        """Receptances at the points, for the drive and response of each."""
        if moving not in self._views:
            n, p, z = len(self.standing), self.line, list(moving)
            o = n + self.points.response
            f = n + len(self.responses) + self.points.drive
            at = np.arange(len(p))
            H, omega = self.linear(moving)[p], 2 * np.pi * self.lines
            self._views[moving] = View(
                omega[p],
                H[:, z][:, :, z],
                H[:, z][at, :, f][:, :, None],
                H[:, :, z][at, o][:, None, :],
                H[at, o, f][:, None, None],
                Coordinates(np.arange(len(z)), np.eye(len(z))),
            )
        return self._views[moving]

    def coordinates(self, moving: tuple[int, ...]) -> Coordinates:
        """The independent ones of the motions of these joints, such as six of the contacts between two bodies."""
        if moving not in self._coordinates:
            self._coordinates[moving] = independent(self.machine, moving)
        return self._coordinates[moving]

    def _of_independent(self, moving: tuple[int, ...]) -> View:
        """`view` from the independent motions alone."""
        view, c = self.view(moving), self.coordinates(moving)
        if c.complete:
            return view
        H = view.Hzz[:, c.rows][:, :, c.rows]
        return View(view.omega, H, view.Hzf[:, c.rows], view.Hoz[:, :, c.rows], view.Hof, c)

    def linear(self, moving: tuple[int, ...]) -> ComplexArray:
        """Receptance between all ports at the different lines, with all joints coupled but the moving ones."""
        linear = [i for i in range(len(self.standing)) if i not in moving]
        if not linear:
            return self.free
        omega = 2 * np.pi * self.lines
        gain = np.stack([self.standing[i].first_harmonic(0.0, omega).gain for i in linear], axis=-1)
        return couple(self.free, np.eye(self.free.shape[1])[linear], gain)

    def movers(self, joints: Sequence[Joint], moving: tuple[int, ...]) -> Sequence[Joint]:
        """The joints that are solved for, as the solver takes them; under static load with means that move."""
        if self.machine.static is None:
            return [joints[i] for i in moving]
        changed = with_joints(self.machine, joints)
        standing = at_working_point(changed).joints()
        return Together(tuple(standing[i] for i in moving), Biased.of(changed, moving, self.coordinates(moving)))

    def answer(
        self,
        joints: Sequence[Joint],
        moving: tuple[int, ...],
        start: ComplexArray | None = None,
        ramp: bool = False,
    ) -> Answer:
        """Solve for the motions with these joints (all of the machine's), from a start that may be known.

        With ``ramp`` the force is raised in steps where that fails: more patience for what is kept.
        """
        whole, points = self.view(moving), self.points
        if not moving:
            still = np.zeros((len(points), 0), dtype=complex)
            return Answer(still, whole.Hof[:, 0, 0], np.ones(len(points), dtype=bool), still)
        cap = None if self.cap is None else self.cap[list(moving)]
        try:
            movers = self.movers(joints, moving)
            view = self._of_independent(moving)
            found = solve(view, movers, points.force, cap, start, ramp, _PATIENCE)
        except (InputError, np.linalg.LinAlgError):
            # Such joints cannot hold the static load: no motion about a working point answers for them.
            none = np.zeros((len(points), len(moving)), dtype=complex)
            return Answer(none, np.zeros(len(points), dtype=complex), np.zeros(len(points), dtype=bool), none)
        lost = np.flatnonzero(~found.converged)
        z, force, fine = found.z.copy(), found.gain * found.z, found.converged.copy()
        if start is not None and len(lost):
            again = solve(view.at(lost), movers, points.force[lost], cap, None, False, _PATIENCE)
            z[lost], force[lost], fine[lost] = again.z, again.gain * again.z, again.converged
        H = view.Hof[:, 0, 0] - (whole.Hoz[:, 0] * force).sum(axis=1) / points.force
        return Answer(z, H, fine & np.isfinite(H), force)

    def everywhere(self, moving: tuple[int, ...], force: ComplexArray) -> ComplexArray:
        """m/N at every response, (responses, points), where the moving joints carry these forces in N."""
        n, places = len(self.standing), len(self.responses)
        H, line = self.linear(moving), self.line[:, None]
        o, f = n + np.arange(places), n + places + self.points.drive
        to = H[line[:, :, None], o[:, None], np.array(moving, dtype=np.intp)]
        return np.asarray((H[line, o, f[:, None]] - np.einsum("pom,pm->po", to, force) / self.points.force[:, None]).T)

    def slopes(
        self, joints: Sequence[Joint], moving: tuple[int, ...], z: ComplexArray, moved: Sequence[Sequence[Joint]]
    ) -> ComplexArray:
        """Change of the receptance, (points, variants), as the joints become each of the ``moved`` ones, linearised.

        (I + Hzz J) δz = −Hzz δg, δx = −Hoz (δg + J δz), with J both Wirtinger derivatives of the joint forces and
        δg their change at the motions as they are.
        """
        view, points = self.view(moving), self.points
        n, omega, A = len(moving), view.omega, np.abs(z)
        gain, slope = gains(self.movers(joints, moving), A, omega)
        dg = np.stack([(gains(self.movers(m, moving), A, omega)[0] - gain) * z for m in moved], axis=2)
        if slope.ndim == 3:
            by_z, by_conjugate = force_slopes(z, gain, slope)
        else:
            own, crossed = own_slopes(z, slope)
            by_z, by_conjugate = (np.zeros((len(points), n, n), dtype=complex) for _ in range(2))
            every = np.arange(n)
            by_z[:, every, every], by_conjugate[:, every, every] = gain + own, crossed
        J = real_form(np.eye(n) + view.Hzz @ by_z, view.Hzz @ by_conjugate)
        right = -view.Hzz @ dg
        delta = solve_each(J, np.concatenate([right.real, right.imag], axis=1))
        dz = delta[:, :n] + 1j * delta[:, n:]
        change = dg + by_z @ dz + by_conjugate @ dz.conj()
        out = -(view.Hoz @ change)[:, 0] / points.force[:, None]
        return np.asarray(np.where(np.isfinite(out), out, 0.0))

    def on(self, rows: Index | Mask) -> Forward:
        """The same at some of the points."""
        views = {moving: view.at(rows) for moving, view in self._views.items()}
        return replace(self, points=self.points.at(rows), line=self.line[rows], _views=views)


def with_joints(machine: Machine, joints: Sequence[Joint]) -> Machine:
    """The machine with other joints in its flexible connections, in their order."""
    given = iter(joints)
    return replace(
        machine, connections=tuple(c if c.rigid else replace(c, joint=next(given)) for c in machine.connections)
    )
