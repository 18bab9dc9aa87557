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
    """f = ∫₀ᶻ k(abs(u)) du + c(abs(z))·ż over segments of abs(z), width[i] wide.

    k is stiffness[i] all through a segment, c runs straight from damping[i] at its beginning to that of the next. From
    the last segment on the last values hold. The law says how a joint goes over amplitude, and nothing of why.
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

    def _bends(self) -> list[tuple[float, Array, Array]]:
        """Per onset: itself, by how much the stiffness steps there, and by how much the slope of the damping does."""
        k, c = ([np.asarray(v, dtype=float) for v in values] for values in (self.stiffness, self.damping))
        rise = [(b - a) / w for a, b, w in zip(c, c[1:], self.width, strict=False)]
        steps = [k[0], *(b - a for a, b in pairwise(k))]
        zero = 0.0 * c[0]
        bends = [b - a for a, b in pairwise([zero, *rise, zero])]
        return list(zip(self.onset, steps, bends, strict=True))

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        spring, damping = 0.0 * z, self.damping[0] + 0.0 * v
        for onset, k, bend in self._bends():
            spring = spring + k * (z - np.clip(z, -onset, onset))
            damping = damping + bend * np.maximum(np.abs(z) - onset, 0.0)
        return np.asarray(spring + damping * v)

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        stiffness, damping = 0.0 * z, self.damping[0] + 0.0 * v
        for onset, k, bend in self._bends():
            beyond = np.abs(z) >= onset
            stiffness = stiffness + np.where(beyond, k + bend * np.sign(z) * v, 0.0)
            damping = damping + bend * np.maximum(np.abs(z) - onset, 0.0)
        return np.asarray(stiffness), np.asarray(damping)

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (*(side * onset for onset in self.onset[1:] for side in (-1.0, 1.0)), 0.0), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Zero mean: Σ Δk·(1 − N) + jω (c₀ + Σ Δc'·[4 A cos³θ/(3π) − onset·(1 − N)]), sin θ = onset/A.

        N = (2/π)(θ + sin θ cos θ) is the saturation gain; Δk and Δc' are the steps of the stiffness and of the slope of
        the damping at each onset below A. With a mean by quadrature.
        """
        A, w, z0 = broadcast(amplitude, omega, bias)
        if np.any(z0):
            return super().first_harmonic(amplitude, omega, bias)
        stiffness, by_amplitude = np.zeros(A.shape), np.zeros(A.shape)
        damping, damping_by = self.damping[0] + np.zeros(A.shape), np.zeros(A.shape)
        safe = np.where(A > 0, A, 1.0)
        for i, (onset, k, bend) in enumerate(self._bends()):
            x = np.where(onset >= A, 1.0, onset / safe) if i else 0.0 * A
            root = np.sqrt(1 - x**2)
            share = 1 - 2 / np.pi * (np.arcsin(x) + x * root)
            cube = 4 / (3 * np.pi) * root**3
            stiffness, by_amplitude = stiffness + k * share, by_amplitude + k * 4 / np.pi * root * x / safe
            damping, damping_by = damping + bend * (A * cube - onset * share), damping_by + bend * cube
        gain, slope = stiffness + 1j * w * damping, by_amplitude + 1j * w * damping_by
        return closed_form(gain, slope, 1j * damping, 0.0, A.shape)
