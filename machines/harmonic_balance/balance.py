"""Harmonic balance at the joints: one set of equations for any harmonics, force and frequency, points side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome
from jointlib.joint import Joint

from ..coupling.coordinates import Coordinates
from ..coupling.joint_chain import JointChain
from ..deadline import in_time
from ..indices import Index, Mask
from ..model.limits import Limit
from ..statics.asked_together import Several
from ..statics.bias import Biased
from .assembly import Assembly
from .cycle import Harmonics
from .dual_input import dual_input_forces
from .harmonics import Forces, joint_forces
from .newton import Elimination, Jacobian, real_form
from .view import View

_ITERATIONS = 30
_SETTLED = 1e-11
_LONGEST = 0.5
_FEEDING = 1e-9
_STILL = 1e-8
"""Energy of a joint over that of the busiest one below which rounding alone may decide its sign."""


@dataclass(frozen=True, eq=False)
class Balance:
    """Z_h + Hzz(hω) (g_h(Z) − G0 Z_h) = driven_h F, with the gain at rest G0 coupled into Hzz and the driving.

    Where means move under a static load, harmonic 0 is the shift of each joint from its static position, over the
    static compliance that `Biased` knows; joints and their forces then count from there.

    Arrays have one entry per point first, then one per harmonic, then one per coordinate of the joints' motions, of
    which r are independent; where that is not all of them, Z stands for these, the joints move by T Z.
    """

    joints: Sequence[Joint]
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
    biased: Biased | None = None
    chain: JointChain | None = None
    """What stands for H, (points, nh, 0, 0) then, where joints share parts with few others."""

    @classmethod
    def of(
        cls, assembly: Assembly, omega: Array, force: Array, harmonics: Harmonics, held: View | None = None
    ) -> Balance:
        """Equations at angular frequencies ω (rad/s) and forces F (N), one point each.

        ``held`` is the view at rest at all frequencies that occur, ascending, where they are known beforehand.
        """
        joints, biased = _moving(assembly, harmonics)
        points, nj = len(omega), len(joints)
        dynamic = [h for h in harmonics if h]
        nh = len(dynamic)
        lines, place = np.unique((np.array(dynamic)[:, None] * omega).ravel(), return_inverse=True)
        view = assembly.at_rest(lines).at(place) if held is None else held.at(np.searchsorted(held.omega, lines)[place])
        r = len(view.coordinates.rows)
        assert view.base is not None
        chain = None if view.chain is None else view.chain.by_point(nh)
        H = np.swapaxes(view.Hzz.reshape(nh, points, *view.Hzz.shape[1:]), 0, 1)
        base = np.swapaxes(view.base.reshape(nh, points, nj), 0, 1)
        if biased is not None:
            H = np.concatenate([H, np.broadcast_to(biased.compliance, (points, 1, r, r))], axis=1)
            base = np.concatenate([base, np.broadcast_to(biased.reference, (points, 1, nj))], axis=1)
        driven = view.Hzf[:points, :, 0]
        return cls(joints, harmonics, omega, force, base, H, driven, view.coordinates, biased, chain)

    def at(self, points: Index | Mask | slice) -> Balance:
        """The same equations at some of the points."""
        return replace(
            self,
            omega=self.omega[points],
            force=self.force[points],
            base=self.base[points],
            H=self.H[points],
            driven=self.driven[points],
            chain=None if self.chain is None else self.chain.at(points),
        )

    def forces(self, z: ComplexArray, most: int = 1024, slopes: bool = True) -> Forces:
        """Joint forces at motions z, (points, nh, r), from at most so many samples of a cycle; see `joint_forces`."""
        return _forces(self.joints, self.coordinates, self.biased, self.omega, self.harmonics, z, most, slopes)

    def residual(self, z: ComplexArray, g: ComplexArray) -> ComplexArray:
        """What is left of the equations in m, (points, nh, r), at motions z and joint forces g."""
        pull = self.coordinates.together(g - self.base * self.coordinates.motions(z))
        r = z + self.times(pull)
        r[:, 0] -= self.driven * self.force[:, None]
        return np.asarray(r)

    def times(self, force: ComplexArray) -> ComplexArray:
        """H f in m of forces in the coordinates in N, both (points, nh, r)."""
        return np.asarray((self.H @ force[..., None])[..., 0] if self.chain is None else self.chain.times(force))

    def tangent(self, forces: Forces) -> Jacobian:
        """What the equations change by with the motions, ready to be solved."""
        if self.chain is None:
            return Elimination(self.jacobian(forces))
        return self.chain.tangent(forces.by_z, forces.by_conjugate)

    def jacobian(self, forces: Forces) -> Array:
        """Real Jacobian over [Re Z, Im Z], (points, 2m, 2m) with m = nh·r."""
        H = self.H if self.chain is None else self.chain.full
        points, nh, r = H.shape[:3]
        every = np.arange(nh)
        by_z, by_conjugate = forces.by_z.copy(), forces.by_conjugate.copy()
        mean = np.array(self.harmonics)[:, None] == 0
        by_z[:, every, every] -= np.where(mean, 0.5, 1.0) * self.base
        by_conjugate[:, every, every] -= np.where(mean, 0.5, 0.0) * self.base
        size = nh * r
        # (points, nh, nh, r, r): how harmonic h follows harmonic m.
        blocks = (self.coordinates.through(H[:, :, None], part) for part in (by_z, by_conjugate))
        first, second = (np.swapaxes(block, 2, 3).reshape(points, size, size) for block in blocks)
        return real_form(first + np.eye(size), second)

    def settle(self, start: ComplexArray) -> tuple[ComplexArray, Mask]:
        """Newton's method from one start per point, (points, nh, nj): motions and where they settled."""
        z, done = start.astype(complex), np.zeros(len(start), dtype=bool)
        left, part = np.arange(len(start)), self
        for _ in range(_ITERATIONS):
            if not len(left):
                break
            in_time()
            delta = part.step(z[left])
            size = np.max(np.abs(z[left]), axis=(1, 2))
            moved = np.abs(delta)
            if self.biased is not None:
                moved[:, -1] = np.maximum(moved[:, -1] - self.biased.floor, 0.0)
            length = np.max(moved, axis=(1, 2)) / np.maximum(size, 1e-300)
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
        return self.tangent(forces).solve(-r)


