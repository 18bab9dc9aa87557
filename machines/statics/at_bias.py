"""A law as small vibrations about a static displacement see it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.harmonic import FirstHarmonic
from jointlib.law import JointLaw, Motion

from .mean_force import SLOW


@dataclass(frozen=True)
class AtBias(JointLaw):
    """A law seen from a static displacement ``bias`` (m), less the force it carries there.

    Several of one law side by side have an array of them, as have the parameters of laws that allow it.
    """

    law: JointLaw
    bias: float | Array

    kind: ClassVar[str] = "at-bias"

    def __post_init__(self) -> None:
        for key in ("kind", "in_time", "passive", "linear", "states"):
            object.__setattr__(self, key, getattr(self.law, key))

    @cached_property
    def _loaded(self) -> tuple[Array, Array]:
        """Force and state after slow loading from rest."""
        bias = np.asarray(self.bias)
        return self.law.step(Motion(bias, np.zeros_like(bias), SLOW), self.law.initial_state(np.zeros_like(bias)))

    def initial_state(self, displacement: Array) -> Array:
        z = np.asarray(displacement, dtype=float)
        if not self.states:
            return self.law.initial_state(z)
        return np.broadcast_to(self._loaded[1], (*z.shape, len(self.states))).copy()

    def step(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        force, after = self.law.step(replace(motion, displacement=motion.displacement + self.bias), state)
        return force - self._loaded[0], after

    def jacobian(self, motion: Motion, state: Array) -> tuple[Array, Array]:
        return self.law.jacobian(replace(motion, displacement=motion.displacement + self.bias), state)

    def kink_angles(self, amplitude: Array, omega: Array, bias: Array) -> Array:
        return self.law.kink_angles(amplitude, omega, bias + self.bias)

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        return self.law.first_harmonic(amplitude, omega, np.asarray(bias) + self.bias)
