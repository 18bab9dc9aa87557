"""Contact that is lost, or a stop that is met, on one side only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError
from jointlib.harmonic import FirstHarmonic, broadcast, closed_form
from jointlib.law import MemorylessLaw
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
        """Closed form of (a + A cos θ)₊, a = side·bias − clearance, with cos φ = −a/A where the edge is crossed:

        G = −stiffness (φ − sin φ cos φ)/π, mean −side·stiffness (a φ + A sin φ)/π.
        """
        A, _, z0 = broadcast(amplitude, omega, bias)
        a = self.side * z0 - self.clearance
        size = np.where(A > 0, A, 1.0)
        cos = np.where(A > 0, np.clip(-a / size, -1.0, 1.0), np.where(a > 0, -1.0, 1.0))
        phi, sin = np.arccos(cos), np.sqrt(1 - cos**2)
        gain = -self.stiffness * (phi - sin * cos) / np.pi
        slope = np.where(A > 0, -2 * self.stiffness * sin * cos / (np.pi * size), 0.0)
        mean = -self.side * self.stiffness * (a * phi + A * sin) / np.pi
        return closed_form(gain, slope, 0.0, mean, A.shape)
