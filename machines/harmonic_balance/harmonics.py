"""A joint that moves with several harmonics at once: the harmonics of its force and how they follow the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import JointLaw, MemorylessLaw, Motion

from ..statics.mean_force import SLOW
from .creeping import look_ahead
from .newton import gains

Harmonics = tuple[int, ...]
"""Multiples of the driving frequency, ascending from 1; 0, the mean, stands last where it is solved for."""

_SMOOTH, _BENT, _REMEMBERING = 64, 1024, 512
"""Samples of a cycle for laws that are smooth, for those that are not, and for those that remember."""
_BLOCK = 2**23
"""Samples of all harmonics held at a time; bounds the memory."""
_CYCLES = 200
_REPEATS = 1e-10
_NUDGE = 1e-6
_PROBE = np.geomspace(1e-9, 1e-3, 25)
_EVEN = 1e-9


@dataclass(frozen=True, eq=False)
class Forces:
    """Phasors of the joint forces in N and their derivatives by the motions and by their conjugates in N/m."""

    force: ComplexArray
    """(points, nh, nj)."""
    by_z: ComplexArray
    """∂g_h/∂Z_m, (points, nh, nh, nj)."""
    by_conjugate: ComplexArray
    """∂g_h/∂Z_m*, (points, nh, nh, nj)."""
    travel: Array
    """Largest displacement in the cycle in m, (points, nj)."""


def joint_forces(
    joints: Sequence[Joint],
    z: ComplexArray,
    omega: Array,
    harmonics: Harmonics,
    most: int = _BENT,
    rest: Array | float = 0.0,
    slopes: bool = True,
) -> Forces:
    """Forces of joints that move by Σ Re(Z_h e^(jhωt)), z of shape (points, nh, nj) in m; ω in rad/s, (points,).

    One harmonic: the exact describing function. Several: the laws are sampled over the cycle (alternating frequency
    and time), those with memory over whole cycles until their state repeats; a cycle that does not repeat is nan. The
    mean, harmonic 0, is real: Z_0 counts by its real part, the force by its average. The travel counts from ``rest``
    (m, per joint), and what remembers was loaded from 0, slowly. Without ``slopes`` the derivatives of what is not
    linear, which cost many times its force, are left out.
    """
    if harmonics == (1,):
        A, Z = np.abs(z[:, 0]), z[:, 0]
        gain, slope = gains(joints, A, omega)
        half = slope * A / 2
        turn = np.where(A > 0, Z / np.where(A > 0, A, 1.0), 0.0) ** 2
        return Forces((gain * Z)[:, None], (gain + half)[:, None, None], (turn * half)[:, None, None], A)
    out = Forces(
        np.empty(z.shape, dtype=complex),
        np.empty((len(z), len(harmonics), *z.shape[1:]), dtype=complex),
        np.empty((len(z), len(harmonics), *z.shape[1:]), dtype=complex),
        np.empty((len(z), z.shape[2])),
    )
    for columns in _together(joints):
        joint, c = joints[columns[0]], len(columns)
        cases = np.moveaxis(z[:, :, columns], 1, 2).reshape(-1, len(harmonics))
        place = np.tile(np.broadcast_to(rest, len(joints))[columns], len(z))
        every, chunk = np.repeat(omega, c), max(1, _BLOCK // (most * len(harmonics)))
        pieces = [slice(begin, begin + chunk) for begin in range(0, len(cases), chunk)]
        parts = [_one(joint, cases[now], every[now], harmonics, most, place[now], slopes) for now in pieces]
        found = [np.concatenate(same) for same in zip(*parts, strict=True)] if parts else []
        for whole, part in zip((out.force, out.by_z, out.by_conjugate, out.travel), found, strict=bool(parts)):
            whole[..., columns] = np.moveaxis(part.reshape(len(z), c, *part.shape[1:]), 1, -1)
    return out


def with_mean(harmonics: Harmonics, moves: bool) -> Harmonics:
    """These harmonics, and the mean where it moves."""
    return (*(h for h in harmonics if h), *([0] if moves else []))


def overtones_of(harmonics: Harmonics) -> Harmonics:
    """Those above the first."""
    return tuple(h for h in harmonics if h > 1)


def is_odd(joint: Joint) -> bool:
    """Whether a motion without a mean and even harmonics leaves the force without them too."""
    still = np.zeros((len(_PROBE), 1))
    z = np.concatenate([_PROBE[:, None], still], axis=1)[:, :, None].astype(complex)
    found = joint_forces([joint], z, np.full(len(_PROBE), 1e3), (1, 2)).force[:, :, 0]
    return bool(np.all(np.abs(found[:, 1]) <= _EVEN * np.abs(found[:, 0])))


def jumps(joint: Joint) -> bool:
    """Whether a force jumps with the velocity, as ideal friction does: a sampled cycle cannot carry its derivative."""
    sliding = [law for law in joint.laws if isinstance(law, MemorylessLaw) and not law.linear]
    ends = np.array([-1e-12, 1e-12, -1.0, 1.0])
    for law in sliding:
        f = law.force(np.zeros(4), ends)
        if abs(f[1] - f[0]) > 1e-3 * abs(f[3] - f[2]) > 0:
            return True
    return False


def _together(joints: Sequence[Joint]) -> list[list[int]]:
    columns: dict[int, list[int]] = {}
    for j, joint in enumerate(joints):
        columns.setdefault(id(joint), []).append(j)
    return list(columns.values())


def _shares(harmonics: Harmonics) -> Array:
    """What of a derivative goes to Z: the mean is real, so half of its goes to Z*."""
    return np.where(np.array(harmonics) > 0, 1.0, 0.5)


def _bent(law: JointLaw) -> bool:
    return isinstance(law, MemorylessLaw) and any(len(where) for where in law.kinks())


def _one(
    joint: Joint, z: ComplexArray, omega: Array, harmonics: Harmonics, most: int, rest: Array, slopes: bool = True
) -> tuple[ComplexArray, ComplexArray, ComplexArray, Array]:
    """Force, its two derivatives and the travel of one joint over cases z (cases, nh)."""
    linear, bent = joint.parted(lambda law: law.linear)
    remembering, memoryless = bent.parted(lambda law: bool(law.states))
    h, share = np.array(harmonics), _shares(harmonics)
    nh, every = len(h), np.arange(len(h))
    cycle = _cycle(joint, harmonics, most)
    force = np.zeros(z.shape, dtype=complex)
    by_z = np.zeros((len(z), nh, nh), dtype=complex)
    by_conjugate = np.zeros_like(by_z)
    for law in linear.laws:
        gain = law.first_harmonic(0.0, omega[:, None] * h).gain
        force += gain * z
        by_z[:, every, every] += gain * share
        by_conjugate[:, every, every] += gain * (1 - share)
    motion = cycle.motion(z, omega)
    if memoryless.laws:
        force += cycle.project(memoryless.step(motion, np.empty((*motion.displacement.shape, 0)))[0])
        if slopes:
            tangents = tangent(memoryless, cycle, motion, 2 * max(harmonics))
            first, second = slopes_of_harmonics(tangents, harmonics, omega)
            by_z, by_conjugate = by_z + first, by_conjugate + second
    if remembering.laws:
        first, second, third = _with_memory(remembering, cycle, z, omega, slopes)
        force, by_z, by_conjugate = force + first, by_z + second, by_conjugate + third
    return force, by_z, by_conjugate, np.max(np.abs(motion.displacement - rest[:, None]), axis=1)


@dataclass(frozen=True, eq=False)
class Cycle:
    """Equal samples of a cycle, and the harmonics of a motion there."""

    angle: Array
    harmonics: Array
    basis: ComplexArray
    """e^(jhθ), (nh, samples)."""

    @staticmethod
    @lru_cache(maxsize=16)
    def of(harmonics: Harmonics, samples: int) -> Cycle:
        angle = 2 * np.pi * np.arange(samples) / samples
        h = np.array(harmonics, dtype=float)
        return Cycle(angle, h, np.exp(1j * h[:, None] * angle))

    def motion(self, z: ComplexArray, omega: Array) -> Motion:
        """Displacement and velocity of cases z (cases, nh), each (cases, samples)."""
        rate = 1j * self.harmonics * omega[:, None] * z
        return Motion((z @ self.basis).real, (rate @ self.basis).real)

    def project(self, force: Array) -> ComplexArray:
        """Phasors of a sampled force, (cases, nh)."""
        return np.asarray(force @ self.basis.conj().T * np.where(self.harmonics > 0, 2, 1) / len(self.angle))


def tangent(joint: Joint, cycle: Cycle, motion: Motion, highest: int) -> tuple[ComplexArray, ComplexArray]:
    """Fourier coefficients 0 … highest of the tangent stiffness and damping along a cycle, (cases, highest + 1)."""
    k, c = joint.jacobian(motion, np.empty((*motion.displacement.shape, 0)))
    wave = np.exp(-1j * cycle.angle[:, None] * np.arange(highest + 1)) / len(cycle.angle)
    return k @ wave, c @ wave


def slopes_of_harmonics(
    slopes: tuple[ComplexArray, ComplexArray], harmonics: Harmonics, omega: Array
) -> tuple[ComplexArray, ComplexArray]:
    """∂g_h/∂Z_m = κ_(h−m) + jmω γ_(h−m) and ∂g_h/∂Z_m* = κ_(h+m) − jmω γ_(h+m), (cases, nh, nh); half for h = 0."""
    h = np.array(harmonics)
    difference, total = h[:, None] - h, h[:, None] + h
    rate = 1j * omega[:, None, None] * h

    def at(coefficient: ComplexArray, n: np.ndarray) -> ComplexArray:
        value = coefficient[:, np.abs(n)]
        return np.asarray(np.where(n < 0, value.conj(), value))

    (k, c), share = slopes, _shares(harmonics)[:, None]
    by_z, by_conjugate = at(k, difference) + rate * at(c, difference), at(k, total) - rate * at(c, total)
    return share * by_z, share * by_conjugate


def tangent_harmonics(
    joints: Sequence[Joint], z: ComplexArray, omega: Array, harmonics: Harmonics, highest: int
) -> tuple[ComplexArray, ComplexArray]:
    """Fourier coefficients 0 … highest of the tangents of joints without memory, (points, highest + 1, nj)."""
    k = np.empty((len(z), highest + 1, z.shape[2]), dtype=complex)
    c = np.empty_like(k)
    for j, joint in enumerate(joints):
        cycle = _cycle(joint, harmonics)
        k[:, :, j], c[:, :, j] = tangent(joint, cycle, cycle.motion(z[:, :, j], omega), highest)
    return k, c


def _cycle(joint: Joint, harmonics: Harmonics, most: int = _BENT) -> Cycle:
    samples = _REMEMBERING if joint.states else _BENT if any(_bent(law) for law in joint.laws) else _SMOOTH
    return Cycle.of(harmonics, max(min(samples, most), 16 * max(harmonics)))


def _with_memory(
    joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array, slopes: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Force and derivatives by small changes of every part, all stepped side by side; without slopes they are 0."""
    cases, nh = z.shape
    if not slopes:
        none = np.zeros((cases, nh, nh), dtype=complex)
        return cycle.project(_steady_force(joint, cycle, z, omega)), none, none
    size = np.maximum(np.max(np.abs(z), axis=1), 1e-300)
    nudges = np.zeros((2 * nh + 1, nh), dtype=complex)
    nudges[1 : nh + 1], nudges[nh + 1 :] = _NUDGE * np.eye(nh), 1j * _NUDGE * np.eye(nh)
    moved = z[:, None] + size[:, None, None] * nudges
    steady = _steady_force(joint, cycle, moved.reshape(-1, nh), np.repeat(omega, 2 * nh + 1))
    g = cycle.project(steady).reshape(cases, 2 * nh + 1, nh)
    change = (g[:, 1:] - g[:, :1]) / (_NUDGE * size[:, None, None])
    by_real, by_imaginary = (np.swapaxes(part, 1, 2) for part in (change[:, :nh], change[:, nh:]))
    return g[:, 0], (by_real - 1j * by_imaginary) / 2, (by_real + 1j * by_imaginary) / 2


