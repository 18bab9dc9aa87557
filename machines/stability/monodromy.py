"""How a small disturbance of a vibration grows over one cycle, the states of joints that remember among the unknowns.

Between samples the linear machine is solved exactly and the joints' forces run straight from one to the next; at a
sample every joint takes the step of its laws, linearised. So whatever a law can step it can be told the stability of.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion

from ..coupling.coordinates import Coordinates
from ..coupling.second_order import MachineEquations
from ..deadline import in_time
from ..harmonic_balance.cycle import Cycle, Harmonics
from ..harmonic_balance.remembering import steady_states

_REACH = 8.0
"""Modes up to so many times the highest frequency move by themselves; stiffer ones follow the joints' forces."""
_NUDGE = 1e-6
_NEUTRAL = 1e-6
"""A multiplier this close to 1 belongs to what stays where it is put: a free body, a slider that sticks."""
_TERMS = 14
_BLOCK = 2**21


@dataclass(frozen=True, eq=False)
class Poised:
    """A machine in the modes that disturbances move, its joints at their tangents at rest.

    q̈ + damping q̇ + diag(squared) q = −rowsᵀ G and z = T (rows q − residual G), with G = Tᵀ g and g what the joints'
    forces differ by from their tangents at rest.
    """

    squared: Array
    """(rad/s)², (modes,)."""
    damping: Array
    """1/s, (modes, modes)."""
    rows: Array
    """Of the independent motions of the nonlinear joints, kg^−½, (r, modes)."""
    residual: Array
    """Flexibility of the modes left out, m/N, (r, r)."""
    stiffness: Array
    """Tangents at rest of the nonlinear joints, N/m and N s/m, (nj,)."""
    viscous: Array
    joints: tuple[Joint, ...]
    members: tuple[int, ...]
    """Indices of the nonlinear ones among all joints."""
    coordinates: Coordinates

    @classmethod
    def of(cls, equations: MachineEquations, joints: Sequence[Joint], highest: float, rest: Array) -> Poised:
        """Modes up to a few times the highest angular frequency (rad/s), joints at rest at these displacements (m)."""
        k = np.array([_stiffness_at(joint, z) for joint, z in zip(joints, rest.tolist(), strict=True)])
        c = np.array([_damping_at_rest(joint) for joint in joints])
        R = equations.joints
        squared, modes = scipy.linalg.eigh(equations.stiffness + R.T @ (k[:, None] * R), equations.mass)
        own = tuple(i for i, joint in enumerate(joints) if not _is_plain(joint))
        slow = squared <= (_REACH * highest) ** 2
        coordinates = Coordinates.of(R[list(own)])
        seen = R[[own[row] for row in coordinates.rows]] @ modes
        stiff = seen[:, ~slow]
        damping = modes.T @ (equations.damping + R.T @ (c[:, None] * R)) @ modes
        return cls(
            squared[slow],
            damping[np.ix_(slow, slow)],
            seen[:, slow],
            (stiff / squared[~slow]) @ stiff.T,
            k[list(own)],
            c[list(own)],
            tuple(joints[i] for i in own),
            own,
            coordinates,
        )

    @property
    def size(self) -> int:
        """Rows of the monodromy matrix: what no joint remembers follows from where the machine is."""
        states = sum(len(joint.states) for joint in self.joints)
        return 2 * len(self.squared) + (len(self.rows) + states if states else 0)


def _is_plain(joint: Joint) -> bool:
    return all(law.linear and not law.states for law in joint.laws)


def _stiffness_at(joint: Joint, z: float) -> float:
    found = float(joint.jacobian(Motion(np.array([z]), np.zeros(1)), joint.initial_state(np.array([z])))[0][0])
    return found if np.isfinite(found) else 0.0


def _damping_at_rest(joint: Joint) -> float:
    """Of the linear laws alone: friction that is viscous at rest is so at rest only."""
    still = Motion(np.zeros(1), np.zeros(1))
    plain = [law for law in joint.laws if law.linear and not law.states]
    return float(sum(law.jacobian(still, law.initial_state(np.zeros(1)))[1][0] for law in plain))


