"""What an identification hands back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from jointlib.identification.force_samples import RestoringForce
from jointlib.identification.hertz_fit import HertzFit
from jointlib.identification.surface import OrderTrial
from jointlib.joint import Joint


@dataclass(frozen=True)
class Found:
    """One parameter: ``status`` is "fitted", "fixed" (by the start joint) or "assumed" (nothing measured tells it)."""

    value: float
    unit: str
    standard_error: float | None
    status: str


@dataclass(frozen=True)
class FitError:
    """What the fit leaves of one measurement."""

    measurement: str
    """File name."""
    kind: str
    rms: float
    unit: str
    relative: float
    """``rms`` as a share of the largest measured force."""
    records: Mapping[str, float] = field(default_factory=dict)
    """Root mean square by record."""


@dataclass(frozen=True)
class Identification:
    """A joint identified from records, with everything needed to judge it."""

    joint: Joint
    """With covariance, validity and provenance."""
    parameters: Mapping[str, Found]
    """Of the joint, and of what was found beside it (``carriage``, ``offset`` of a path)."""
    errors: tuple[FitError, ...]
    """One per measurement, in the order given."""
    static: HertzFit | None = None
    """The static fit with its preload sweep."""
    surfaces: tuple[RestoringForce, ...] = ()
    """Samples (z, ż, f) of every rig record that was fitted."""
    orders: tuple[OrderTrial, ...] = ()
    """Orders tried for a surface."""
    messages: tuple[str, ...] = ()
    """What was assumed, dropped or could not be told."""

    @property
    def rms(self) -> float:
        """Root mean square residual of the last measurement, in ``rms_unit``."""
        return self.errors[-1].rms

    @property
    def rms_unit(self) -> str:
        """Unit of ``rms``: N, or V for a circuit."""
        return self.errors[-1].unit
