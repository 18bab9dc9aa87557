"""Pictures of a trace of a machine: responses and residual before and after, and where they point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array

from ...loop.records import LevelFRF
from ...loop.report import MachineTrace, draw_pointing
from ..drawing import AFTER, BEFORE, MEASURED, sheet
from ..page import Figure

_COLUMNS = 2
_MOST = 12
_LOUD = 100.0


def traced(report: MachineTrace) -> list[tuple[int, LevelFRF]]:
    """The records that were fitted, with their number in ``plots``."""
    training = [r for r in report.records if not r.sealed]
    return [(i, r) for i, r in enumerate(training) if f"frequency_{i}" in report.plots]


def pair_of(frf: LevelFRF) -> str:
    """Where a record was measured."""
    return f"driving point {frf.drive}" if frf.drive == frf.response else f"{frf.response} from {frf.drive}"


def response_figures(report: MachineTrace) -> list[Figure]:
    """Measured against model for each force, one picture per pair of places."""
    out = []
    for pair in dict.fromkeys(pair_of(r) for _, r in traced(report)):
        records = [(i, r) for i, r in traced(report) if pair_of(r) == pair]
        out.append(_responses(report, pair, sorted(records, key=lambda x: x[1].force)))
    return out


def _responses(report: MachineTrace, pair: str, records: Sequence[tuple[int, LevelFRF]]) -> Figure:
    shown = records[:: -(-len(records) // _MOST)]
    rows = -(-len(shown) // _COLUMNS)
    named = report.place is not None
    with sheet(_COLUMNS, rows, width=10.0, height=0.4 + 2.5 * rows, squeeze=False, sharex=True, sharey=True) as paper:
        panels = paper.axes.ravel()
        for axes, (i, frf) in zip(panels, shown, strict=False):
            f, measured, before, after, deviation = _curves(report.plots, i)
            axes.semilogy(f, 1e6 * np.abs(measured), color="#c3c8cf", linewidth=4.0, label="measured")
            axes.semilogy(f, 1e6 * np.abs(before), color=BEFORE, linewidth=1.2, label="model before")
            if named:
                axes.semilogy(f, 1e6 * np.abs(after), color=AFTER, linewidth=1.2, label="model after")
            axes.semilogy(f, 1e6 * deviation, color=MEASURED, linestyle=":", linewidth=1.4, label="noise of the record")
            axes.set_title(f"{frf.force:.4g} N", loc="left", fontsize=10)
        for axes in panels[len(shown) :]:
            axes.set_axis_off()
        for axes in panels[max(0, len(shown) - _COLUMNS) : len(shown)]:
            axes.set(xlabel="frequency [Hz]")
            axes.tick_params(labelbottom=True)
        for row in paper.axes:
            row[0].set(ylabel="|x/F| [µm/N]")
        handles, words = panels[0].get_legend_handles_labels()
        panels[0].figure.legend(handles, words, loc="outside upper center", ncols=4)
    rest = f" {len(records) - len(shown)} more are in trace.npz." if len(shown) < len(records) else ""
    return Figure(paper.svg, f"Receptance, {pair}: measured and modelled under each force, and the noise.{rest}")


def _curves(plots: Mapping[str, Any], i: int) -> list[Array]:
    return [plots[f"{name}_{i}"] for name in ("frequency", "measured", "before", "after", "deviation")]


def residual_maps(report: MachineTrace) -> list[Figure]:
    """Residual over its noise, over frequency and force, before and after."""
    out = []
    for pair in dict.fromkeys(pair_of(r) for _, r in traced(report)):
        records = [(i, r) for i, r in traced(report) if pair_of(r) == pair]
        out.append(_map(report, pair, sorted(records, key=lambda x: x[1].force)))
    return out


def _map(report: MachineTrace, pair: str, records: Sequence[tuple[int, LevelFRF]]) -> Figure:
    import matplotlib.colors

    words = ("before", "after") if report.place is not None else ("before",)
    norm = matplotlib.colors.LogNorm(1.0, _LOUD)
    height = 1.5 + 0.3 * len(records)
    with sheet(len(words), 1, width=10.0, height=height, sharey=True, squeeze=False) as paper:
        for axes, word in zip(paper.axes[0], words, strict=True):
            for row, (i, _) in enumerate(records):
                f, measured, before, after, deviation = _curves(report.plots, i)
                model = before if word == "before" else after
                loud = np.clip(np.abs(measured - model) / deviation, 1.0, _LOUD)
                edges = np.concatenate([f[:1], 0.5 * (f[1:] + f[:-1]), f[-1:]])
                band = np.array([row - 0.46, row + 0.46])
                mesh = axes.pcolormesh(edges, band, loud[None], norm=norm, cmap="magma_r", rasterized=False)
            axes.set(xlabel="frequency [Hz]", title=f"Residual {word}")
            axes.grid(visible=False)
            axes.set_yticks(range(len(records)), [f"{r.force:.4g} N" for _, r in records])
        bar = paper.axes[0][0].figure.colorbar(mesh, ax=list(paper.axes[0]), pad=0.01, aspect=12)
        bar.set_label("|measured − model| / noise")
        bar.set_ticks([1, 3, 10, 30, 100], labels=["1", "3", "10", "30", "≥ 100"])
    return Figure(
        paper.svg,
        f"Where the residual sits, {pair}: over frequency (across) and force (up), in deviations of the noise. Pale "
        "is noise.",
    )


def pointing_figure(report: MachineTrace) -> Figure:
    """Share of the excess that a change of stiffness, damping or amplitude dependence alone would remove."""
    with sheet(width=9.0, height=0.9 + 0.62 * len(report.pointing)) as paper:
        axes = paper.axes
        draw_pointing(axes, report)
        axes.figure.legend(loc="outside upper center", ncols=3, title="alone, in this joint")
    return Figure(
        paper.svg,
        "Which connection does the residual point to? What a change of the stiffness, of the damping, or of their "
        "dependence on amplitude would remove in each joint alone, fitted without being held out.",
    )
