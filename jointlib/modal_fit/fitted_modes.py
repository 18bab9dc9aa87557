"""Modes that were fitted to measured frequency responses, with standard errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.modal_fit.responses import Responses
from jointlib.modal_fit.shapes import ShapeFit
from jointlib.modal_fit.stabilisation import Chart
from jointlib.shown.pictures import axes_of, literal, name_curves
from jointlib.shown.result import Columns, Shown


@dataclass(frozen=True, repr=False, eq=False)
class FittedModes(Shown):
    """Modes that explain measured frequency responses, with standard errors.

    Parameters
    ----------
    responses
        What they were fitted to.
    chart
        Poles over model order.
    frequency, damping_ratio
        Hz and –, ascending, with their errors.
    shapes
        ψ at the places in 1/√kg, one column per mode, see `jointlib.modal_fit.shapes.ShapeFit`; None where no driving
        point was measured, so that their size is not known.
    residues
        Of every response, (responses, modes): ψ_o·ψ_i, in 1/kg; complex where damping is not proportional.
    fit_error
        Root of Σ |fit − measured|²/σ² over Σ |measured|²/σ².
    scatter
        Variance seen over that stated: about 1 where the deviations are right and the structure is linear.
    """

    responses: Responses
    chart: Chart
    frequency: Array
    damping_ratio: Array
    frequency_error: Array
    damping_ratio_error: Array
    residues: ComplexArray
    fitted: ComplexArray
    fit_error: float
    scatter: float
    shape_fit: ShapeFit | None
    shapes_error: Array | None
    notes: tuple[str, ...] = ()

    @property
    def shapes(self) -> ComplexArray | None:
        return None if self.shape_fit is None else self.shape_fit.shapes

    @property
    def is_proportional(self) -> bool:
        """Whether real shapes explain the responses as well as complex ones."""
        return self.shape_fit is None or not self.shape_fit.is_complex

    def finding(self) -> str:
        """How many modes, where, and how much of the responses they explain."""
        f = self.frequency
        many = f"{len(f)} mode{'s' if len(f) != 1 else ''}"
        where = f" from {f[0]:.5g} to {f[-1]:.5g} Hz" if len(f) > 1 else f" at {f[0]:.5g} Hz" if len(f) else ""
        return f"{many}{where}, which miss {self.fit_error:.2%} of the measured responses"

    def columns(self) -> Columns:
        """A row per mode."""
        return {
            "frequency": (self.frequency, "Hz"),
            "frequency_error": (self.frequency_error, "Hz"),
            "damping_ratio": (self.damping_ratio, ""),
            "damping_ratio_error": (self.damping_ratio_error, ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """The stabilisation chart; below it, without ``ax``, the fit over the measured lines in µm/N over Hz, and what
        it misses line by line beside the deviation that the measurement states."""
        if ax is not None:
            return self._chart(axes_of(ax))
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 9.0), layout="constrained")
        upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=[1.2, 1.2, 1.0])
        self._chart(upper).set(xlabel="")
        r, f = self.responses, self.responses.frequency
        for k, (o, i) in enumerate(r.pairs):
            label = literal(f"{r.dofs[o]} from {r.dofs[i]}")
            (line,) = middle.semilogy(f, np.abs(self.fitted[k]) * 1e6, linewidth=1, label=label)
            look = {"color": line.get_color()}
            middle.semilogy(f, np.abs(r.value[k]) * 1e6, ".", markersize=2.5, alpha=0.6, **look)
            lower.semilogy(f, np.abs(r.value[k] - self.fitted[k]) * 1e6, ".", markersize=2, alpha=0.5, **look)
            lower.semilogy(f, r.deviation[k] * 1e6, linewidth=1, **look)
        middle.set(ylabel="|x/F| [µm/N]", title="measured (dots) and fitted (line)")
        lower.set(
            xlabel="frequency [Hz]",
            ylabel="|error| [µm/N]",
            title="measured less fitted (dots), and its standard deviation as measured (line)",
        )
        name_curves(middle)
        return upper

    def _chart(self, axes: Any) -> Any:
        c = self.chart
        low, high = self.responses.frequency[[0, -1]]
        for stable, look in ((False, {"marker": "x", "color": "#9ca3af"}), (True, {"marker": "o", "color": "#0b5394"})):
            at = c.stable == stable
            word = "stable in frequency and damping" if stable else "not stable"
            axes.scatter(c.frequency[at], c.order[at], s=9, linewidth=0.6, label=word, **look)
        for k, f in enumerate(self.frequency):
            axes.axvline(f, color="#c2410c", linewidth=0.8, label="taken as a mode" if k == 0 else None)
        axes.set(xlabel="frequency [Hz]", ylabel="model order", xlim=(low, high))
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=9, frameon=False)
        return axes
