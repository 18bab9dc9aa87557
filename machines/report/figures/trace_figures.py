"""Pictures of a trace, one question each: does the model follow the loop, how did the candidates fare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.answer.candidate_picture import draw_candidates, shown_candidates
from jointlib.loop.answer.report import TraceReport

from ..drawing import MEASURED, sheet, thin
from ..page import Figure
from .residual_figures import WORDS, length_unit

_CYCLES, _FINE = 4, 6


def loop_figures(plots: Mapping[str, Array]) -> list[Figure]:
    """Force over displacement: of a rig with its straight part taken off, of a path as it is."""
    if "loop_displacement" in plots:
        return [_rig_loops(plots)]
    if {"displacement", "force", "model_before", "model_after"} <= set(plots):
        return [_path_loops(plots)]
    return []


def _rig_loops(plots: Mapping[str, Array]) -> Figure:
    z, f = plots["loop_displacement"], plots["loop_measured"]
    slope = float(z @ f / (z @ z))
    names = ("loop_displacement", "loop_measured", "loop_before", "loop_after")
    x, measured, *models = largest_cycles(*(plots[n] for n in names))
    with sheet(3, width=10.0, height=3.4) as paper:
        loop, *rest = paper.axes
        loop.plot(x * 1e6, measured, color=MEASURED, linewidth=1.2)
        loop.set(xlabel="displacement [µm]", ylabel="joint force [N]", title="As measured")
        for axes, (word, colour, _), model in zip(rest, WORDS, models, strict=True):
            axes.plot(x * 1e6, measured - slope * x, color="#c3c8cf", linewidth=3.5, label="measured")
            axes.plot(x * 1e6, model - slope * x, color=colour, linewidth=1.2, label=f"model {word}")
            axes.set(xlabel="displacement [µm]", title=f"Model {word}")
            axes.legend(loc="upper left", fontsize=8)
        rest[0].set(ylabel="force − straight part [N]")
        _same_height(rest, 1.3)
    return Figure(
        paper.svg,
        f"Does the model follow the loop? About {_CYCLES} cycles round the largest motion of all. Left: as measured. "
        f"Middle and right: the straight part ({slope / 1e6:.4g} N/µm) taken off, so that the rest can be seen.",
    )


def largest_cycles(z: Array, *others: Array) -> list[Array]:
    """The stretch of a few cycles round the largest size of z, of z and of what goes with it, finely interpolated.

    All are one period of a periodic signal; between the samples they are taken as band-limited.
    """
    n = len(z)
    fine = [np.fft.irfft(np.fft.rfft(x), _FINE * n) * _FINE for x in (z, *others)]
    cycles = max(1.0, np.count_nonzero(np.diff(np.signbit(z))) / 2)
    length = min(_FINE * n, int(np.ceil(_FINE * n * _CYCLES / cycles)))
    start = int(np.argmax(np.abs(fine[0]))) - length // 2
    return [np.roll(x, -start)[:length] for x in fine]


def _path_loops(plots: Mapping[str, Array]) -> Figure:
    z, force, *models = thin(*(plots[n] for n in ("displacement", "force", "model_before", "model_after")), most=1200)
    factor, unit = length_unit(z)
    with sheet(2, width=9.5, height=3.6, sharey=True) as paper:
        for axes, (word, colour, _), model in zip(paper.axes, WORDS, models, strict=True):
            axes.plot(z * factor, force, ".", color="#c3c8cf", markersize=5)
            axes.plot([], [], color="#c3c8cf", linewidth=3.5, label="measured")
            axes.plot(z * factor, model, ".", color=colour, markersize=1.5)
            axes.plot([], [], color=colour, label=f"model {word}")
            axes.set(xlabel=f"displacement [{unit}]", title=f"Model {word}")
            axes.legend(loc="upper left", fontsize=8)
        paper.axes[0].set(ylabel="force [N]")
        _same_height(paper.axes, 1.25)
    return Figure(paper.svg, "Does the model follow the loop? Force over displacement of all records that were fitted.")


def _same_height(several: Sequence[Any], room: float) -> None:
    """One scale on all axes, with room above for the legend."""
    limits = [axes.get_ylim() for axes in several]
    low, high = min(a for a, _ in limits), max(b for _, b in limits)
    for axes in several:
        axes.set_ylim(low, low + room * (high - low))


def candidate_figure(report: TraceReport) -> Figure:
    """Held-out gain of the leading candidates, with its 95 % interval where the route gives one."""
    rows = shown_candidates(report.candidates)[::-1]
    with sheet(width=9.0, height=0.9 + 0.34 * len(rows)) as paper:
        intervals = draw_candidates(paper.axes, rows)
    source = "the noise" if report.route == "periodic" else "the spread over the blocks"
    bar = f"; the black line at its end is the 95 % interval from {source}" if intervals else ""
    caption = (
        f"Which effect explains it? Each bar is one effect added alone, judged on data it was not fitted to{bar}. Dark "
        "blue: chosen, or the nearest where nothing is named. Light blue: does as well; the table says whether it "
        "is a rival. Grey: refused, for the reason in the table."
    )
    if any(c.share_of_current > 1 for c in rows):
        caption += " More than 100 %: without the effect the model does worse on data left out than in its own fit."
    return Figure(paper.svg, caption)