def _steady_force(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> Array:
    """Force over the steady cycle, (cases, samples); nan where it does not repeat."""
    return _steady(joint, cycle, z, omega)[0]


def steady_states(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> Array:
    """States before the step to every sample of the steady cycle, (cases, samples, states); nan as for the force."""
    return _steady(joint, cycle, z, omega)[1]


def _steady(joint: Joint, cycle: Cycle, z: ComplexArray, omega: Array) -> tuple[Array, Array]:
    """Force at the samples and states before them, begun at the largest displacement, slowly loaded from 0.

    So a slider that sticks all along holds no force in the mean of a motion about 0.
    """
    motion, n = cycle.motion(z, omega), len(cycle.angle)
    begin = np.argmax(motion.displacement, axis=1)
    order = (begin[:, None] + np.arange(n)) % n
    x, v = (np.take_along_axis(part, order, axis=1) for part in (motion.displacement, motion.velocity))
    step = 2 * np.pi / n / omega
    state = joint.step(Motion(x[:, 0], np.zeros(len(x)), SLOW), joint.initial_state(np.zeros(len(x))))[1]
    # Samples first, and a single law without the detour over the sum: the step is what all this waits for.
    advance = joint.laws[0].step if len(joint.laws) == 1 else joint.step
    x, v = np.ascontiguousarray(x.T), np.ascontiguousarray(v.T)
    rolled, states = np.full_like(x, np.nan), np.full((n + 1, *state.shape), np.nan)
    left, before = np.arange(len(z)), np.full(state.shape, np.nan)
    for _ in range(_CYCLES):
        pulled, through = np.empty_like(x), np.empty((n + 1, *state.shape))
        through[0] = state
        for i in range(n):
            pulled[i], state = advance(Motion(x[i], v[i], step), state)
            through[i + 1] = state
        moved, spread = state - through[0], np.ptp(through, axis=0)
        closing = _REPEATS * spread + 1e-14 * np.max(np.abs(through), axis=0)
        open_ = np.any(np.abs(moved) > closing, axis=1)
        closed = left[~open_]
        rolled[:, closed], states[:, closed] = pulled[:, ~open_], through[:, ~open_]
        left = left[open_]
        if not len(left):
            break
        x, v, step = x[:, open_], v[:, open_], step[open_]
        state, before = look_ahead(state[open_], moved[open_], before[open_])
    force, at = np.empty((len(z), n)), np.empty((len(z), n, state.shape[-1]))
    np.put_along_axis(force, order, rolled.T, axis=1)
    np.put_along_axis(at, order[:, :, None], np.swapaxes(states[:-1], 0, 1), axis=1)
    return force, at
