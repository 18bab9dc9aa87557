"""What the records of cutting forces tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.cutting_force.coefficients import Coefficients
from jointlib.identification.result import FitError, Found
from jointlib.shown.pictures import AFTER, MEASURED, axes_of
from jointlib.shown.result import Columns, Shown
from jointlib.units import rounded

_READ = {"N/m^2": (1e-6, "N/mm²"), "N/m": (1e-3, "N/mm")}


@dataclass(frozen=True)
class MeanForce:
    """A mean force in N over the feed in m, measured and as the coefficients have it."""

    channel: str
    feed: float
    measured: float
    modelled: float


@dataclass(frozen=True, repr=False)
class CuttingForces(Shown):
    """Coefficients of cutting forces from dynamometer records, with everything needed to judge them."""

    coefficients: Coefficients
    parameters: Mapping[str, Found]
    """By the names of `COEFFICIENTS`, those that the channels tell."""
    method: str
    """``"instantaneous"`` (every line of the teeth) or ``"average"`` (mean forces)."""
    averages: Mapping[str, Found]
    """The same by mean forces alone."""
    misfit: float
    """χ² over degrees of freedom; the errors have been raised where it is above 1."""
    errors: tuple[FitError, ...]
    means: tuple[MeanForce, ...]
    messages: tuple[str, ...]
    run_out: tuple[Found, ...] = ()
    """m by which each flute stands out from the mean, in the order in which they cut; empty where none was heard."""

    @property
    def rms(self) -> float:
        """N, of what is left."""
        return self.errors[-1].rms

    @property
    def rms_unit(self) -> str:
        """Newton."""
        return self.errors[-1].unit

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib identify --json`` prints of cutting forces."""
        known = self.coefficients.covariance
        return {
            "parameters": self.parameters,
            "rms": self.rms,
            "rms_unit": self.rms_unit,
            "method": self.method,
            "averages": self.averages,
            "covariance": None if known is None else {"names": known.names, "matrix": known.matrix},
            "run_out": self.run_out,
            "misfit": self.misfit,
            "errors": self.errors,
            "messages": self.messages,
        }

    def rows(self) -> list[tuple[str, str, str, str, str]]:
        """Name, value, standard error, unit and what mean forces alone say, as people read them."""
        rows = []
        for name, p in self.parameters.items():
            factor, unit = _READ[p.unit]
            alone = f"{self.averages[name].value * factor:.5g}" if name in self.averages else ""
            rows.append((name, *rounded(p.value * factor, (p.standard_error or 0.0) * factor, 5), unit, alone))
        return rows

    def finding(self) -> str:
        """The coefficients with their standard errors."""
        told = ", ".join(f"{name} {value} {error} {unit}" for name, value, error, unit, _ in self.rows())
        return f"{self.coefficients.process}, {self.method}: {told}"

    def columns(self) -> Columns:
        """A row per coefficient, in SI."""
        found = self.parameters.values()
        return {
            "coefficient": (list(self.parameters), ""),
            "value": ([p.value for p in found], ""),
            "unit": ([p.unit for p in found], ""),
            "standard_error": ([np.nan if p.standard_error is None else p.standard_error for p in found], ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """Mean forces in N over the feed in mm, measured and as the coefficients have them."""
        axes = axes_of(ax)
        for k, name in enumerate(dict.fromkeys(one.channel for one in self.means)):
            rows = sorted((one for one in self.means if one.channel == name), key=lambda one: one.feed)
            feed = [1e3 * one.feed for one in rows]
            axes.plot(feed, [one.measured for one in rows], "o^sv"[k % 4], color=MEASURED, label=f"{name}, measured")
            axes.plot(feed, [one.modelled for one in rows], "-", color=AFTER)
        axes.set(xlabel="feed [mm]", ylabel="mean force [N]")
        axes.legend()
        return axes
