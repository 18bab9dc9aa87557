"""Pictures of a trace: loops before and after, residual spectra against the floor, the candidates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.report import Candidate, Status, TraceReport

from .drawing import AFTER, BEFORE, FLOOR, MEASURED, sheet, thin
from .page import Figure, Table

_EQUATIONS = {"joint": ("Joint", "[N]"), "balance": ("Balance", "[N]"), "redundancy": ("Redundancy", "[m/s²]")}


def trace_figures(report: TraceReport) -> list[Figure]:
    """Every picture the trace has arrays for."""
    plots = report.plots
    figures = []
    if "loop_displacement" in plots:
        figures.append(_loops(plots))
    if "residual_frequency" in plots:
        figures.append(_spectra(plots))
    if "residual_before" in plots:
        figures.append(_path(plots))
    if report.candidates:
        figures.append(_candidates(report))
    return figures


def _loops(plots: Mapping[str, Array]) -> Figure:
    z, f = plots["loop_displacement"], plots["loop_measured"]
    slope = float(z @ f / (z @ z))
    with sheet(3, width=11.5, height=3.8) as paper:
        loop, before, after = paper.axes
        loop.plot(z * 1e6, f, color=MEASURED, linewidth=0.9)
        loop.set(xlabel="displacement [µm]", ylabel="force [N]", title="Measured")
        for axes, word, colour in ((before, "before", BEFORE), (after, "after", AFTER)):
            axes.plot(z * 1e6, f - slope * z, color=MEASURED, linewidth=0.9, label="from the records")
            axes.plot(z * 1e6, plots[f"loop_{word}"] - slope * z, color=colour, linewidth=0.9, label=f"model {word}")
            axes.set(xlabel="displacement [µm]", ylabel="force − straight part [N]", title=f"Model {word}")
            axes.legend(loc="upper left", fontsize=8)
        limits = [axes.get_ylim() for axes in (before, after)]
        for axes in (before, after):
            axes.set_ylim(min(low for low, _ in limits), max(high for _, high in limits) * 1.25)
    return Figure(
        paper.svg,
        "Force over displacement, one period of the record with the largest force. Left: as it is. Middle "
        f"and right: with the straight part ({slope / 1e6:.0f} N/µm) taken off, against the model before and "
        "after.",
    )


def _spectra(plots: Mapping[str, Array]) -> Figure:
    f = plots["residual_frequency"] / 1e3
    shown = [name for name in _EQUATIONS if f"{name}_before" in plots]
    with sheet(len(shown), width=11.5, height=3.4, squeeze=False) as paper:
        for axes, name in zip(paper.axes[0], shown, strict=True):
            title, unit = _EQUATIONS[name]
            axes.semilogy(f, plots[f"{name}_before"], color=BEFORE, linewidth=0.8, label="before")
            axes.semilogy(f, plots[f"{name}_after"], color=AFTER, linewidth=0.8, label="after")
            axes.semilogy(f, plots[f"{name}_floor"], color="#1b1f24", linewidth=1.2, label="noise floor")
            axes.set(xlabel="frequency [kHz]", ylabel=f"residual {unit}", title=f"{title} equation")
        paper.axes[0][0].legend(fontsize=8)
    return Figure(
        paper.svg,
        "Residual amplitude on the excitation lines, equation by equation, against the noise floor. The "
        "joint equation shows what the joint model lacks; balance and redundancy hold no joint model and "
        "show masses and sensors.",
    )


def _path(plots: Mapping[str, Array]) -> Figure:
    time, velocity = plots["time"], plots.get("velocity")
    with sheet(2, width=10.5, height=3.6, sharey=True) as paper:
        left, right = paper.axes
        t, before, after = thin(time, plots["residual_before"], plots["residual_after"])
        left.plot(t, before, color=BEFORE, linewidth=0.8, label="before")
        left.plot(t, after, color=AFTER, linewidth=0.8, label="after")
        left.set(xlabel="time [s]", ylabel="force − model [N]", title="Residual over time")
        left.legend()
        if velocity is not None:
            v, before, after = thin(velocity, plots["residual_before"], plots["residual_after"])
            right.plot(v, before, ".", color=BEFORE, markersize=2)
            right.plot(v, after, ".", color=AFTER, markersize=2)
            right.set(xlabel="velocity [m/s]", title="Residual over velocity")
    return Figure(paper.svg, "What the model leaves of the measured force, before and after.")


def _candidates(report: TraceReport) -> Figure:
    rows = sorted(report.candidates, key=lambda c: c.share_of_current)[-10:]
    colours = {Status.ACCEPTED: AFTER, Status.TIED: "#6ea3d0", Status.UNPHYSICAL: FLOOR, Status.REJECTED: FLOOR}
    with sheet(width=8.0, height=0.9 + 0.32 * len(rows)) as paper:
        axes = paper.axes
        share = np.clip([100 * c.share_of_current for c in rows], -100, 100)
        axes.barh([_name(c) for c in rows], np.maximum(share, 0), color=[colours[c.status] for c in rows])
        for i, c in enumerate(rows):
            removed = f"{share[i]:.1f} %" if share[i] > 0 else "nothing"
            axes.text(max(share[i], 0) + 1, i, f"{removed}, {c.status.value}", va="center", fontsize=8)
        axes.set(xlabel="share of the held-out excess that it removes [%]", xlim=(0, 125))
        axes.grid(axis="y", visible=False)
    return Figure(paper.svg, "How the candidates fared on records they were not fitted to.")


def candidate_table(report: TraceReport) -> Table:
    """The candidates with their parameters and why they were kept or not."""
    rows = []
    for c in sorted(report.candidates, key=lambda c: c.rank):
        parameters = ", ".join(f"{name} {e.words()}" for name, e in c.parameters.items())
        rows.append((str(c.rank), _name(c), parameters, f"{c.gain_heldout:.4g}", c.status.value, c.reason))
    header = ("rank", "effect", "parameters", "held-out gain", "status", "why")
    return Table(header, rows, "Candidates")


def _name(c: Candidate) -> str:
    return c.family if c.member == c.family else f"{c.family} ({c.member})"
