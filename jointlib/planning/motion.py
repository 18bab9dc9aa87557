"""The steady motion of a rig under a periodic force, by harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.loop.balance.steady import steady_force
from jointlib.planning.setup import Setup

OVERSAMPLING = 4
_TOLERANCE = 1e-6
_ROUNDS, _REMEMBERED = 80, 12


@dataclass(frozen=True)
class Moved:
    """One period of records side by side, arrays (points, records), SI."""

    z: Array
    v: Array
    force: Array
    """Of the joint."""
    drive: Array
    step: float
    """s between points."""


def joint_force(joint: Joint, z: Array, v: Array, step: float) -> Array:
    """Force in N along periodic paths, every law in its own steady state."""
    total = np.zeros(z.shape)
    for law in joint.laws:
        if law.states and not law.linear:
            # Half the points do for a law that is stepped: its force is an integral of the motion.
            half = np.fft.rfft(steady_force(law, z[::2], v[::2], 2 * step), axis=0)
            total += np.fft.irfft(np.pad(half, ((0, len(z) // 2 + 1 - len(half)), (0, 0))), len(z), axis=0) * 2
        else:
            total += steady_force(law, z, v, step)
    return total


def steady_motion(setup: Setup, joint: Joint, drive: Array, step: float, near: Array | None = None) -> Moved | None:
    """z̈ = P/m1 − (1/m1 + 1/m2) f with everything periodic; None where no periodic motion is found.

    With D = k + jωc, the spring and damper nearest to the joint, each line obeys
    Z = (P/m1 − (F − D Z)/μ)/(D/μ − ω²); the fixed point is mixed from the last ones so that its error is least
    (Anderson 1965), each record for itself. Nothing holds the rig, so z takes the mean at which that of f is 0.
    ``near`` is a motion to begin at.
    """
    n = len(drive)
    w = (2 * np.pi * np.fft.rfftfreq(n, step))[:, None]
    P = np.fft.rfft(drive, axis=0) / setup.m1
    mu = setup.inverse_mass
    k, c = np.full(drive.shape[1], setup.stiffness), np.full(drive.shape[1], setup.damping)
    Z = P / (mu * (k + 1j * w * c) - w**2) if near is None else np.fft.rfft(near, axis=0)
    weight = np.maximum(w, w[1])
    mixing = _Mixing(weight)
    for turn in range(_ROUNDS):
        z, v = np.fft.irfft(Z, n, axis=0), np.fft.irfft(1j * w * Z, n, axis=0)
        f = joint_force(joint, z, v, step)
        if not np.all(np.isfinite(f)):
            return None
        if turn in (0, 3, 8):
            k, c = _nearest(z, v, f)
            mixing = _Mixing(weight)
        D = k + 1j * w * c
        towards = (P - mu * (np.fft.rfft(f, axis=0) - D * Z)) / (mu * D - w**2)
        gap = np.linalg.norm(weight * (towards - Z), axis=0) / np.linalg.norm(weight * towards, axis=0)
        if np.max(gap) < _TOLERANCE:
            return Moved(z, v, f, drive, step)
        if not np.all(np.isfinite(gap)) or np.max(gap) > 1e3:
            return None
        Z = mixing.next(Z, towards)
    return None


def _nearest(z: Array, v: Array, f: Array) -> tuple[Array, Array]:
    """Spring in N/m and damper in N s/m nearest to a force, by record."""
    f = f - f.mean(axis=0)
    k = np.sum(f * z, axis=0) / np.sum(z * z, axis=0)
    return k, np.sum(f * v, axis=0) / np.sum(v * v, axis=0)


class _Mixing:
    """What the last guesses led to, and the mixture of them whose defect is least."""

    def __init__(self, weight: Array) -> None:
        self.weight = weight
        self.towards: list[ComplexArray] = []
        self.defects: list[ComplexArray] = []

    def next(self, Z: ComplexArray, towards: ComplexArray) -> ComplexArray:
        """The next guess."""
        self.towards = [*self.towards[-_REMEMBERED:], towards]
        self.defects = [*self.defects[-_REMEMBERED:], self.weight * (towards - Z)]
        out = towards.copy()
        for r in range(Z.shape[1]) if len(self.towards) > 1 else ():
            here = self.defects[-1][:, r]
            apart = np.array([here - old[:, r] for old in self.defects[:-1]]).view(float)
            size = np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-300)
            apart /= size
            share = np.linalg.lstsq(apart @ apart.T, apart @ np.ascontiguousarray(here).view(float), rcond=1e-12)[0]
            share /= size[:, 0]
            out[:, r] -= sum(s * (towards[:, r] - old[:, r]) for s, old in zip(share, self.towards, strict=False))
        return out


def sampled(fine: Array, samples: int) -> Array:
    """One period at ``samples`` points, everything above half their rate cut off."""
    spectrum = np.fft.rfft(fine, axis=0)[: (samples + 1) // 2]
    return np.asarray(np.fft.irfft(spectrum, samples, axis=0) * (samples / len(fine)))
