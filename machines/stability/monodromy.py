"""How a small disturbance of a vibration grows over one cycle, the states of joints that remember among the unknowns.

Between samples the linear machine is solved exactly and the joints' forces run straight from one to the next; at a
sample every joint takes the step of its laws, linearised. So whatever a law can step it can be told the stability of.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion

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

    q̈ + damping q̇ + diag(squared) q = −rowsᵀ g and z = rows q − residual g, with g what the joints' forces differ by
    from their tangents at rest.
    """

    squared: Array
    """(rad/s)², (modes,)."""
    damping: Array
    """1/s, (modes, modes)."""
    rows: Array
    """Of the nonlinear joints, kg^−½, (nj, modes)."""
    residual: Array
    """Flexibility of the modes left out, m/N, (nj, nj)."""
    stiffness: Array
    """Tangents at rest of the nonlinear joints, N/m and N s/m, (nj,)."""
    viscous: Array
    joints: tuple[Joint, ...]
    members: tuple[int, ...]
    """Indices of the nonlinear ones among all joints."""

    @classmethod
    def of(cls, equations: MachineEquations, joints: Sequence[Joint], highest: float, rest: Array) -> Poised:
        """Modes up to a few times the highest angular frequency (rad/s), joints at rest at these displacements (m)."""
        k = np.array([_stiffness_at(joint, z) for joint, z in zip(joints, rest.tolist(), strict=True)])
        c = np.array([_damping_at_rest(joint) for joint in joints])
        R = equations.joints
        squared, modes = eigh(equations.stiffness + R.T @ (k[:, None] * R), equations.mass)
        own = tuple(i for i, joint in enumerate(joints) if not _is_plain(joint))
        slow = squared <= (_REACH * highest) ** 2
        seen = R @ modes
        stiff = seen[:, ~slow][list(own)]
        damping = modes.T @ (equations.damping + R.T @ (c[:, None] * R)) @ modes
        return cls(
            squared[slow],
            damping[np.ix_(slow, slow)],
            seen[:, slow][list(own)],
            (stiff / squared[~slow]) @ stiff.T,
            k[list(own)],
            c[list(own)],
            tuple(joints[i] for i in own),
            own,
        )

    @property
    def size(self) -> int:
        """Rows of the monodromy matrix."""
        return 2 * len(self.squared) + len(self.joints) + sum(len(joint.states) for joint in self.joints)


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
    """What one cycle makes of [q, q̇/ω, g/ω², states], (points, size, size); z moves the nonlinear joints alone.

    ``samples`` is a power of two. `OutOfTime` once a deadline is over.
    """
    in_time()
    m, nj = len(poised.squared), len(poised.joints)
    w = omega[:, None, None, None]
    free, first, last = (part[:, None] for part in _between(poised, omega, 2 * np.pi / samples))
    cycle = Cycle.of(harmonics, samples)
    steps = [_Linearised.of(joint, cycle, z[:, :, j], omega) for j, joint in enumerate(poised.joints)]
    ends = np.cumsum([0, *(len(joint.states) for joint in poised.joints)])
    states = [slice(2 * m + nj + a, 2 * m + nj + b) for a, b in pairwise(ends.tolist())]
    # In units of the angular frequency: time in 1/ω, so that velocities and forces are of the size of displacements.
    k, c = (
        np.stack([part.force[n] - at_rest for part, at_rest in zip(steps, rest, strict=True)], axis=2)[..., None]
        for n, rest in enumerate((poised.stiffness, poised.viscous))
    )
    k, c = k / w**2, c / w
    pressed = poised.residual * w**2
    step = np.zeros((len(omega), samples, 2 * m + nj + int(ends[-1]), 2 * m + nj + int(ends[-1])))
    drift, force, after = step[:, :, : 2 * m], step[:, :, 2 * m : 2 * m + nj], step[:, :, 2 * m + nj :]
    drift[..., : 2 * m], drift[..., 2 * m : 2 * m + nj] = free, -first
    seen = np.concatenate([k * poised.rows, c * poised.rows], axis=3)
    force[:] = seen @ drift
    for j, part in enumerate(steps):
        force[:, :, j, states[j]] += part.force[2] / w[..., 0] ** 2
    held = np.eye(nj) + k * pressed + seen @ last
    force[:] = force / held if nj == 1 else np.linalg.solve(held, force)
    drift -= last @ force
    moved, speed = poised.rows @ drift[:, :, :m] - pressed @ force, w * (poised.rows @ drift[:, :, m:])
    for j, part in enumerate(steps):
        by_z, by_v, by_state = part.state
        rows = slice(int(ends[j]), int(ends[j + 1]))
        after[:, :, rows] = by_z[..., None] * moved[:, :, j, None] + by_v[..., None] * speed[:, :, j, None]
        after[:, :, rows, states[j]] += by_state
    while step.shape[1] > 1:
        step = step[:, 1::2] @ step[:, ::2]
    return np.asarray(step[:, 0])


def _between(poised: Poised, omega: Array, step: float) -> tuple[Array, Array, Array]:
    """Over a step of angle: [q, q̇/ω] from itself, and less what g/ω² at its beginning and at its end do."""
    m, nj, points = len(poised.squared), len(poised.joints), len(omega)
    whole = np.zeros((points, 2 * m + 2 * nj, 2 * m + 2 * nj))
    whole[:, :m, m : 2 * m] = np.eye(m)
    whole[:, m : 2 * m, :m] = -np.diag(poised.squared) / omega[:, None, None] ** 2
    whole[:, m : 2 * m, m : 2 * m] = -poised.damping / omega[:, None, None]
    whole[:, m : 2 * m, 2 * m : 2 * m + nj] = poised.rows.T
    whole[:, 2 * m : 2 * m + nj, 2 * m + nj :] = np.eye(nj) / step
    found = _exponential(whole * step)
    ramp = found[:, : 2 * m, 2 * m + nj :]
    return found[:, : 2 * m, : 2 * m], found[:, : 2 * m, 2 * m : 2 * m + nj] - ramp, ramp


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
