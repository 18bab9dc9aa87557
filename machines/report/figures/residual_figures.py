"""Pictures of a residual, before and after: in which equation, on which lines, when, and at which motion it sits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.answer.report import TraceReport

from ..drawing import AFTER, BEFORE, MEASURED, sheet, thin
from ..page import Figure

EQUATIONS = {
    "joint": "Joint law [N]",
    "balance": "Force balance [N]",
    "redundancy": "a2 against a3 [m/s²]",
}
"""The equations of a rig in the order they are shown, with the unit of their residual."""
CLASSES = {
    "below_500_Hz": "below 500 Hz",
    "excited_band": "excited band",
    "above_band": "above the band",
    "between_lines": "between the lines",
}
_MOTION = {
    "joint": (1e6, "displacement |z| [µm]"),
    "balance": (1.0, "acceleration |a1| [m/s²]"),
    "redundancy": (1.0, "acceleration |a2| [m/s²]"),
}
_INK = "#1b1f24"
_DOT = {"before": 4.0, "after": 2.0}
WORDS = (("before", BEFORE, "o"), ("after", AFTER, "s"))
_POINTS = 160
"""Of a spectrum or a course in time; more are put together."""


def place_figures(report: TraceReport) -> list[Figure]:
    """Where the residual sits, before and after."""
    plots = report.plots
    figures = []
    if report.error_before.get("per_class"):
        figures.append(_heat(report.error_before, report.error_after))
    if "residual_class" in plots:
        figures.append(_spectra(plots))
        figures.append(_along(report))
    if "residual_before" in plots:
        figures.append(_shape(plots))
    if report.localisation.get("blocks"):
        figures.append(_blocks(report))
    return figures


def _heat(before: Mapping[str, Any], after: Mapping[str, Any]) -> Figure:
    """Size of the residual by equation and class of line, as a multiple of its noise."""
    from matplotlib.colors import LogNorm

    rows = [e for e in EQUATIONS if e in before["per_class"]]
    columns = [c for c in CLASSES if any(c in before["per_class"][e] for e in rows)]
    with sheet(2, width=9.5, height=1.5 + 0.5 * len(rows), sharey=True) as paper:
        for axes, (word, errors) in zip(paper.axes, (("Before", before), ("After", after)), strict=True):
            chi2 = [[errors["per_class"].get(e, {}).get(c, np.nan) for c in columns] for e in rows]
            times = np.sqrt(np.array(chi2, dtype=float))
            axes.imshow(np.clip(times, 1, 10), cmap="YlOrBr", norm=LogNorm(1, 12), aspect="auto")
            for (i, j), value in np.ndenumerate(times):
                text = "–" if np.isnan(value) else f"{value:.1f}" if value < 10 else f"{value:.0f}"
                colour = "white" if value > 5 else _INK
                axes.text(j, i, text, ha="center", va="center", color=colour, fontsize=11)
            axes.set_xticks(range(len(columns)), [CLASSES[c].replace(" ", "\n", 1) for c in columns], fontsize=8.5)
            axes.set_yticks(range(len(rows)), [EQUATIONS[e].split(" [")[0] for e in rows])
            axes.set_title(word)
            axes.grid(False)
            axes.tick_params(length=0)
            axes.spines[:].set_visible(False)
    return Figure(
        paper.svg,
        f"In which equation, on which lines? Residual {where_words(before)} as a multiple of its noise (rms): 1.0 is "
        "noise alone. Only the joint law holds the joint model; the force balance shows masses and sensors, a2 against "
        "a3 the two sensors of the passive side.",
    )


def where_words(error: Mapping[str, Any]) -> str:
    """On which records an error stands."""
    return {
        "sealed": "on the sealed record",
        "condition folds": "on records whose speed or level was left out of the fit",
        "block folds": "on pieces left out of the fit",
    }.get(str(error.get("where")), "on the records of the fit")


def _spectra(plots: Mapping[str, Array]) -> Figure:
    f, place = plots["residual_frequency"], plots["residual_class"]
    rows = [e for e in EQUATIONS if f"{e}_before" in plots]
    columns = [i for i in range(len(CLASSES)) if any(np.isfinite(plots[f"{e}_before"][place == i]).any() for e in rows)]
    names = list(CLASSES.values())
    layout: dict[str, Any] = {"squeeze": False, "sharey": "row", "sharex": "col"}
    with sheet(len(columns), len(rows), width=10.0, height=0.6 + 2.1 * len(rows), **layout) as paper:
        for row, equation in zip(paper.axes, rows, strict=True):
            for axes, i in zip(row, columns, strict=True):
                here = (place == i) & np.isfinite(plots[f"{equation}_before"])
                x, factor = f[here], 1.0 if i == 0 else 1e-3
                for word, colour, mark in WORDS:
                    at, size = _bins(x, plots[f"{equation}_{word}"][here])
                    axes.semilogy(at * factor, size, mark, color=colour, markersize=_DOT[word], label=word)
                at, size = _bins(x, plots[f"{equation}_floor"][here])
                axes.semilogy(at * factor, size, color=_INK, linewidth=1.3, label="noise floor")
            row[0].yaxis.set_major_formatter("{x:g}")
            row[0].yaxis.set_minor_formatter("")
            row[0].set(ylabel=EQUATIONS[equation], ylim=(0.1 * float(np.nanmin(plots[f"{equation}_floor"])), None))
        for axes, i in zip(paper.axes[0], columns, strict=True):
            axes.set_title(names[i], fontsize=10)
        for axes, i in zip(paper.axes[-1], columns, strict=True):
            axes.set(xlabel="frequency [Hz]" if i == 0 else "frequency [kHz]")
        handles, labels = paper.axes[0][-1].get_legend_handles_labels()
        paper.axes[0][0].figure.legend(
            handles, labels, ncols=3, fontsize=9, markerscale=1.6, loc="outside upper center"
        )
    return Figure(
        paper.svg,
        "At which frequencies? Amplitude of the residual on the lines of the record with the largest joint force, by "
        "equation (rows) and class of line (columns). Dots on the black line are noise; dots above it are something "
        "that the model or the measurement lacks. Where lines are dense a dot is their root mean square.",
    )


def _bins(x: Array, y: Array) -> tuple[Array, Array]:
    """At most so many points as a picture carries: root mean square over neighbouring lines."""
    if len(x) <= _POINTS:
        return x, y
    starts = np.linspace(0, len(x), _POINTS + 1).astype(int)[:-1]
    count = np.diff([*starts, len(x)])
    return np.add.reduceat(x, starts) / count, np.sqrt(np.add.reduceat(y**2, starts) / count)


def _along(report: TraceReport) -> Figure:
    """Residual over the period and over the motion, for the joint law and each equation with an excess."""
    plots, time = report.plots, report.plots["time"] * 1e3
    rows = [e for e in EQUATIONS if f"motion_{e}" in plots and (e == "joint" or _exceeds(report, e))]
    with sheet(2, len(rows), width=9.5, height=0.9 + 2.1 * len(rows), squeeze=False, sharey="row") as paper:
        for (left, right), equation in zip(paper.axes, rows, strict=True):
            factor, label = _MOTION[equation]
            x = plots[f"motion_{equation}"] * factor
            for word, colour, mark in WORDS:
                at, size = _bins(time, plots[f"time_{equation}_{word}"])
                left.semilogy(at, size, color=colour, linewidth=1.1)
                right.semilogy(
                    x, plots[f"motion_{equation}_{word}"], mark + "-", color=colour, markersize=4, label=word
                )
            left.axhline(float(plots[f"time_{equation}_floor"]), color=_INK, linewidth=1.2)
            right.semilogy(x, plots[f"motion_{equation}_floor"], color=_INK, linewidth=1.2, label="noise floor")
            top = max(left.get_ylim()[1], right.get_ylim()[1])
            left.set(ylabel=EQUATIONS[equation], ylim=(0.1 * float(plots[f"time_{equation}_floor"]), top))
            left.yaxis.set_major_formatter("{x:g}")
            left.yaxis.set_minor_formatter("")
            right.set(xlabel=label, xlim=(0, None))
        paper.axes[0][0].set_title("Along one period", fontsize=10)
        paper.axes[0][1].set_title("By size of the motion", fontsize=10)
        paper.axes[-1][0].set(xlabel="time [ms]")
        handles, labels = paper.axes[0][1].get_legend_handles_labels()
        paper.axes[0][0].figure.legend(handles, labels, ncols=3, fontsize=9, loc="outside upper center")
    return Figure(
        paper.svg,
        "When, and at which size of motion? Root mean square of the residual of the averaged period: left in short "
        "stretches of time (record with the largest joint force), right by how large the motion was at that instant "
        "(all records shown). Equations whose residual is noise are left out.",
    )


def _exceeds(report: TraceReport, equation: str) -> bool:
    return any(cell["excess"] > cell["threshold"] for cell in report.localisation.get(equation, {}).values())


def length_unit(z: Array) -> tuple[float, str]:
    """Factor and unit in which a displacement in m reads well."""
    return (1e3, "mm") if float(np.max(np.abs(z))) > 2e-4 else (1e6, "µm")


def _shape(plots: Mapping[str, Array]) -> Figure:
    factor, unit = length_unit(plots["displacement"])
    with sheet(2, width=9.5, height=3.6, sharey=True) as paper:
        v, z, before, after = thin(
            plots["velocity"], plots["displacement"], plots["residual_before"], plots["residual_after"], most=1200
        )
        for axes, x in zip(paper.axes, (v * 1e3, z * factor), strict=True):
            for (word, colour, _), residual in zip(WORDS, (before, after), strict=True):
                axes.plot(x, residual, ".", color=colour, markersize=2.5, label=word)
            axes.axhline(0, color=_INK, linewidth=0.8)
        paper.axes[0].set(xlabel="velocity [mm/s]", ylabel="measured − model [N]", title="Over velocity")
        paper.axes[1].set(xlabel=f"displacement [{unit}]", title="Over displacement")
        handles, labels = paper.axes[0].get_legend_handles_labels()
        paper.axes[0].figure.legend(handles, labels, ncols=2, fontsize=9, markerscale=4, loc="outside upper center")
    return Figure(
        paper.svg,
        "What shape has the missing force? A step at zero velocity is dry friction, a slope is damping or stiffness, "
        "two branches over displacement are a memory.",
    )


def _blocks(report: TraceReport) -> Figure:
    """Held-out error of every stroke or piece, condition by condition, beside the floor."""
    blocks = sorted(report.localisation["blocks"], key=lambda b: str(b["condition"]))
    names = [str(b["condition"]) for b in blocks]
    at, firsts = np.arange(len(blocks)), [names.index(n) for n in dict.fromkeys(names)]
    with sheet(width=9.5, height=3.4) as paper:
        axes = paper.axes
        for word, colour, mark in WORDS:
            axes.semilogy(at, [100 * b[f"error_{word}"] for b in blocks], mark, color=colour, markersize=5, label=word)
        if all(b["floor"] for b in blocks):
            axes.semilogy(at, [100 * b["floor"] for b in blocks], "_", color=_INK, markersize=9, label="noise floor")
        for first in firsts[1:]:
            axes.axvline(first - 0.5, color=MEASURED, linewidth=0.8)
        middle = [(a + b - 1) / 2 for a, b in zip(firsts, [*firsts[1:], len(blocks)], strict=True)]
        turned = {"rotation": 20, "ha": "right"} if len(firsts) > 5 else {}
        axes.set_xticks(middle, [names[i] for i in firsts], fontsize=9, **turned)
        axes.set(ylabel="error left out [% of force]")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(axis="x", visible=False)
        axes.figure.legend(*axes.get_legend_handles_labels(), ncols=3, fontsize=9, loc="outside upper center")
    kind = {"strokes": "stroke", "records": "record"}.get(str(report.data.get("block_kind")), "piece")
    return Figure(
        paper.svg,
        f"At which speed or level? One mark for every {kind}, grouped by condition, as predicted by a model that was "
        f"fitted without {'it' if report.error_before.get('heldout_condition') is None else 'that condition'}.",
    )
