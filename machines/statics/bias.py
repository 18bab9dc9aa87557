"""Joints that vibrate about a static working point, which moves with their amplitudes: dual-input describing functions.

For z = z0 + A cos ωt the mean force N0(z0, A) must go on balancing the static load: whatever a joint's mean loses or
gains as the amplitude grows, the machine's static compliance turns into a shift of z0. Given all amplitudes, that
balance fixes all z0, so that gains are functions of the amplitudes again, and the solvers need not know.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion

from ..coupling.coordinates import Coordinates
from ..indices import Mask
from ..model.machine import Machine
from ..solved import solve_each
from .asked_together import Several, asked_together
from .mean_force import MeanForce, Slopes
from .statics import static_point
from .working_point import about

_ITERATIONS = 40
_SETTLED = 1e-13
_ROUNDING = 1e-18
"""m; what the rounding of contact forces makes of a displacement, far below any that matters."""
_SHORTEST = 2.0**-8
_SECANT = 1e-6
"""A move smaller than this share of the amplitude tells no slope."""
_PROBE = np.geomspace(1e-10, 1e-1, 46)


def keeps_mean(joint: Joint) -> bool:
    """Whether the mean force is the same at every amplitude from 0.1 nm to 0.1 m."""
    mean = joint.first_harmonic(_PROBE[:, None], np.array([1.0, 1e3, 1e5])).mean
    return bool(np.all(mean == mean[0]))


@dataclass(frozen=True, eq=False)
class Biased:
    """The joints of a machine under static load whose mean can move, and the compliance that their means work on."""

    members: tuple[int, ...]
    """Indices of these joints among the flexible connections."""
    means: tuple[MeanForce, ...]
    rest: Array
    """Their static displacements in m."""
    carried: Array
    """Their static forces in N."""
    reference: Array
    """Stiffness in N/m that is left in the compliance; any positive one serves."""
    stands: Array
    """Static displacements of all flexible connections in m."""
    spread: Array
    """m/N, (connections, members), of the machine with all other joints and the reference stiffness: what a force of a
    member does to every connection."""

    coordinates: Coordinates
    """The independent ones of the members' motions."""

    @cached_property
    def compliance(self) -> Array:
        """m/N, (r, r), over the coordinates."""
        return self.spread[list(self.members)][np.ix_(self.coordinates.rows, self.coordinates.rows)]

    @cached_property
    def floor(self) -> float:
        """What rounding makes of a shift, m."""
        pulled = np.abs(self.spread[list(self.members)]) @ np.abs(self.carried)
        return _ROUNDING + 1e-14 * float(np.max(np.abs(self.rest) + pulled))

    @classmethod
    def of(cls, machine: Machine, members: Sequence[int], coordinates: Coordinates) -> Biased:
        point = static_point(machine)
        balance = point.balance
        m = list(members)
        k = point.stiffness.copy()
        probe = np.concatenate([-_PROBE[:20], _PROBE[:20]])
        for i in m:
            # A contact that is lost holds nothing now, but its preload tells what it would hold.
            k[i] = max(k[i], 1e-3 * float(np.max(balance.means[i].static(probe)[1])))
        tangent = balance.stiffness + balance.rows.T @ (k[:, None] * balance.rows)
        spread = balance.rows @ np.linalg.solve(tangent, balance.rows[m].T)
        means = tuple(balance.means[i] for i in m)
        return cls(
            tuple(m), means, point.displacement[m], point.force[m], k[m], point.displacement, spread, coordinates
        )

    @np.errstate(over="ignore", invalid="ignore")  # a shift beyond all bounds is one that is worse
    def shift(self, amplitude: Array, omega: Array) -> tuple[Array, Mask]:
        """z0 less its value at rest in m, (points, members), and where the means balance at all."""
        points, c, floor = len(amplitude), self.coordinates, self.floor
        out, settled = np.zeros((points, len(c.rows))), np.zeros(points, dtype=bool)
        left, share = np.arange(points), np.ones(points)
        x = out.copy()
        mean = self._mean(c.motions(x), amplitude, omega)
        slope = self._slope(c.motions(x), amplitude, omega, mean)
        r = self._residual(x, mean)
        for _ in range(_ITERATIONS):
            step = -solve_each(self._matrix(slope), r[:, :, None])[:, :, 0]
            size = np.max(np.abs(c.motions(x)) + amplitude[left], axis=1)
            small = np.max(np.abs(step), axis=1) <= _SETTLED * size + floor
            out[left], settled[left] = np.where(small[:, None], x + step, x), small
            go = ~small & np.all(np.isfinite(step), axis=1)
            left, x, r, step, slope, mean = left[go], x[go], r[go], step[go], slope[go], mean[go]
            if not len(left):
                break
            before, share = np.linalg.norm(r, axis=1), np.ones(len(left))
            base, known = x, mean
            while True:
                x = base + share[:, None] * step
                mean = self._mean(c.motions(x), amplitude[left], omega[left])
                r = self._residual(x, mean)
                worse = (np.linalg.norm(r, axis=1) > before + floor) & (share > _SHORTEST)
                if not np.any(worse):
                    break
                share = np.where(worse, share / 2, share)
            # A mean depends on the place of its own joint alone, so the secant of every joint is its slope.
            went = c.motions(x - base)
            moved = np.abs(went) > _SECANT * (np.abs(c.motions(x)) + amplitude[left]) + 100 * floor
            slope = np.where(moved, (mean - known) / np.where(moved, went, 1.0), slope)
        return c.motions(out), settled

    def drifting(self, amplitude: Array, omega: Array, shift: Array) -> tuple[ComplexArray, Array]:
        """G of every joint about means that are shifted by so much, in the coordinates, and where these go next.

        One chord step, with the slopes at rest, towards the balance of `shift`; (points, members) and (points, r).
        """
        gain, mean = self.harmonic(amplitude, omega, self.coordinates.motions(shift))
        return gain, shift - self._residual(shift, mean) @ self._chord.T

    def harmonic(self, amplitude: Array, omega: Array, shift: Array) -> tuple[ComplexArray, Array]:
        """G in N/m and the mean force in N of every joint, (points, members), at shifts from where they stand."""
        gain, mean = np.empty(amplitude.shape, dtype=complex), np.empty(amplitude.shape)
        for joint, columns in self._alike:
            found = joint.harmonic(amplitude[:, columns], omega[:, None], self.rest[columns] + shift[:, columns])
            gain[:, columns], mean[:, columns] = found.gain, found.mean
        return gain, mean

    @cached_property
    def _chord(self) -> Array:
        """The inverse Jacobian of the residual at rest, (r, r)."""
        still, nothing = np.zeros((1, len(self.members))), np.ones(1)
        slope = self._slope(still, still, nothing, self._mean(still, still, nothing))
        return np.asarray(np.linalg.inv(self._matrix(slope)[0]))

    def everywhere(self, amplitude: Array, omega: Array) -> Array:
        """Shift of every connection in m, (points, connections)."""
        shift, settled = self.shift(amplitude, omega)
        mean = self._mean(shift, amplitude, omega)
        return np.where(settled[:, None], self.carried_on(shift, mean - self.carried), np.nan)

    def carried_on(self, shift: Array, force: Array) -> Array:
        """Shift of every connection in m where the members are shifted and carry so much (N) more than at rest."""
        return np.asarray(-(force - self.reference * shift) @ self.spread.T)

    def _mean(self, shift: Array, amplitude: Array, omega: Array) -> Array:
        out = np.empty_like(shift)
        for joint, columns in self._alike:
            z0 = self.rest[columns] + shift[:, columns]
            out[:, columns] = joint.mean(amplitude[:, columns], omega[:, None], z0)
        return out

    def _slope(self, shift: Array, amplitude: Array, omega: Array, mean: Array) -> Array:
        out = np.empty_like(shift)
        for joint, columns in self._alike:
            z0 = self.rest[columns] + shift[:, columns]
            out[:, columns] = joint.mean_slope(amplitude[:, columns], omega[:, None], z0, mean[:, columns])
        return out

    def _residual(self, x: Array, mean: Array) -> Array:
        pull = mean - self.carried - self.reference * self.coordinates.motions(x)
        return np.asarray(x + self.coordinates.together(pull) @ self.compliance.T)

    def _matrix(self, slope: Array) -> Array:
        """Jacobian of the residual where the means have these slopes in N/m, (points, r, r)."""
        T = self.coordinates.T
        return np.asarray(np.eye(len(T.T)) + self.compliance @ ((T.T * (slope - self.reference)[:, None, :]) @ T))

    @cached_property
    def _alike(self) -> list[tuple[MeanForce, list[int]]]:
        """Joints that are asked together."""
        return [(MeanForce(joint), columns) for joint, columns in asked_together([m.joint for m in self.means])]

    @np.errstate(over="ignore", invalid="ignore")  # of motions beyond all bounds no gain is known
    def gains(self, amplitude: Array, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        """G of every joint, (points, members), and ∂G/∂A of every joint by every amplitude; nan without a balance."""
        shift, settled = self.shift(amplitude, omega)
        found, n = self.slopes(amplitude, omega, shift), amplitude.shape[1]
        lifted = (self.compliance @ self.coordinates.T.T) * found.mean_by_amplitude[:, None, :]
        moved = -self.coordinates.T @ solve_each(self._matrix(found.mean_by_bias), lifted)
        gain, slope = found.gain, found.gain_by_bias[:, :, None] * moved
        slope[:, np.arange(n), np.arange(n)] += found.gain_by_amplitude
        lost = ~settled | ~np.all(np.isfinite(moved), axis=(1, 2))  # where nothing holds a mean, none is settled
        gain[lost], slope[lost] = np.nan, np.nan
        return gain, slope

    def about_rest(self, amplitude: Array, omega: Array) -> ComplexArray:
        """G of every joint about its static position, (points, members)."""
        out = np.empty(amplitude.shape, dtype=complex)
        for joint, columns in self._alike:
            out[:, columns] = joint.harmonic(amplitude[:, columns], omega[:, None], self.rest[columns]).gain
        return out

    def slopes(self, amplitude: Array, omega: Array, shift: Array) -> Slopes:
        """Gain and mean of every joint with their derivatives, (points, members), at shifts from where they stand."""
        parts = [
            (columns, joint.slopes(amplitude[:, columns], omega[:, None], self.rest[columns] + shift[:, columns]))
            for joint, columns in self._alike
        ]

        def gathered(key: str) -> Any:
            out = np.empty(amplitude.shape, dtype=complex if key.startswith("gain") else float)
            for columns, slopes in parts:
                out[:, columns] = getattr(slopes, key)
            return out

        return Slopes(*(gathered(key) for key in Slopes.__annotations__))

    @cached_property
    def limit(self) -> float:
        """Largest amplitude in m up to which the mean of a single joint balances."""
        settled = self.shift(_PROBE[:, None], np.ones(len(_PROBE)))[1]
        return float(_PROBE[max(int(np.argmin(settled)) - 1, 0)]) if not np.all(settled) else np.inf


@dataclass(frozen=True, eq=False)
class Drifting(JointLaw):
    """The one joint of a machine whose mean moves, as a law of its amplitude alone."""

    biased: Biased

    kind: ClassVar[str] = "drifting"

    def __post_init__(self) -> None:
        object.__setattr__(self, "states", self._moved.states)

    @cached_property
    def _moved(self) -> Joint:
        return about(self.biased.means[0].joint, float(self.biased.rest[0]))

    def initial_state(self, displacement: Array) -> Array:
        return self._moved.initial_state(displacement)

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self._moved.step(motion, state)

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self._moved.jacobian(motion, state)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G at the mean that balances the static load at this amplitude, with the whole derivative by it."""
        A, w, _ = broadcast(amplitude, omega, bias)
        flat = A.reshape(-1, 1), w.ravel()
        gain, slope = self.biased.gains(*flat)
        shift = self.biased.shift(*flat)[0] + self.biased.rest
        found = self.biased.means[0].harmonic(flat[0], flat[1][:, None], shift)
        full = closed_form(gain[:, 0], slope[:, 0, 0], found.d_omega[:, 0], found.mean[:, 0], (A.size,))
        parts = (full.gain, full.d_amplitude, full.d_omega, full.mean, full.error)
        return FirstHarmonic(*(part.reshape(A.shape) for part in parts))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Together(Several):
    """Several joints whose means move together; `gains` takes the amplitudes of all of them."""

    biased: Biased


def force_slopes(z: ComplexArray, gain: ComplexArray, slope: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """∂g/∂Z and ∂g/∂Z* of g_m = G_m Z_m, (points, nj, nj), where every gain depends on every amplitude."""
    A = np.abs(z)
    turn = np.where(A > 0, z / np.where(A > 0, A, 1.0), 0.0)
    half = z[:, :, None] * slope / 2
    by_z = half * turn.conj()[:, None, :]
    n = np.arange(z.shape[1])
    by_z[:, n, n] += gain
    return by_z, half * turn[:, None, :]
