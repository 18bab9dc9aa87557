"""The contract of a fault in a force measured along a path, which no joint law can mend."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from jointlib.arrays import Array
from jointlib.effect import Path, Scale

Shape = Mapping[str, float]


@dataclass(frozen=True)
class PathRecord:
    """One record of a force along a path, at the full rate, arrays (samples,)."""

    path: Path
    force: Array
    """F in N."""
    time: Array
    """s on the laboratory clock where the file gives one, else since the record began."""
    position: Array
    """Feed position in m: its own channel, else the displacement."""


class PathFault(ABC):
    """Something wrong with the force along a path that is no force of the joint: F gains Σ coefficients[k]·g_k.

    Undone on reading by a ``[[correction]]`` on the force channel. Constructed without arguments.
    """

    family: ClassVar[str]
    words: ClassVar[str] = ""
    """The fault in a clause that follows "The records show"."""
    look_alikes: ClassVar[Mapping[str, str]] = {}
    declared_pairs: ClassVar[frozenset[str]] = frozenset()
    of_joint: ClassVar[str] = ""
    """A sentence on what a joint may do that looks the same where no inertia is in the balance."""
    parameters: ClassVar[Mapping[str, str]]
    """Parameters of a correction and their SI units; "channel" is the unit of the force."""
    inertia: ClassVar[bool] = False
    """True for a mass on the acceleration of the path: its column is that acceleration, it is in question where the
    measurement declares no carriage, and a correction gives the measurement that carriage and leaves the force."""
    requires: ClassVar[str] = ""
    """What the records must have for it to be decided: "clock" (one laboratory time for all of them), or nothing."""
    experiment: ClassVar[str] = ""
    """What would decide it where that is missing."""

    def shapes(self, scale: Scale, records: Sequence[PathRecord]) -> tuple[Shape, ...]:
        """Grid of shape parameters to try; nothing where not applicable."""
        return ({},)

    def likely(self, shapes: Sequence[Shape], position: Array, residual: Array) -> Sequence[Shape]:
        """Those of the shapes that a residual in N at these positions in m may hold, where a glance can tell."""
        return shapes

    @abstractmethod
    def columns(self, record: PathRecord, shape: Shape) -> Array:
        """What each coefficient being 1 adds to F, shape (coefficients, samples)."""

    @abstractmethod
    def correction(self, coefficients: Array, shape: Shape) -> Mapping[str, float] | None:
        """The physical parameters; None where the coefficients are not physical."""

    def combined(self, known: Mapping[str, float], further: Mapping[str, float]) -> Mapping[str, float]:
        """One correction that stands for ``known`` undone first and ``further`` next, of the same shape."""
        return {n: v if n in self.shape_parameters else v + further[n] for n, v in known.items()}

    shape_parameters: ClassVar[frozenset[str]] = frozenset()
    """Those of ``parameters`` that are no linear coefficients; from the grid on they are fitted along their slopes."""

    @abstractmethod
    def undo(self, force: Array, time: Array, position: Array, parameters: Mapping[str, float]) -> Array:
        """The force as it would have been without the fault."""
