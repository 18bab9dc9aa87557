"""What is known of one of the things compared: its numbers, its receptances, its lobes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from jointlib.arrays import Array, ComplexArray

from .computed_peaks import Top


@dataclass(frozen=True)
class Fact:
    """A number of one side, in SI, with its standard error; 0 where it has none."""

    value: float
    unit: str = ""
    error: float = 0.0
    samples: Array | None = None
    """The same in samples of what is uncertain that both sides have in common."""
    partly: bool = False
    """Whether it was looked for as long as there was time, not to the end."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A receptance."""

    frequency: Array
    """Hz."""
    receptance: ComplexArray
    """m/N."""
    deviation: Array | None = None
    """Its standard deviation in m/N where it is known."""
    tops: tuple[Top, ...] | None = None
    """Its maxima where it was computed; those of measured lines are read from them."""


@dataclass(frozen=True, eq=False)
class Limits:
    """Stability lobes, one entry a speed."""

    speed: Array
    """rpm."""
    depth: Array
    """m; inf where the cut is stable at any depth."""
    chatter_frequency: Array
    """Hz."""
    short_of: str = ""
    """How many speeds are missing, for the name of the curve."""


@dataclass(frozen=True, eq=False)
class Side:
    """What is known of one of the things compared."""

    name: str
    kind: str
    facts: Mapping[str, Fact]
    curves: Mapping[str, Curve] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    """What could not be compared, and why."""
    limits: Limits | None = None
    depths: str = ""
    """How its lowest depth was found, in words."""

    @property
    def short(self) -> str:
        """The name without what is explained in brackets."""
        return self.name.partition(" (")[0]
