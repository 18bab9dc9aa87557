"""What a machine may lack that test cuts show: each a change of the drawn tool and cut, with a prior over its size."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.special import ndtr

from jointlib.arrays import Array

from .sampled_tool import Drawn


class Suspect(ABC):
    """A family of changes; ``z`` are standard normal numbers, (samples, parameters), values are in SI."""

    family: ClassVar[str]
    parameters: ClassVar[tuple[tuple[str, str], ...]]
    """Names and units."""
    by_depth: ClassVar[bool] = False
    """Whether the change goes with the depth of cut."""
    by_speed: ClassVar[bool] = False
    """Whether the change goes with the speed."""
    by_turn: ClassVar[bool] = False
    """Whether its cut repeats with the revolution and not with the tooth."""

    @property
    def member(self) -> str:
        """Which of the family, in words; empty where there is one."""
        return ""

    @property
    def highest(self) -> float:
        """Hz of a mode that it brings, for which nodes have to lie closely enough; 0 where it brings none."""
        return 0.0

    @abstractmethod
    def values(self, z: Array) -> Array:
        """The parameters, (samples, parameters)."""

    @abstractmethod
    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        """The tool and cut with the change, at a speed in rpm and a depth in m."""

    @abstractmethod
    def told(self, value: dict[str, float]) -> str:
        """The change in words."""

    def told_within(self, value: dict[str, float], inside: dict[str, tuple[float, float]]) -> str:
        """The same where the parameters lie ``inside`` their 95 % intervals."""
        return self.told(value)


@dataclass(frozen=True)
class AsItIs(Suspect):
    """Nothing beyond what the inputs leave open."""

    family: ClassVar[str] = "as-it-is"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = ()

    def values(self, z: Array) -> Array:
        return z

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        return drawn

    def told(self, value: dict[str, float]) -> str:
        return "the machine as it is"


@dataclass(frozen=True)
class ProcessDamping(Suspect):
    """Flanks that rub on the waves they cut: c grows by C·b/v (Chiou & Liang 1998)."""

    family: ClassVar[str] = "process-damping"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("process_damping", "N/m"),)

    def values(self, z: Array) -> Array:
        return np.asarray(7e4 * np.exp(1.2 * z))

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        return replace(drawn, damping=drawn.damping + values[:, 0])

    def told(self, value: dict[str, float]) -> str:
        return f"process damping of {value['process_damping']:.2g} N/m"


@dataclass(frozen=True)
class Coefficient(Suspect):
    """Cutting forces larger or smaller than the file says, in all directions alike."""

    family: ClassVar[str] = "coefficient"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("factor", "1"),)

    def values(self, z: Array) -> Array:
        return np.asarray(np.exp(0.35 * z))

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        return replace(drawn, tangential=drawn.tangential * values[:, 0], normal=drawn.normal * values[:, 0])

    def told(self, value: dict[str, float]) -> str:
        return f"cutting forces {value['factor']:.3g} times those of the file"


@dataclass(frozen=True)
class RunOut(Suspect):
    """Flutes that run out by so much more than the feed that some find nothing left to cut."""

    teeth: int

    family: ClassVar[str] = "run-out"
    parameters: ClassVar[tuple[tuple[str, str], ...]] = (("flutes", "1"),)
    by_turn: ClassVar[bool] = True

    def values(self, z: Array) -> Array:
        return np.asarray(1 + np.floor(np.minimum(ndtr(z), 1 - 1e-9) * (self.teeth - 1)))

    def changed(self, drawn: Drawn, values: Array, speed: float, depth: float) -> Drawn:
        return replace(drawn, active=values[:, 0])

    def told(self, value: dict[str, float]) -> str:
        return f"run-out by which {value['flutes']:.0f} of {self.teeth} flutes cut for all"
