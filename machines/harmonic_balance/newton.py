"""Several joints: Newton's method on the joint motions, all frequencies and forces at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

from ..coupling.coordinates import Coordinates
from ..coupling.joint_chain import ChainTangent, JointChain
from ..deadline import in_time
from ..indices import Index, Mask
from ..solved import solve_each
from ..statics.asked_together import Several, laws_together
from ..statics.bias import Together, force_slopes
from .view import View

_SHORTEST = 2.0**-6
_RISE = 10.0
_RAMP = 12
_BARELY_MOVING = 1e-10


@dataclass(frozen=True)
class Effort:
    """How many steps Newton's method takes at most, and the relative step below which a point counts as settled; what
    may be left of the error where no derivative is taken (`by_secants`)."""

    iterations: int = 60
    settled: float = 1e-12
    left: float = 1e-14


FULL = Effort()


@dataclass(frozen=True, eq=False)
class Solution:
    """Joint motions at each point (a line with a force)."""

    z: ComplexArray
    """Relative displacements in m, shape (points, nj)."""
    gain: ComplexArray
    """Describing-function gains there in N/m, shape (points, nj)."""
    converged: Mask
    """True where the residual and the step fell below the tolerance."""
    turning: Mask
    """True where the determinant of the Jacobian has changed sign: a fold was passed, the solution is unstable."""
    coordinates: Coordinates

    @property
    def force(self) -> ComplexArray:
        """What the joint forces g = G z come to in the coordinates of the view, N, (points, r)."""
        return self.coordinates.together(self.gain * self.z)


def solve(
    view: View,
    joints: Sequence[Joint],
    force: Array,
    cap: Array | None = None,
    start: ComplexArray | None = None,
    ramp: bool = True,
    effort: Effort = FULL,
) -> Solution:
    """Balance q + Hzz Tᵀ g(T q) = Hzf F at every point; one line of ``view`` and one force per point.

    g = G(abs z, ω) z is not holomorphic: both Wirtinger derivatives enter, g_Z = G + A G'/2 and
    g_Z* = (z²/A) G'/2, as a real system of 2 r unknowns per point. The gain at rest is first coupled into Hzz, so
    that free parts stay well conditioned and the start is the linear response. A point that does not settle is tried
    again with the force raised in steps. ``cap`` is the longest step of each joint in m.
    """
    problem = Problem.of(view, joints, force, np.full(len(joints), np.inf) if cap is None else cap)
    first = problem.driven if start is None else view.coordinates.of_motions(start)
    z, gain, converged, turning = problem.newton(first, problem.driven, effort)
    lost = np.flatnonzero(~converged)
    if ramp and len(lost):
        part = problem.at(lost)
        s, climbing = part.driven / _RAMP, np.ones(len(lost), dtype=bool)
        for k in range(1, _RAMP + 1):
            s, g, done, turned = part.newton(s, part.driven * k / _RAMP)
            climbing &= done
            if k < _RAMP:
                s = s * (k + 1) / k
        z[lost], gain[lost], converged[lost], turning[lost] = s, g, climbing, turned
    return Solution(view.coordinates.motions(z), gain, converged, turning, view.coordinates)


@dataclass(frozen=True, eq=False)
class Problem:
    """q + H Tᵀ (G − G0) T q = driven at all points, with the gain at rest G0 coupled into H and into the driving.

    The unknowns are the coordinates q, named z below; the joints move by T z.
    """

    omega: Array
    joints: Sequence[Joint]
    base: ComplexArray
    Hzz: ComplexArray
    driven: ComplexArray
    cap: Array
    coordinates: Coordinates
    chain: JointChain | None = None
    """What stands for Hzz where joints share parts with few others."""

    @classmethod
    def of(cls, view: View, joints: Sequence[Joint], force: Array, cap: Array) -> Problem:
        if view.base is None:
            view = view.at_rest(at_rest(joints, len(joints), view.omega))
        assert view.base is not None
        driven = view.Hzf[:, :, 0] * force[:, None]
        return cls(view.omega, joints, view.base, view.Hzz, driven, cap, view.coordinates, view.chain)

    def at(self, points: Index | Mask) -> Problem:
        base, H, driven = (part[points] for part in (self.base, self.Hzz, self.driven))
        chain = None if self.chain is None else self.chain.at(points)
        return Problem(self.omega[points], self.joints, base, H, driven, self.cap, self.coordinates, chain)

    def residual(self, z: ComplexArray, driven: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        motion = self.coordinates.motions(z)
        gain, slope = gains(self.joints, np.abs(motion), self.omega)
        force = self.coordinates.together((gain - self.base) * motion)
        moved = (self.Hzz @ force[:, :, None])[:, :, 0] if self.chain is None else self.chain.times(force)
        return z + moved - driven, gain, slope

    def tangent(self, z: ComplexArray, gain: ComplexArray, slope: ComplexArray) -> Jacobian:
        """What the residual changes by with the motions."""
        if self.chain is None:
            return Elimination(self.jacobian(z, gain, slope))
        own, crossed = own_slopes(z, slope)
        return self.chain.tangent(gain + own, crossed)

    def jacobian(self, z: ComplexArray, gain: ComplexArray, slope: ComplexArray) -> Array:
        """Real Jacobian over [Re z, Im z], shape (points, 2r, 2r)."""
        c, motion = self.coordinates, self.coordinates.motions(z)
        if slope.ndim == 3:
            by_z, by_conjugate = (c.across(self.Hzz, part) for part in force_slopes(motion, gain - self.base, slope))
        else:
            own, crossed = own_slopes(motion, slope)
            by_z, by_conjugate = c.through(self.Hzz, gain - self.base + own), c.through(self.Hzz, crossed)
        every = np.arange(z.shape[1])
        by_z[:, every, every] += 1.0
        return real_form(by_z, by_conjugate)

    @np.errstate(over="ignore", invalid="ignore")  # a motion beyond all bounds is one that is not kept
    def newton(
        self, start: ComplexArray, driven: ComplexArray, effort: Effort = FULL
    ) -> tuple[ComplexArray, ComplexArray, Mask, Mask]:
        """z, gain, converged and turning from one start per point; points drop out as they settle."""
        points = len(start)
        z, gain = start.astype(complex), np.zeros((points, len(self.joints)), dtype=complex)
        converged, turning = np.zeros(points, dtype=bool), np.zeros(points, dtype=bool)
        left = np.arange(points)
        part, target, x = self, driven, z
        r, G, slope = part.residual(x, target)
        for _ in range(effort.iterations):
            in_time()
            tangent = part.tangent(x, G, slope)
            size = np.max(np.abs(x), axis=1)
            delta = -tangent.solve(r)
            small = np.max(np.abs(delta), axis=1) <= effort.settled * np.maximum(size, 1e-300)
            gain[left], z[left] = G, x
            converged[left[small]], turning[left[small]] = True, tangent.turned(small)
            go = ~small & np.all(np.isfinite(delta), axis=1)
            if not np.any(go):
                break
            left, part, target = left[go], part.at(go), target[go]
            x, r, G, slope = part._step(x[go], delta[go], r[go], target)
        return z, gain, converged, turning

    def _step(
        self, x: ComplexArray, delta: ComplexArray, r: ComplexArray, target: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """A step no longer than the cap, halved where it does not reduce the residual."""
        share = 1 / np.maximum(1.0, np.max(np.abs(self.coordinates.motions(delta)) / self.cap, axis=1))
        before = np.linalg.norm(r, axis=1)
        rounding = 1e-13 * np.linalg.norm(target, axis=1)
        new = x + share[:, None] * delta
        r_new, G, slope = self.residual(new, target)
        while True:
            worse = (np.linalg.norm(r_new, axis=1) > _RISE * before + rounding) & (share > _SHORTEST)
            if not np.any(worse):
                return new, r_new, G, slope
            share = np.where(worse, share / 2, share)
            new[worse] = x[worse] + share[worse, None] * delta[worse]
            r_new[worse], G[worse], slope[worse] = self.at(worse).residual(new[worse], target[worse])


@dataclass(frozen=True, eq=False)
class Elimination:
    """A real Jacobian over [Re z, Im z] of every point, (points, 2m, 2m)."""

    J: Array

    def solve(self, right: ComplexArray) -> ComplexArray:
        """δ (points, …) with J δ = right; nan where J is singular or not finite."""
        flat = right.reshape(len(right), -1)
        real = np.concatenate([flat.real, flat.imag], axis=1)
        x, half = solve_each(self.J, real[:, :, None])[:, :, 0], flat.shape[1]
        return np.asarray((x[:, :half] + 1j * x[:, half:]).reshape(right.shape))

    def bordered(self, column: Array, row: Array, right: Array) -> Array:
        """Solutions of [J c; row] u = right, (points, 2m + 1, columns), with a column c beside J and a row below."""
        J = np.concatenate([self.J, column[:, :, None]], axis=2)
        return solve_each(np.concatenate([J, row[:, None]], axis=1), right)

    def along(self, column: Array) -> Array:
        """Unit vectors u with [J c] u = 0, (points, 2m + 1)."""
        return np.asarray(np.linalg.svd(np.concatenate([self.J, column[:, :, None]], axis=2))[2][:, -1])

    def turned(self, points: Index | Mask | slice) -> Mask:
        """Where the determinant has another sign than at rest."""
        return np.asarray(np.linalg.slogdet(self.J[points])[0] < 0)


Jacobian: TypeAlias = Elimination | ChainTangent
"""What the equations of the joints change by with the motions, ready to be solved."""


def real_form(by_z: ComplexArray, by_conjugate: ComplexArray) -> Array:
    """δ → by_z δ + by_conjugate δ* as a real matrix over [Re δ, Im δ], (points, n, n) to (points, 2n, 2n)."""
    points, n, _ = by_z.shape
    J = np.empty((points, 2 * n, 2 * n))
    np.add(by_z.real, by_conjugate.real, out=J[:, :n, :n])
    np.subtract(by_conjugate.imag, by_z.imag, out=J[:, :n, n:])
    np.add(by_z.imag, by_conjugate.imag, out=J[:, n:, :n])
    np.subtract(by_z.real, by_conjugate.real, out=J[:, n:, n:])
    return J


def own_slopes(z: ComplexArray, slope: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """What dG/dA adds to ∂g/∂Z beside G, A G'/2, and ∂g/∂Z* = (Z²/A) G'/2."""
    A = np.abs(z)
    half = slope * A / 2
    return half, np.where(A > 0, z / np.where(A > 0, A, 1.0), 0.0) ** 2 * half


def at_rest(joints: Sequence[Joint], count: int, omega: Array) -> ComplexArray:
    """G of every joint for vanishing motion, (points, nj)."""

    def gain(amplitude: float) -> ComplexArray:
        A = np.full((len(omega), count), amplitude)
        return joints.biased.about_rest(A, omega) if isinstance(joints, Together) else gains(joints, A, omega)[0]

    base = gain(0.0)
    return base if np.all(np.isfinite(base)) else np.where(np.isfinite(base), base, gain(_BARELY_MOVING))


def gains(joints: Sequence[Joint], amplitude: Array, omega: Array) -> tuple[ComplexArray, ComplexArray]:
    """G and dG/dA of every joint at every point, shape (points, nj), summed over their laws.

    Where the mean forces of joints move together (`Together`), dG/dA has shape (points, nj, nj): by every amplitude.
    """
    if isinstance(joints, Together):
        return joints.biased.gains(amplitude, omega)
    gain, slope = np.zeros(amplitude.shape, dtype=complex), np.zeros(amplitude.shape, dtype=complex)
    for law, columns in joints.laws if isinstance(joints, Several) else laws_together(joints):
        own = slice(None) if len(columns) == amplitude.shape[1] else columns
        found = law.first_harmonic(amplitude[:, own], omega[:, None])
        gain[:, own] += found.gain
        slope[:, own] += found.d_amplitude
    return gain, slope
