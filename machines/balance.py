"""Harmonic balance at the joints: one set of equations for any harmonics, force and frequency, points side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint

from .assembly import Assembly, View
from .coordinates import Coordinates
from .harmonics import Forces, Harmonics, joint_forces
from .indices import Index, Mask
from .limits import Limit
from .nonlinear import gains

_BARELY_MOVING = 1e-10
_ITERATIONS = 30
_SETTLED = 1e-11
_LONGEST = 0.5
_FEEDING = 1e-12


@dataclass(frozen=True, eq=False)
class Balance:
    """Z_h + Hzz(hω) (g_h(Z) − G0 Z_h) = driven_h F, with the gain at rest G0 coupled into Hzz and the driving.

    Arrays have one entry per point first, then one per harmonic, then one per coordinate of the joints' motions, of
    which r are independent; where that is not all of them, Z stands for these, the joints move by T Z.
    """

    joints: tuple[Joint, ...]
    harmonics: Harmonics
    omega: Array
    """rad/s, (points,)."""
    force: Array
    """N, (points,)."""
    base: ComplexArray
    """G0(hω) in N/m, (points, nh, nj)."""
    H: ComplexArray
    """m/N, (points, nh, r, r)."""
    driven: ComplexArray
    """m/N, (points, r); only the first harmonic is driven."""
    coordinates: Coordinates

    @classmethod
    def of(
        cls, assembly: Assembly, omega: Array, force: Array, harmonics: Harmonics, held: View | None = None
    ) -> Balance:
        """Equations at angular frequencies ω (rad/s) and forces F (N), one point each.

        ``held`` is the view at all frequencies that occur, ascending, where they are known beforehand.
        """
        joints, points, nh = [assembly.joints[i] for i in assembly.nonlinear], len(omega), len(harmonics)
        lines, place = np.unique((np.array(harmonics)[:, None] * omega).ravel(), return_inverse=True)
        view = assembly.at(lines).at(place) if held is None else held.at(np.searchsorted(held.omega, lines)[place])
        nj = len(joints)
        base = gains(joints, np.zeros((len(view.omega), nj)), view.omega)[0]
        if not np.all(np.isfinite(base)):
            tiny = gains(joints, np.full((len(view.omega), nj), _BARELY_MOVING), view.omega)[0]
            base = np.where(np.isfinite(base), base, tiny)
        r = len(view.coordinates.rows)
        system = np.eye(r) + view.coordinates.through(view.Hzz, base)
        both = np.linalg.solve(system, np.concatenate([view.Hzz, view.Hzf[:, :, :1]], axis=2))
        H = np.swapaxes(both[:, :, :r].reshape(nh, points, r, r), 0, 1)
        return cls(
            tuple(joints),
            harmonics,
            omega,
            force,
            np.swapaxes(base.reshape(nh, points, nj), 0, 1),
            H,
            np.asarray(both[:points, :, r], dtype=complex),
            view.coordinates,
        )

    def at(self, points: Index | Mask) -> Balance:
        """The same equations at some of the points."""
        return replace(
            self,
            omega=self.omega[points],
            force=self.force[points],
            base=self.base[points],
            H=self.H[points],
            driven=self.driven[points],
        )

    def forces(self, z: ComplexArray, most: int = 1024) -> Forces:
        """Joint forces at motions z, (points, nh, r), from at most so many samples of a cycle."""
        return joint_forces(self.joints, self.coordinates.motions(z), self.omega, self.harmonics, most)

    def residual(self, z: ComplexArray, g: ComplexArray) -> ComplexArray:
        """What is left of the equations in m, (points, nh, r), at motions z and joint forces g."""
        pull = self.coordinates.together(g - self.base * self.coordinates.motions(z))
        r = z + (self.H @ pull[..., None])[..., 0]
        r[:, 0] -= self.driven * self.force[:, None]
        return np.asarray(r)

    def jacobian(self, forces: Forces) -> Array:
        """Real Jacobian over [Re Z, Im Z], (points, 2m, 2m) with m = nh·r."""
        points, nh, r = self.H.shape[:3]
        every = np.arange(nh)
        by_z = forces.by_z.copy()
        by_z[:, every, every] -= self.base
        size = nh * r
        # (points, nh, nh, r, r): how harmonic h follows harmonic m.
        blocks = (self.coordinates.through(self.H[:, :, None], part) for part in (by_z, forces.by_conjugate))
        first, second = (np.swapaxes(block, 2, 3).reshape(points, size, size) for block in blocks)
        first = first + np.eye(size)
        plus, minus = first + second, first - second
        J = np.empty((points, 2 * size, 2 * size))
        J[:, :size, :size], J[:, :size, size:] = plus.real, -minus.imag
        J[:, size:, :size], J[:, size:, size:] = plus.imag, minus.real
        return J

    def settle(self, start: ComplexArray) -> tuple[ComplexArray, Mask]:
        """Newton's method from one start per point, (points, nh, nj): motions and where they settled."""
        z, done = start.astype(complex), np.zeros(len(start), dtype=bool)
        left, part = np.arange(len(start)), self
        for _ in range(_ITERATIONS):
            if not len(left):
                break
            delta = part.step(z[left])
            size = np.max(np.abs(z[left]), axis=(1, 2))
            length = np.max(np.abs(delta), axis=(1, 2)) / np.maximum(size, 1e-300)
            fine = np.isfinite(length)
            share = np.minimum(1.0, _LONGEST / np.maximum(length, 1e-300))
            z[left[fine]] += (share[:, None, None] * delta)[fine]
            done[left] = length <= _SETTLED
            go = fine & ~done[left]
            left, part = left[go], part.at(go)
        return z, done

    def step(self, z: ComplexArray) -> ComplexArray:
        """The Newton step in m at motions z; nan where there is none."""
        forces = self.forces(z)
        r = self.residual(z, forces.force)
        return solve_complex(self.jacobian(forces), -r)


