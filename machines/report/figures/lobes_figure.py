"""The stability chart as a picture: depth over speed, what amplitude and uncertainty do to it, chatter frequency."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array

from ...cutting.amplitude.pocket import WANDER, Pocket, removal_rate
from ...cutting.amplitude.unstable_depths import UnstableDepths
from ...cutting.amplitude.zones import Zones
from ...cutting.forced.forced_field import ForcedField
from ...cutting.process.chart import StabilityLobes, draw_limit
from ...cutting.process.cutting import Cutting
from ..drawing import AFTER, BEFORE, FLOOR, shades, sheet
from ..page import Figure

_KINDS = {"hopf": (".", "Hopf"), "flip": ("x", "flip (period doubling)")}
"""How a chatter frequency is drawn by the kind of the border, and called."""
_CHATTERS, _BISTABLE, _SETTLES, _BAND, _FORCED = "#d9dde3", "#fdba74", "#93c5fd", "#7e22ce", "#0f766e"
_LEVELS, _LINES = (1, 2, 5), 4
"""Digits of the iso-lines of forced vibration, and how many are drawn."""
_OTHERS, _STYLES = ["#b91c1c", "#b45309", "#15803d", "#0e7490"], ["--", ":", "-.", (0, (6, 1, 1, 1, 1, 1))]
"""Other tools, by their colours and lines."""
_ROWS = 400
_SHOWN = 1e-3
"""Share of the axis that a zone must have somewhere to be drawn and spoken of."""


def lobes_figure(
    charts: Sequence[tuple[float, StabilityLobes]],
    cutting: Cutting,
    best: Pocket | None = None,
    zones: Zones | None = None,
    band: Array | None = None,
    unstable: Sequence[UnstableDepths] = (),
    forced: ForcedField | None = None,
    others: Sequence[tuple[str, StabilityLobes]] = (),
    preview: StabilityLobes | None = None,
) -> Figure:
    """Limiting depth in mm over speed in rpm, one curve per tool-point amplitude (m), over the chatter frequency.

    Grey: chatter, with the lenses of ``unstable`` where given, else everything above the first curve. Between the safe
    limit and the onset of ``zones`` the cut is bistable; above the onset, up to their ceiling, chatter has a finite
    size. ``band`` holds depths in m at 2.5, 50 and 97.5 %, (3, speeds), of the first chart. Contours tell the removal
    rate, where feed and diameter are given, and the ``forced`` vibration of the teeth; a box marks the ``best``
    pocket with the speeds for which it holds. A ``preview`` of all speeds stands beside a chart that was cut short.
    """
    import matplotlib.ticker

    every = [chart for _, chart in charts]
    speeds, top = every[0].speed.ravel(), axis_top([*every, *(chart for _, chart in others)])
    said = [
        "Stability lobes: the limiting depth of cut where vibration of the stated tool-point amplitude neither grows "
        "nor dies, and the frequency it has (crosses: flip, half the tooth frequency)."
    ]
    with sheet(1, 2, width=9.5, height=6.8, sharex=True, height_ratios=[2.2, 1]) as paper:
        depth, chatter = paper.axes
        depth.grid(False)
        if not every[0].left_out:  # grey would be drawn between speeds that nobody looked at
            _chattering(depth, every[0], unstable, top)
            said += ["Grey: the cut chatters."] if len(unstable) else []
        if any(one.lenses for one in unstable):
            said.append("White above a limit: a lens, above which the cut is stable again.")
        if zones is not None:
            said += _zones(depth, speeds, zones, top)
        if band is not None:
            said.append(_band(depth, speeds, band))
        widths = np.linspace(3.0, 1.2, len(charts))
        for (amplitude, chart), colour, width in zip(charts, shades(len(charts) + 1)[1:], widths, strict=True):
            name = _named(amplitude, len(charts)) + (", tool in use" if others else "")
            look = {"color": colour, "linewidth": width, "label": name + chart.short_of}
            draw_limit(depth, chart.speed, chart.depth, chart.left_out, **look)
            for kind, (marker, _) in _KINDS.items():
                of = chart.kind == kind
                chatter.plot(chart.speed[of], chart.chatter_frequency[of], marker, color=colour, markersize=width + 2)
        looks = list(zip(_STYLES, _OTHERS, strict=True)) * len(others)
        for (name, chart), (style, colour) in zip(others, looks, strict=False):
            look = {"color": colour, "linewidth": 1.2, "linestyle": style, "label": name + chart.short_of}
            draw_limit(depth, chart.speed, chart.depth, chart.left_out, **look)
        if preview is not None:
            look = {"color": _OTHERS[0], "linewidth": 1.0, "linestyle": _STYLES[0], "label": "zero-order, a preview"}
            draw_limit(depth, preview.speed, preview.depth, **look)
        depth.set_ylim(0, top)
        depth.set_xlim(float(np.min(speeds)), float(np.max(speeds)) if len(np.unique(speeds)) > 1 else None)
        if _contours(depth, speeds, top, cutting):
            said.append("Broken lines: removal rate.")
        if forced is not None and _forced(depth, forced, top):
            said.append(
                "Thin iso-lines: the vibration of the tool that the teeth force, half its peak-to-peak, chatter aside."
            )
        if others:
            names = ", ".join(name for name, _ in others)
            said.append(f"By name: the other tools, {names}; everything else is of the tool in use.")
        if best is not None:
            _mark(depth, best)
            said.append(f"Box: the recommended pocket, {best.words()}.")
        depth.set(ylabel="depth of cut [mm]")
        depth.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, columnspacing=1.5, handlelength=1.8)
        chatter.set(xlabel="spindle speed [rpm]", ylabel="chatter frequency [Hz]")
        chatter.margins(y=0.12)
        _kinds(chatter, every)
        chatter.xaxis.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:,.0f}"))
    return Figure(paper.svg, " ".join(said))


def _kinds(axes: Any, charts: Sequence[StabilityLobes]) -> None:
    """Which mark is which kind of chatter, where there are both."""
    if not all(any(np.any(chart.kind == kind) for chart in charts) for kind in _KINDS):
        return
    for marker, name in _KINDS.values():
        axes.plot([], [], marker, color="#57606a", markersize=5, label=name)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, columnspacing=1.5, handletextpad=0.3)


def tools_figure(charts: Sequence[tuple[str, StabilityLobes]]) -> Figure:
    """Limiting depth in mm over speed in rpm, a curve a tool."""
    with sheet(width=9.5) as paper:
        styles = ["-", *_STYLES] * len(charts)
        for (name, chart), style, colour in zip(charts, styles, shades(len(charts) + 1)[1:], strict=False):
            look = {"color": colour, "linestyle": style, "label": name + chart.short_of}
            draw_limit(paper.axes, chart.speed, chart.depth, chart.left_out, **look)
        paper.axes.set(xlabel="spindle speed [rpm]", ylabel="depth of cut [mm]")
        paper.axes.set_ylim(0, axis_top([chart for _, chart in charts]))
        paper.axes.legend()
    return Figure(paper.svg, f"The limiting depth of cut with each tool: {', '.join(name for name, _ in charts)}.")


def axis_top(charts: Sequence[StabilityLobes]) -> float:
    """Upper end of the depth axis in mm: the highest limit, unless a few peaks would press the rest flat."""
    finite = np.concatenate([c.depth[np.isfinite(c.depth)] for c in charts]) * 1e3
    return 1.05 * min(float(finite.max()), 6 * float(np.median(finite))) if len(finite) else 1.0


def _named(amplitude: float, count: int) -> str:
    if amplitude:
        return f"limit at {amplitude * 1e6:g} µm"
    return "onset, vanishing vibration" if count > 1 else "onset of chatter"


def _chattering(axes: Any, chart: StabilityLobes, unstable: Sequence[UnstableDepths], top: float) -> None:
    """Everything unstable in grey: the zero line of the distance to the nearest edge, speed by speed."""
    limits = zip(chart.speed.ravel().tolist(), chart.depth.ravel().tolist(), strict=True)
    name = "chatters" if len(unstable) else "above the limit"
    zones = {one.speed: [(one.low, one.high) for one in one.intervals] for one in unstable}
    zones = zones or {speed: [(depth, np.inf)] for speed, depth in limits}
    if len(zones) < 2:
        return
    w = np.linspace(0.0, top, _ROWS)
    field = np.empty((_ROWS, len(zones)))
    for column, speed in zip(field.T, sorted(zones), strict=True):
        ends = [(min(1e3 * low, top), 1e3 * high) for low, high in zones[speed]] or [(top, np.inf)]
        column[:] = np.max([np.minimum(w - low, high - w) for low, high in ends], axis=0)
    axes.contourf(sorted(zones), w, field, [0.0, 10 * top], colors=[_CHATTERS], zorder=0.5)
    axes.fill_between([], [], [], color=_CHATTERS, label=name)


def _zones(axes: Any, speeds: Array, zones: Zones, top: float) -> list[str]:
    """The bistable zone under the onset and the finite chatter above it."""
    safe, onset, ceiling = (np.minimum(part * 1e3, 2 * top) for part in (zones.safe, zones.onset, zones.ceiling))
    said = []
    for low, high, colour, hatch, name, words in (
        (safe, onset, _BISTABLE, "////", "bistable: a knock may start it", "the cut is quiet unless a knock starts it"),
        (onset, ceiling, _SETTLES, "....", "chatter of finite size", "chatter starts by itself and settles in range"),
    ):
        if np.max(np.minimum(high, top) - np.minimum(low, top)) < _SHOWN * top:
            continue
        axes.fill_between(
            speeds, low, high, where=high > low, facecolor=colour, edgecolor="#57606a", hatch=hatch, linewidth=0,
            alpha=0.85, label=name, zorder=1,
        )  # fmt: skip
        said.append(f"{name.partition(':')[0].capitalize()}: {words}, {zones.reach}.")
    if said:
        axes.plot(speeds, safe, color=BEFORE, linewidth=1.6, linestyle="-.", label="safe limit over amplitude")
    return said


def _band(axes: Any, speeds: Array, band: Array) -> str:
    from matplotlib.colors import to_rgb

    low, middle, high = np.where(np.isfinite(band), band * 1e3, np.nan)
    axes.fill_between(
        speeds, low, high, facecolor=(*to_rgb(_BAND), 0.18), edgecolor=_BAND, linewidth=0.8, linestyle=":",
        label="95 % of samples", zorder=1.5,
    )  # fmt: skip
    axes.plot(speeds, middle, color=_BAND, linewidth=1.0, linestyle="--", label="median of samples")
    return "Dotted: the band that 95 % of the samples of what is uncertain lie in."


def _mark(axes: Any, found: Pocket) -> None:
    speeds = found.speed * np.array([1 - WANDER, 1 + WANDER])
    axes.fill_between(speeds, 0, found.depth * 1e3, color=AFTER, alpha=0.3, linewidth=0)
    name = f"recommended: {found.words()}"
    axes.plot(found.speed, found.depth * 1e3, "o", color=AFTER, markersize=5, label=name, zorder=5)


def _forced(axes: Any, forced: ForcedField, top: float) -> bool:
    """Iso-lines of the vibration of the teeth, with their unit on them; false where there are none to draw."""
    inside = forced.depth * 1e3 <= 1.001 * top
    size = np.concatenate([np.zeros((len(forced.speed), 1)), forced.amplitude[:, inside] * 1e6], axis=1)
    if len(forced.speed) < 2 or not np.any(inside) or not np.any(size > 0):
        return False
    decades = np.multiply.outer(10.0 ** np.arange(-2, 4), _LEVELS).ravel()
    levels = decades[(decades > np.nanmin(size[:, -1]) / 5) & (decades < np.nanmax(size))][-_LINES:]
    if not len(levels):
        return False
    depth = np.concatenate([[0.0], forced.depth[inside] * 1e3])
    lines = axes.contour(
        forced.speed, depth, np.ma.masked_invalid(size.T), levels, colors=_FORCED, linewidths=0.8, zorder=1.9
    )
    axes.clabel(lines, fmt=lambda level: f"{level:g} µm", fontsize=7, inline=True)
    axes.plot([], [], color=_FORCED, linewidth=0.8, label="tooth-passing vibration")
    return True


def _contours(axes: Any, speeds: Array, top: float, cutting: Cutting) -> bool:
    """Hyperbolas of constant removal rate in cm³/min, depth × speed, named at the right end of the axis."""
    from matplotlib.ticker import MaxNLocator

    n = np.linspace(float(np.min(speeds)), float(np.max(speeds)), 200)
    per_depth = removal_rate(cutting, 1.0, 1e-3)
    if per_depth is None or len(np.unique(n)) < 2:
        return False
    rate = per_depth * 60e6 * n  # cm³/min per mm of depth
    for level in MaxNLocator(6).tick_values(0.0, top * float(rate[-1])):
        if 0 < level <= 0.98 * top * rate[-1]:
            axes.plot(n, level / rate, color=FLOOR, linewidth=0.9, linestyle=(0, (5, 4)), zorder=1.8)
            axes.annotate(
                f"{level:g} cm³/min", (n[-1], level / rate[-1]), xytext=(3, 0), textcoords="offset points", fontsize=8,
                va="center", color="#57606a", annotation_clip=False,
            )  # fmt: skip
    return True
