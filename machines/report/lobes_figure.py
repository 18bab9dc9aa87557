"""The stability chart as a picture: depth over speed, the recommended pocket, removal rates, chatter frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array

from ..lobes import Cutting, StabilityLobes
from ..lobes.pocket import WANDER, Pocket, pocket, removal_rate
from .drawing import AFTER, FLOOR, shades, sheet
from .page import Figure

_HOPF, _FLIP = ".", "x"


def lobes_figure(charts: Sequence[tuple[float, StabilityLobes]], cutting: Cutting) -> Figure:
    """Limiting depth in mm over speed in rpm, one curve per tool-point amplitude (m), over the chatter frequency.

    Contours tell the removal rate, where feed and diameter are given; a box marks the recommended pocket with the
    speeds for which it holds.
    """
    import matplotlib.ticker

    with sheet(1, 2, width=9.5, height=5.8, sharex=True, height_ratios=[2, 1]) as paper:
        depth, chatter = paper.axes
        widths = np.linspace(4.0, 1.2, len(charts))
        for (amplitude, chart), colour, width in zip(charts, shades(len(charts) + 1)[1:], widths, strict=True):
            label = f"{amplitude * 1e6:g} µm" if amplitude else "vanishing"
            limit = np.where(np.isfinite(chart.depth), chart.depth * 1e3, np.nan)
            depth.plot(chart.speed, limit, color=colour, linewidth=width, label=label)
            for kind, marker in (("hopf", _HOPF), ("flip", _FLIP)):
                of = chart.kind == kind
                chatter.plot(chart.speed[of], chart.chatter_frequency[of], marker, color=colour, markersize=width + 1)
        top = _top([chart for _, chart in charts])
        depth.set_ylim(0, top)
        found = pocket([chart for _, chart in charts], cutting)
        if found is not None:
            _mark(depth, found, top)
        _contours(depth, charts[0][1].speed, top, cutting)
        depth.set(ylabel="limiting depth of cut [mm]", title="Stable below the curve")
        depth.legend(title="tool-point amplitude", loc="upper left")
        chatter.set(xlabel="spindle speed [rpm]", ylabel="chatter frequency [Hz]")
        chatter.xaxis.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:,.0f}"))
    said = [
        "Stability lobes: the limiting depth of cut where vibration of the stated tool-point amplitude neither grows "
        "nor dies, and the frequency it has (crosses: flip, half the tooth frequency)."
    ]
    if found is not None:
        said.append(f"Box: the recommended pocket, {found.words()}.")
    if removal_rate(cutting, 1.0, 1.0) is not None:
        said.append("Broken lines: removal rate in cm³/min.")
    return Figure(paper.svg, " ".join(said))


def _top(charts: Sequence[StabilityLobes]) -> float:
    """Upper end of the axis in mm: the highest limit, unless a few peaks would press the rest flat."""
    finite = np.concatenate([c.depth[np.isfinite(c.depth)] for c in charts]) * 1e3
    return 1.05 * min(float(finite.max()), 6 * float(np.median(finite))) if len(finite) else 1.0


def _mark(axes: Any, found: Pocket, top: float) -> None:
    speeds = found.speed * np.array([1 - WANDER, 1 + WANDER])
    axes.fill_between(speeds, 0, found.depth * 1e3, color=AFTER, alpha=0.18, linewidth=0)
    axes.plot(found.speed, found.depth * 1e3, "o", color=AFTER, markersize=5)
    left = found.speed > np.mean(axes.get_xlim())
    axes.annotate(
        found.words(),
        (found.speed, min(found.depth * 1e3, 0.96 * top)),
        xytext=(-8 if left else 8, 4),
        textcoords="offset points",
        ha="right" if left else "left",
        color=AFTER,
    )


def _contours(axes: Any, speeds: Array, top: float, cutting: Cutting) -> None:
    """Hyperbolas of constant removal rate in cm³/min, depth × speed."""
    from matplotlib.ticker import MaxNLocator

    n = np.linspace(float(np.min(speeds)), float(np.max(speeds)), 200)
    per_depth = removal_rate(cutting, 1.0, 1e-3)
    if per_depth is None or len(np.unique(n)) < 2:
        return
    rate = per_depth * 60e6 * n  # cm³/min per mm of depth
    levels = [level for level in MaxNLocator(6).tick_values(0.0, top * float(rate[-1])) if level > 0]
    surface = np.outer([0.0, top], rate)
    drawn = axes.contour(n, np.array([0.0, top]), surface, levels, colors=FLOOR, linewidths=0.8, linestyles="--")
    axes.clabel(drawn, fontsize=8, fmt="%g")