def acting(assembly: Assembly, omega: Array, harmonics: Harmonics, z: ComplexArray) -> Forces:
    """Joint forces at motions z, (points, nh, r), without the equations they stand in and without their slopes."""
    joints, biased = _moving(assembly, harmonics)
    return _forces(joints, assembly.coordinates, biased, omega, harmonics, z, slopes=False)


def _moving(assembly: Assembly, harmonics: Harmonics) -> tuple[Several, Biased | None]:
    """The joints whose motions are sought, and their means where these are too."""
    biased = assembly.biased if 0 in harmonics else None
    return (assembly.sampled if biased is None else assembly.carrying), biased


def _forces(
    joints: Sequence[Joint],
    coordinates: Coordinates,
    biased: Biased | None,
    omega: Array,
    harmonics: Harmonics,
    z: ComplexArray,
    most: int = 1024,
    slopes: bool = True,
) -> Forces:
    motion = coordinates.motions(z)
    if biased is None:
        return joint_forces(joints, motion, omega, harmonics, most, slopes=slopes)
    if harmonics == (1, 0):
        return dual_input_forces(biased, motion, omega, slopes)
    placed = motion.astype(complex)
    placed[:, -1] += biased.rest
    found = joint_forces(joints, placed, omega, harmonics, most, biased.rest, slopes)
    found.force[:, -1] -= biased.carried
    return found


def excess(forces: Forces, z: ComplexArray, harmonics: Harmonics, limits: Sequence[Limit]) -> Array:
    """How far each point is past a limit, (points, 2 nj): amplitude over limit less 1, then energy fed in; > 0 is past.

    The energy is −Σ h Im(g_h Z_h*) over Σ h abs(g_h Z_h), less what rounding makes; of a joint that stands still
    beside the others, by symmetry say, nothing else is left.
    """
    reach = np.array([limit.amplitude for limit in limits])
    work = np.array(harmonics)[:, None] * forces.force * z.conj()
    size = np.sum(np.abs(work), axis=1)
    size = np.maximum(size, _STILL * np.max(size, axis=1, keepdims=True) + 1e-300)
    return np.concatenate([forces.travel / reach - 1, -np.sum(work.imag, axis=1) / size - _FEEDING], axis=1)


def reason(past: Array, limits: Sequence[Limit]) -> Outcome:
    """The limit that one row of `excess` names."""
    worst = int(np.argmax(past))
    return limits[worst].outcome if worst < len(limits) else Outcome.NEGATIVE_DAMPING
