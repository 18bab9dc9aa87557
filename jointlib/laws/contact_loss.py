"""Contact that is lost, or a stop that is met, on one side only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
from jointlib.laws.ramp import Ramp
from jointlib.parameter import Role, parameter


@dataclass(frozen=True)
class ContactLoss(MemorylessLaw):
    """f = −side·stiffness·max(side·z − clearance, 0), side = 1 or −1; a negative stiffness is a stop."""

    stiffness: float = parameter("N/m", role=Role.STIFFNESS)
    clearance: float = parameter("m", role=Role.CLEARANCE)
    side: float = parameter("1", default=1.0)

    kind: ClassVar[str] = "contact-loss"

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(np.abs(np.asarray(self.side)) != 1):
            raise InputError(f"contact-loss: side is {self.side!r}, expected 1 or -1")

    def force(self, displacement: Array, velocity: Array) -> Array:
        z, v = np.broadcast_arrays(displacement, velocity)
        return -self.side * self.stiffness * np.maximum(self.side * z - self.clearance, 0.0) + 0.0 * v

    def slopes(self, displacement: Array, velocity: Array) -> tuple[Array, Array]:
        z, v = np.broadcast_arrays(displacement, velocity)
        return np.where(self.side * z > self.clearance, -self.stiffness, 0.0), 0.0 * v

    def kinks(self) -> tuple[Sequence[float], Sequence[float]]:
        return (self.side * self.clearance,), ()

    def first_harmonic(self, amplitude: ArrayLike, omega: ArrayLike = 1.0, bias: ArrayLike = 0.0) -> FirstHarmonic:
        """Closed form: −stiffness times that of a `Ramp` about a = side·bias − clearance."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        ramp = Ramp.of(A, self.side * z0 - self.clearance)
        k = self.stiffness
        return closed_form(-k * ramp.gain, -k * ramp.gain_by_amplitude, 0.0, -self.side * k * ramp.mean, A.shape)

    def by_bias(self, amplitude: Array, omega: Array, bias: Array) -> tuple[ComplexArray, Array, Array]:
        """Closed forms, see `Ramp`."""
        A, _, z0 = broadcast(amplitude, omega, bias)
        ramp, k = Ramp.of(A, self.side * z0 - self.clearance), self.stiffness
        gain = np.asarray(-self.side * k * ramp.gain_by_bias, dtype=complex)
        return gain, -self.side * k * ramp.mean_by_amplitude, -k * ramp.mean_by_bias
