"""Structural damping: a loss per cycle that depends on the amplitude and not on the frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import JointLaw, Motion
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class StructuralDamping(JointLaw):
    """f = j·loss_stiffness·z, in the frequency domain only: π·loss_stiffness·A² is lost per cycle at any frequency.

    In time it would answer before it is moved, so there is no step; at rest it has neither spring nor damper. With a
    ``reference_frequency`` above 0 it is causal: then its spring stiffens with frequency, as that of every real
    material with a constant loss does, by (2/π)·loss_stiffness·ln(f/reference_frequency) (Biot 1958; the
    Kramers-Kronig partner of a constant loss). Which frequency is the reference is a convention: a spring beside it
    takes up the difference.
    """

    loss_stiffness: float = parameter("N/m", role=Role.DAMPING, lower=0.0)
    reference_frequency: float = parameter("Hz", role=Role.SMOOTHING, lower=0.0, default=0.0)

    kind: ClassVar[str] = "structural-damping"
    linear: ClassVar[bool] = True
    in_time: ClassVar[bool] = False

    def initial_state(self, displacement: Array) -> Array:
        return np.empty((*np.shape(displacement), 0))

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        raise InputError("structural-damping: exists in the frequency domain only, expected laws that act in time here")

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        """What it adds to a static tangent: nothing."""
        shape = np.broadcast_shapes(np.shape(motion.displacement), np.shape(motion.velocity))
        return np.zeros(shape), np.zeros(shape)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """G = loss_stiffness·(j + (2/π) ln(f/reference_frequency)) at any amplitude and any ω above 0."""
        A, w, _ = broadcast(amplitude, omega, bias)
        moving = np.where(w > 0, w, 1.0)
        spring = slope = 0.0 * moving
        if self.reference_frequency > 0:
            spring = 2 / np.pi * np.log(moving / (2 * np.pi * self.reference_frequency))
            slope = 2 / np.pi / moving
        gain = self.loss_stiffness * np.where(w > 0, spring + 1j, 0.0)
        return closed_form(gain, 0.0, self.loss_stiffness * np.where(w > 0, slope, 0.0), 0.0, A.shape)
