"""Contact that is lost, or a stop that is met, on one side only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
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
