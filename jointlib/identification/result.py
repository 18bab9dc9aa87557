"""What an identification hands back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.identification.force_samples import RestoringForce
from jointlib.identification.hertz_fit import HertzFit
from jointlib.identification.surface import OrderTrial
from jointlib.joint import Joint
from jointlib.shown.pictures import AFTER, MEASURED, axes_of
from jointlib.shown.result import Columns, Shown
from jointlib.units import parameters_in_words

_SAMPLES = 3000
"""Of a record that a picture shows."""


@dataclass(frozen=True)
class Found:
    """One parameter: ``status`` is "fitted", "fixed" (by the start joint) or "assumed" (nothing measured tells it)."""

    value: float
    unit: str
    standard_error: float | None
    status: str
    doubted: bool = False
    """True where the law leaves far more than noise, so that the standard error is that of a law that does not fit."""


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
    noise: float | None = None
    """Root mean square that the scatter between steady periods explains; None where nothing tells it."""


@dataclass(frozen=True, repr=False)
class Identification(Shown):
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

    def finding(self) -> str:
        """The laws, what they leave of the last measurement, and the parameters with their standard errors."""
        last = self.errors[-1]
        laws = " + ".join(law.kind for law in self.joint.laws) or "no law"
        found = {name: (p.value, p.standard_error or 0.0, p.unit) for name, p in self.parameters.items()}
        doubt = any(p.doubted for p in self.parameters.values())
        known = f"; noise explains {last.noise:.2g} {last.unit}: it does not fit" if doubt and last.noise else ""
        return (
            f"{self.joint.name!r} is {laws}; it leaves {last.rms:.3g} {last.unit} rms of {last.measurement}, "
            f"{100 * last.relative:.2g} % of the largest{known}\n{parameters_in_words(found)}"
        )

    def columns(self) -> Columns:
        """A row per parameter, in SI."""
        found = self.parameters.values()
        return {
            "parameter": (list(self.parameters), ""),
            "value": ([p.value for p in found], ""),
            "unit": ([p.unit for p in found], ""),
            "standard_error": ([np.nan if p.standard_error is None else p.standard_error for p in found], ""),
            "status": ([p.status for p in found], ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """Force in N over displacement in µm, measured and identified; without samples of both, `Joint.plot`."""
        axes = axes_of(ax)
        if self.static is not None:
            draw_static(axes, self.joint, self.static.deflection, self.static.load)
        elif self.surfaces:
            of = self.surfaces[-1]
            model = of.filtered(self.joint.force_along(of.z, of.v, 1 / of.sample_rate))
            for force, colour, name in ((of.f, MEASURED, "measured"), (model, AFTER, "identified")):
                z, f = of.z[of.inside][:_SAMPLES], force[of.inside][:_SAMPLES]
                axes.plot(z * 1e6, f, ".", markersize=2, color=colour, label=name)
            axes.set(xlabel="displacement [µm]", ylabel="joint force [N]")
        else:
            return self.joint.plot(axes)
        axes.legend()
        return axes


def draw_static(axes: Any, joint: Joint, displacement: Array, load: Array) -> None:
    """A measured static curve (m, N) and the force of the joint along it, in N over µm."""
    z = np.linspace(displacement.min(), displacement.max(), 300)
    axes.plot(displacement * 1e6, load, ".", color=MEASURED, markersize=4, label="records")
    axes.plot(z * 1e6, joint.force_along(z, 0 * z), color=AFTER, label="fitted")
    axes.set(xlabel="deflection [µm]", ylabel="load [N]")