def solve_complex(J: Array, r: ComplexArray) -> ComplexArray:
    """Solve the real system J [Re δ, Im δ] = [Re r, Im r] per point; nan where J is singular or not finite."""
    flat = r.reshape(len(r), -1)
    right = np.concatenate([flat.real, flat.imag], axis=1)
    x = solve_each(J, right[:, :, None])[:, :, 0]
    half = flat.shape[1]
    return np.asarray((x[:, :half] + 1j * x[:, half:]).reshape(r.shape))


def solve_each(A: Array, right: Array) -> Array:
    """Solutions of A x = right per point, nan where there is none."""
    fine = np.all(np.isfinite(A), axis=(1, 2)) & np.all(np.isfinite(right), axis=(1, 2))
    out = np.full(right.shape, np.nan)
    try:
        out[fine] = np.linalg.solve(A[fine], right[fine])
    except np.linalg.LinAlgError:
        for i in np.flatnonzero(fine):
            try:
                out[i] = np.linalg.solve(A[i], right[i])
            except np.linalg.LinAlgError:
                continue
    return out


def excess(forces: Forces, z: ComplexArray, harmonics: Harmonics, limits: Sequence[Limit]) -> Array:
    """How far each point is past a limit, (points, 2 nj): amplitude over limit less 1, then energy fed in; > 0 is past.

    The energy is −Σ h Im(g_h Z_h*) over Σ h abs(g_h Z_h), less what rounding makes.
    """
    reach = np.array([limit.amplitude for limit in limits])
    work = np.array(harmonics)[:, None] * forces.force * z.conj()
    size = np.maximum(np.sum(np.abs(work), axis=1), 1e-300)
    return np.concatenate([forces.travel / reach - 1, -np.sum(work.imag, axis=1) / size - _FEEDING], axis=1)


def reason(past: Array, limits: Sequence[Limit]) -> Outcome:
    """The limit that one row of `excess` names."""
    worst = int(np.argmax(past))
    return limits[worst].outcome if worst < len(limits) else Outcome.NEGATIVE_DAMPING