def largest_multiplier(
    poised: Poised, z: ComplexArray, omega: Array, harmonics: Harmonics, samples: int = 256
) -> Array:
    """Size of the largest Floquet multiplier per point that is not neutral; above 1 a disturbance grows.

    Parameters
    ----------
    z
        Motions of all flexible joints in m, shape (points, nh, joints).
    omega
        rad/s, (points,).
    samples
        Of a cycle.
    """
    out = np.empty(len(omega))
    each = max(1, _BLOCK // (samples * poised.size**2))
    for begin in range(0, len(omega), each):
        now = slice(begin, begin + each)
        matrix = monodromy(poised, z[now][:, :, list(poised.members)], omega[now], harmonics, samples)
        fine = np.all(np.isfinite(matrix), axis=(1, 2))
        found = np.linalg.eigvals(np.where(fine[:, None, None], matrix, 0.0))
        moving = np.where(np.abs(found - 1) > _NEUTRAL, np.abs(found), 0.0)
        out[now] = np.where(fine, np.max(moving, axis=1, initial=0.0), np.nan)
    return out


def monodromy(poised: Poised, z: ComplexArray, omega: Array, harmonics: Harmonics, samples: int = 256) -> Array:
    """What one cycle makes of [q, q̇/ω, G/ω², states], (points, size, size); z moves the nonlinear joints alone.

    Where no joint remembers, the forces follow from motions, G = E [q, q̇/ω], and are none of the unknowns.
    ``samples`` is a power of two. `OutOfTime` once a deadline is over.
    """
    in_time()
    m, r = len(poised.squared), len(poised.rows)
    w = omega[:, None, None, None]
    free, first, last = (part[:, None] for part in _between(poised, omega, 2 * np.pi / samples))
    cycle = Cycle.of(harmonics, samples)
    steps = [_Linearised.of(joint, cycle, z[:, :, j], omega) for j, joint in enumerate(poised.joints)]
    ends = np.cumsum([0, *(len(joint.states) for joint in poised.joints)])
    states = [slice(2 * m + r + a, 2 * m + r + b) for a, b in pairwise(ends.tolist())]
    # In units of the angular frequency: time in 1/ω, so that velocities and forces are of the size of displacements.
    k, c = (
        poised.coordinates.matrix(np.stack([p.force[n] - at for p, at in zip(steps, rest, strict=True)], axis=2))
        for n, rest in enumerate((poised.stiffness, poised.viscous))
    )
    pressed = poised.residual * w**2
    seen = np.concatenate([k / w**2 @ poised.rows, c / w @ poised.rows], axis=3)
    pushed = np.eye(r) + k / w**2 @ pressed
    if not ends[-1]:
        follows = np.linalg.solve(pushed, seen)
        drift = free - first @ np.roll(follows, 1, axis=1)
        return _product(drift - last @ np.linalg.solve(pushed + seen @ last, seen @ drift))
    step = np.zeros((len(omega), samples, poised.size, poised.size))
    drift, force, after = step[:, :, : 2 * m], step[:, :, 2 * m : 2 * m + r], step[:, :, 2 * m + r :]
    drift[..., : 2 * m], drift[..., 2 * m : 2 * m + r] = free, -first
    force[:] = seen @ drift
    T = poised.coordinates.T
    for j, part in enumerate(steps):
        force[..., states[j]] += T[j, :, None] * part.force[2][..., None, :] / w**2
    force[:] = np.linalg.solve(pushed + seen @ last, force)
    drift -= last @ force
    moved, speed = poised.rows @ drift[:, :, :m] - pressed @ force, w * (poised.rows @ drift[:, :, m:])
    for j, part in enumerate(steps):
        by_z, by_v, by_state = part.state
        rows = slice(int(ends[j]), int(ends[j + 1]))
        after[:, :, rows] = by_z[..., None] * (T[j] @ moved)[:, :, None] + by_v[..., None] * (T[j] @ speed)[:, :, None]
        after[:, :, rows, states[j]] += by_state
    return _product(step)


def _product(step: Array) -> Array:
    """All steps of a cycle, (points, samples, size, size), one after another."""
    while step.shape[1] > 1:
        step = step[:, 1::2] @ step[:, ::2]
    return np.asarray(step[:, 0])


def _between(poised: Poised, omega: Array, step: float) -> tuple[Array, Array, Array]:
    """Over a step of angle: [q, q̇/ω] from itself, and less what G/ω² at its beginning and at its end do."""
    m, r, points = len(poised.squared), len(poised.rows), len(omega)
    whole = np.zeros((points, 2 * m + 2 * r, 2 * m + 2 * r))
    whole[:, :m, m : 2 * m] = np.eye(m)
    whole[:, m : 2 * m, :m] = -np.diag(poised.squared) / omega[:, None, None] ** 2
    whole[:, m : 2 * m, m : 2 * m] = -poised.damping / omega[:, None, None]
    whole[:, m : 2 * m, 2 * m : 2 * m + r] = poised.rows.T
    whole[:, 2 * m : 2 * m + r, 2 * m + r :] = np.eye(r) / step
    found = _exponential(whole * step)
    ramp = found[:, : 2 * m, 2 * m + r :]
    return found[:, : 2 * m, : 2 * m], found[:, : 2 * m, 2 * m : 2 * m + r] - ramp, ramp


def _exponential(A: Array) -> Array:
    """e^A of many small matrices side by side, by its series and squaring."""
    halvings = max(0, int(np.ceil(np.log2(np.max(np.sum(np.abs(A), axis=2), initial=1e-300)))) + 1)
    unit = np.eye(A.shape[1])
    part, out = A / 2.0**halvings, np.broadcast_to(unit, A.shape)
    for n in range(_TERMS, 0, -1):
        out = unit + part @ out / n
    for _ in range(halvings):
        out = out @ out
    return np.asarray(out)


@dataclass(frozen=True, eq=False)
class _Linearised:
    """The step of one joint at every sample of its cycle: by displacement, velocity and the states before it."""

    force: tuple[Array, Array, Array]
    """N/m, N s/m, (points, samples); N per state, (points, samples, states)."""
    state: tuple[Array, Array, Array]
    """(points, samples, states), the last (points, samples, states, states)."""

    @classmethod
    def of(cls, joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> _Linearised:
        motion = cycle.motion(z, omega)
        before = steady_states(joint, cycle, z, omega)
        timed = Motion(motion.displacement, motion.velocity, (2 * np.pi / len(cycle.angle) / omega)[:, None])
        size = np.maximum(np.max(np.abs(motion.displacement), axis=1, keepdims=True), 1e-300) * _NUDGE
        columns = list(_differences(joint, timed, before, size, omega))
        forces, states = zip(*columns, strict=True)
        force, state = np.stack(forces, axis=-1), np.stack(states, axis=-1)
        return cls((force[..., 0], force[..., 1], force[..., 2:]), (state[..., 0], state[..., 1], state[..., 2:]))


def _differences(
    joint: Joint, motion: Motion, before: Array, size: Array, omega: Array
) -> Iterator[tuple[Array, Array]]:
    """Central differences of a step's force and states by z (m), ż (m/s) and every state (m), nudged by ``size``."""
    z, v, h = motion.displacement, motion.velocity, motion.duration
    fast = size * omega[:, None]
    none, still = np.zeros_like(size), np.zeros(before.shape[-1])
    nudges = [(size, none, still, size), (none, fast, still, fast)]
    nudges += [(none, none, row, size) for row in np.eye(before.shape[-1])]
    for dz, dv, row, length in nudges:
        ds = size[..., None] * row
        (f1, s1), (f0, s0) = (joint.step(Motion(z + q * dz, v + q * dv, h), before + q * ds) for q in (1.0, -1.0))
        yield (f1 - f0) / (2 * length), (s1 - s0) / (2 * length[..., None])
