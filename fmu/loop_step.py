"""The largest communication step at which a machine cut into FMUs is stable, for the machine as it is assembled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
import scipy

from jointlib.arrays import Array

_NOTHING = 1e-5
"""Loss per radian, as a part of what the joints store, below which a mode counts as undamped."""
_ON_CIRCLE = 1e-12
_RATIO = 1.1
_ACCURACY = 1e-6


class Master(Enum):
    """When a master hands values over. The value is the mean age of a joint force, in steps."""

    JACOBI = 1.5
    """All FMUs step at once, then values are exchanged: libcosim, Ecos, FMPy, fmucontainer."""
    GAUSS_SEIDEL = 0.5
    """The joints answer the motion at the end of a step before the next one begins: fmucontainer -sequential."""


@dataclass(frozen=True, eq=False)
class Loop:
    """M p̈ + C ṗ + K p = −Jᵀ f with f = k J p + c J ṗ: the parts of a machine and its joints at one tangent.

    Mass (kg), damping (N s/m), stiffness (N/m) of shape (n, n) hold the parts, joints open; ``joints`` J has one row
    per joint, ``joint_stiffness`` k (N/m) and ``joint_damping`` c (N s/m) one value.
    """

    mass: Array
    damping: Array
    stiffness: Array
    joints: Array
    joint_stiffness: Array
    joint_damping: Array


def one_step_map(loop: Loop, step: float, master: Master) -> Array:
    """What one communication step of H s makes of the state of the coupled machine.

    The parts move exactly under a force that is held, x⁺ = e^(AH) x + ∫₀ᴴ e^(As) ds B f. A Gauss-Seidel master
    takes f from x; with a Jacobi master f is a state of its own, taken from x one step before.
    """
    return _map(*_open(loop), step, master)


def largest_step(loop: Loop, master: Master) -> float | None:
    """The smallest step in s at which the one-step map has an eigenvalue outside the unit circle.

    None where every step is unstable, as a mode in which a joint takes part loses next to nothing (per radian less
    than 1e-5 of what the joints store in it). Infinite where no step is: there is no joint, or none that does
    anything. Searched upwards in steps of 10 % from a thirtieth of what light damping predicts, and refined to 1e-6.
    Motions that meet neither stiffness nor damping nor a joint are left out: they stay on the unit circle at any step.
    """
    A, B, F = _open(loop)
    half = len(A) // 2
    rates, shapes = np.linalg.eig(A + B @ F)
    speed, lost = np.abs(rates), -2 * rates.real
    # What the joints do in a mode, as an acceleration; less than 1e-9 of the whole is rounding.
    felt = np.linalg.norm(B @ (F @ shapes), axis=0)
    touched = (speed > 1e-9 * np.max(speed, initial=0.0)) & (
        felt > 1e-9 * speed * np.linalg.norm(shapes[half:], axis=0)
    )
    if not np.any(touched):
        return math.inf
    q, speed, lost = shapes[:half, touched], speed[touched], lost[touched]
    # The joints' part of ω² in a mode; a force that is `age` steps old takes age·H times that from 2 ζ ω.
    worked = np.sum(np.conj(-B[half:].T @ q) * (F[:, :half] @ q), axis=0).real
    stored = A[0, half] * worked / np.sum(np.abs(q) ** 2, axis=0)
    if np.any(lost * speed < _NOTHING * np.maximum(stored, 0.0)) or np.any(lost <= 0):
        return None
    estimate = float(np.min(lost / np.maximum(stored, lost * speed))) / master.value
    low = estimate / 30
    end = 20 * np.pi / float(np.min(speed))

    def grows(step: float) -> bool:
        return bool(np.max(np.abs(np.linalg.eigvals(_map(A, B, F, step, master)))) > 1 + _ON_CIRCLE)

    while grows(low):
        low /= 10
        if low * np.max(speed) < _ON_CIRCLE:
            return None
    high = low
    while not grows(high):
        low, high = high, high * _RATIO
        if low > end:
            return math.inf
    while high - low > _ACCURACY * low:
        middle = (low + high) / 2
        low, high = (low, middle) if grows(middle) else (middle, high)
    return low


def natural_frequencies(loop: Loop) -> Array:
    """Undamped natural frequencies of the assembled machine at these tangents in Hz, ascending; free motions are 0."""
    K = loop.stiffness + loop.joints.T @ (loop.joint_stiffness[:, None] * loop.joints)
    inverse = np.linalg.inv(np.linalg.cholesky(loop.mass))
    squared = np.linalg.eigvalsh(inverse @ K @ inverse.T)
    floor = 1e-9 * float(np.max(np.abs(squared), initial=0.0))
    return np.asarray(np.sqrt(np.where(squared > floor, squared, 0.0)) / (2 * np.pi))


def _map(A: Array, B: Array, F: Array, step: float, master: Master) -> Array:
    n, m = B.shape
    held = scipy.linalg.expm(np.block([[A, B], [np.zeros((m, n + m))]]) * step)[:n]
    if master is Master.GAUSS_SEIDEL:
        return np.asarray(held[:, :n] + held[:, n:] @ F)
    return np.block([[held], [F, np.zeros((m, m))]])


def _open(loop: Loop) -> tuple[Array, Array, Array]:
    """A, B, F of x' = A x + B f, f = F x, in mass-normalised coordinates, motions that nothing holds left out.

    x = (q Ω, q̇) with Ω the largest natural frequency, so that both halves are of one size.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(loop.mass))
    K, C = (inverse @ matrix @ inverse.T for matrix in (loop.stiffness, loop.damping))
    J = loop.joints @ inverse.T
    held = [part / np.max(np.abs(part)) for part in (K, C, J) if np.any(part)]
    if not held:
        return np.zeros((0, 0)), np.zeros((0, len(J))), np.zeros((len(J), 0))
    free = scipy.linalg.null_space(np.concatenate(held), rcond=1e-9)
    N = scipy.linalg.null_space(free.T) if free.size else np.eye(len(K))
    K, C, J = N.T @ K @ N, N.T @ C @ N, J @ N
    k, c = loop.joint_stiffness[:, None], loop.joint_damping[:, None]
    scale = math.sqrt(float(np.max(np.abs(np.linalg.eigvalsh(K + J.T @ (k * J)))))) or 1.0
    zero = np.zeros_like(K)
    A = np.block([[zero, scale * np.eye(len(K))], [-K / scale, -C]])
    return A, np.concatenate([np.zeros_like(J.T), -J.T]), np.concatenate([k * J / scale, c * J], axis=1)
