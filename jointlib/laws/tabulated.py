"""Stiffness and damping by table over the displacement: a law for joints that no other law fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class Tabulated(MemorylessLaw):
    """f = ∫₀ᶻ k(abs(u)) du + c(abs(z))·ż, k = stiffness[i] and c = damping[i] in segments of abs(z), width[i] wide.

    Beyond the last segment its values hold. It says how stiffness and damping go over amplitude, and nothing of why.
    """

    width: tuple[float, ...] = parameter("m", above=0.0, listed=True)
    stiffness: tuple[float, ...] = parameter("N/m", role=Role.STIFFNESS, listed=True)
    damping: tuple[float, ...] = parameter("N s/m", role=Role.DAMPING, listed=True)

    kind: ClassVar[str] = "tabulated"
    passive: ClassVar[bool] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.width)
        for name in ("stiffness", "damping"):
            if len(getattr(self, name)) != count:
                raise InputError(
                    f"tabulated: {len(getattr(self, name))} entries of {name}, expected {count}, as of width"
                )

    @property
    def onset(self) -> tuple[float, ...]:
        """m; where each segment begins."""
        return tuple(accumulate(self.width[:-1], initial=0.0))

    def _steps(self, values: Sequence[float]) -> list[Array]:
        """By how much a table changes at each onset."""
        given = [np.asarray(v, dtype=float) for v in values]
        return [given[0], *(b - a for a, b in pairwise(given))]

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        spring, damping = 0.0 * z, 0.0 * v
        steps = zip(self.onset, self._steps(self.stiffness), self._steps(self.damping), strict=True)
        for onset, k, c in steps:
            spring = spring + k * (z - np.clip(z, -onset, onset))
            damping = damping + np.where(np.abs(z) >= onset, c, 0.0)
        return np.asarray(spring + damping * v)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        """Tangents within a segment of the table; at an onset the damping force of a moving joint jumps."""
        z, v = np.broadcast_arrays(displacement, velocity)
        stiffness, damping = 0.0 * z, 0.0 * v
        for onset, k, c in zip(self.onset, self._steps(self.stiffness), self._steps(self.damping), strict=True):
            beyond = np.abs(z) >= onset
            stiffness, damping = stiffness + np.where(beyond, k, 0.0), damping + np.where(beyond, c, 0.0)
        return np.asarray(stiffness), np.asarray(damping)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return tuple(side * onset for onset in self.onset[1:] for side in (-1.0, 1.0)), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Zero mean: Σ (Δk + jω Δc)·(1 − N(onset/A)), N(x) = (2/π)[asin x + x √(1−x²)] for x ≤ 1, else 1.

        N is the saturation gain; that the share of the damping is the same follows from ∫ cos²θ dθ. With a mean by
        quadrature.
        """
        A, w, z0 = broadcast(amplitude, omega, bias)
        if np.any(z0):
            return super().first_harmonic(amplitude, omega, bias)
        gain, slope, by_omega = np.zeros(A.shape, complex), np.zeros(A.shape, complex), np.zeros(A.shape, complex)
        for onset, k, c in zip(self.onset, self._steps(self.stiffness), self._steps(self.damping), strict=True):
            x = np.where(onset >= A, 1.0, onset / np.where(A > 0, A, 1.0)) if np.any(onset) else 0.0 * A
            root = np.sqrt(1 - x**2)
            share = 1 - 2 / np.pi * (np.arcsin(x) + x * root)
            rise = 4 / np.pi * root * x / np.where(A > 0, A, 1.0)
            gain = gain + (k + 1j * w * c) * share
            slope = slope + (k + 1j * w * c) * rise
            by_omega = by_omega + 1j * c * share
        return closed_form(gain, slope, by_omega, 0.0, A.shape)
