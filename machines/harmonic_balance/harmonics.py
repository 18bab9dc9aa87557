"""A joint that moves with several harmonics at once: the harmonics of its force and how they follow the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import JointLaw, MemorylessLaw
from jointlib.parameter import Role, parameters_of

from ..deadline import in_time
from ..indices import Mask
from ..statics.asked_together import Several, same_joints
from .cycle import Cycle, Harmonics, shares, slope_by_frequency, slopes_of_harmonics, tangent
from .newton import gains
from .remembering import stays, with_memory

_SMOOTH, _BENT, _REMEMBERING = 64, 1024, 512
"""Samples of a cycle for laws that are smooth, for those that are not, and for those that remember."""
_BLOCK = 2**23
"""Samples of all harmonics held at a time; bounds the memory."""
_FAR = 2.0
"""Of the largest motion, the distance from where a law bends at which the force is smooth."""
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
    by_omega: ComplexArray | None = None
    """∂g_h/∂ω at the same motions in N s, (points, nh, nj); None where a closed form is as quickly asked again."""


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
    linear, which cost many times its force, are left out. `OutOfTime` once a deadline is over.
    """
    in_time()
    if harmonics == (1,):
        A, Z = np.abs(z[:, 0]), z[:, 0]
        gain, slope = gains(joints, A, omega)
        half = slope * A / 2
        turn = np.where(A > 0, Z / np.where(A > 0, A, 1.0), 0.0) ** 2
        return Forces((gain * Z)[:, None], (gain + half)[:, None, None], (turn * half)[:, None, None], A)
    nh = len(harmonics)
    by_z, by_conjugate = np.empty((2, len(z), nh, nh, z.shape[2]), dtype=complex)
    force, by_omega, travel = np.empty_like(z), np.empty_like(z), np.empty((len(z), z.shape[2]))
    for columns in joints.alike if isinstance(joints, Several) else same_joints(joints):
        joint, c = joints[columns[0]], len(columns)
        cases = np.moveaxis(z[:, :, columns], 1, 2).reshape(-1, len(harmonics))
        place = np.tile(np.broadcast_to(rest, len(joints))[columns], len(z))
        every, chunk = np.repeat(omega, c), max(1, _BLOCK // (most * len(harmonics)))
        pieces = [slice(begin, begin + chunk) for begin in range(0, len(cases), chunk)]
        parts = [_one(joint, cases[now], every[now], harmonics, most, place[now], slopes) for now in pieces]
        found = [np.concatenate(same) for same in zip(*parts, strict=True)] if parts else []
        for whole, part in zip((force, by_z, by_conjugate, by_omega, travel), found, strict=bool(parts)):
            whole[..., columns] = np.moveaxis(part.reshape(len(z), c, *part.shape[1:]), 1, -1)
    return Forces(force, by_z, by_conjugate, travel, by_omega)


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


def _bent(law: JointLaw) -> bool:
    return isinstance(law, MemorylessLaw) and any(len(where) for where in law.kinks())


def _one(
    joint: Joint, z: ComplexArray, omega: Array, harmonics: Harmonics, most: int, rest: Array, slopes: bool = True
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray, Array]:
    """Force, its three derivatives and the travel of one joint over cases z (cases, nh).

    Cases that stay far from where the law bends, or in which its sliders stick, are smooth and need few samples.
    """
    nh, fine = len(harmonics), _cycle(joint, harmonics, most)
    coarse = Cycle.of(harmonics, max(_SMOOTH, 16 * max(harmonics)))
    travel = np.max(np.abs(fine.displacement(z) - rest[:, None]), axis=1)
    if len(coarse.angle) >= len(fine.angle):
        return *_sampled(joint, z, omega, harmonics, fine, slopes), travel
    smooth = _is_smooth(joint, z, harmonics)
    out = np.empty_like(z), *np.empty((2, len(z), nh, nh), dtype=complex), np.empty_like(z)
    for cycle, rows in ((coarse, np.flatnonzero(smooth)), (fine, np.flatnonzero(~smooth))):
        if len(rows):
            for whole, part in zip(out, _sampled(joint, z[rows], omega[rows], harmonics, cycle, slopes), strict=True):
                whole[rows] = part
    return *out, travel


def _is_smooth(joint: Joint, z: ComplexArray, harmonics: Harmonics) -> Mask:
    """Cases z (cases, nh) in which no law of a joint comes near a place where it bends, and no slider slips."""
    dynamic = np.array(harmonics) > 0
    reach, mean = np.sum(np.abs(z[:, dynamic]), axis=1), np.sum(z[:, ~dynamic].real, axis=1)
    out = np.ones(len(z), dtype=bool)
    for law in joint.laws:
        if law.linear:
            continue
        if isinstance(law, MemorylessLaw):
            places, speeds = law.kinks()
            # There a law such as (d + z)^(3/2) has harmonics that fall by four from one to the next.
            out &= not speeds
            for place in places:
                out &= np.abs(place - mean) >= _FAR * reach
        else:
            gap = any(getattr(law, p.name) for p in parameters_of(law) if p.role is Role.CLEARANCE)
            out &= not gap and stays(Joint((law,)), mean + reach, mean - reach)
    return out


def _sampled(
    joint: Joint, z: ComplexArray, omega: Array, harmonics: Harmonics, cycle: Cycle, slopes: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    linear, bent = joint.parted(lambda law: law.linear)
    remembering, memoryless = bent.parted(lambda law: bool(law.states))
    h, share = np.array(harmonics), shares(harmonics)
    nh, every = len(h), np.arange(len(h))
    force = np.zeros(z.shape, dtype=complex)
    by_z = np.zeros((len(z), nh, nh), dtype=complex)
    by_conjugate, by_omega = np.zeros_like(by_z), np.zeros_like(force)
    for law in linear.laws:
        found = law.first_harmonic(0.0, omega[:, None] * h)
        gain = found.gain
        force += gain * z
        by_omega += h * found.d_omega * z
        by_z[:, every, every] += gain * share
        by_conjugate[:, every, every] += gain * (1 - share)
    if memoryless.laws:
        motion = cycle.motion(z, omega)
        force += cycle.project(memoryless.step(motion, np.empty((*motion.displacement.shape, 0)))[0])
        if slopes:
            tangents = tangent(memoryless, cycle, motion, 2 * max(harmonics))
            first, second = slopes_of_harmonics(tangents, harmonics, omega)
            by_z, by_conjugate = by_z + first, by_conjugate + second
            by_omega = by_omega + slope_by_frequency(tangents, harmonics, z)
    if remembering.laws:
        first, second, third, fourth = with_memory(remembering, cycle, z, omega, slopes)
        force, by_z, by_conjugate = force + first, by_z + second, by_conjugate + third
        by_omega = by_omega + fourth
    return force, by_z, by_conjugate, by_omega


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
