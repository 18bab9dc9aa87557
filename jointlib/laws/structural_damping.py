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

    In time it would answer before it is moved, so there is no step; at rest it has neither spring nor damper.
    """

    loss_stiffness: float = parameter("N/m", role=Role.DAMPING, lower=0.0)

    kind: ClassVar[str] = "structural-damping"
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
        """G = j·loss_stiffness at any amplitude and any ω above 0."""
        A, w, _ = broadcast(amplitude, omega, bias)
        return closed_form(1j * np.where(w > 0, self.loss_stiffness, 0.0), 0.0, 0.0, 0.0, A.shape)
