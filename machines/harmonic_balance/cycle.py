"""A cycle of a motion in equal samples: to the harmonics of a force and of its tangents."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint
from jointlib.law import Motion

Harmonics = tuple[int, ...]
"""Multiples of the driving frequency, ascending from 1; 0, the mean, stands last where it is solved for."""


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

    def displacement(self, z: ComplexArray) -> Array:
        """Displacement of cases z (cases, nh), (cases, samples)."""
        return np.asarray((z @ self.basis).real)

    def project(self, force: Array) -> ComplexArray:
        """Phasors of a sampled force, (cases, nh)."""
        return np.asarray(force @ self.basis.conj().T * np.where(self.harmonics > 0, 2, 1) / len(self.angle))


def tangent(
    joint: Joint, cycle: Cycle, motion: Motion, highest: int, state: Array | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """Fourier coefficients 0 … highest of the tangent stiffness and damping along a cycle, (cases, highest + 1).

    ``state`` is that of a joint with memory, which stays as it is.
    """
    known = np.empty((*motion.displacement.shape, 0)) if state is None else state
    k, c = joint.jacobian(motion, known)
    wave = _wave(len(cycle.angle), highest)
    return k @ wave, c @ wave


@lru_cache(maxsize=16)
def _wave(samples: int, highest: int) -> ComplexArray:
    """e^(−jnθ) over equal samples of a cycle, n = 0 … highest, for the mean of a product with it."""
    angle = 2 * np.pi * np.arange(samples) / samples
    return np.asarray(np.exp(-1j * angle[:, None] * np.arange(highest + 1)) / samples)


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

    (k, c), share = slopes, shares(harmonics)[:, None]
    by_z, by_conjugate = at(k, difference) + rate * at(c, difference), at(k, total) - rate * at(c, total)
    return share * by_z, share * by_conjugate


def slope_by_frequency(
    slopes: tuple[ComplexArray, ComplexArray], harmonics: Harmonics, z: ComplexArray
) -> ComplexArray:
    """∂g_h/∂ω = Σ_m jm (γ_(h−m) Z_m − γ_(h+m) Z_m*) at the same motions, (cases, nh): what damps follows velocities."""
    damping = np.zeros_like(slopes[1]), slopes[1]
    first, second = slopes_of_harmonics(damping, harmonics, np.ones(len(z)))
    return np.asarray((first @ z[:, :, None] + second @ z.conj()[:, :, None])[:, :, 0])


def shares(harmonics: Harmonics) -> Array:
    """What of a derivative goes to Z: the mean is real, so half of its goes to Z*."""
    return np.where(np.array(harmonics) > 0, 1.0, 0.5)
