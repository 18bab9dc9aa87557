"""The pictures of the page as plotly reads them: plain dictionaries, thick lines, large type, colours for every eye."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array

from .compare import PREVIEW
from .curves import Curves
from .measured import Measured, Tried
from .scatter import Scatter
from .scene import Reading

BLUE, ORANGE, GREEN, BLACK, GREY = "#0072b2", "#d55e00", "#007a5e", "#1b1f24", "#5c6670"
"""Okabe and Ito's blue, vermilion and green (a little darker), told apart by every eye and on a pale projector."""
_SIZE = 16
_VERDICTS = {"stable": (GREEN, "circle"), "marginal": (BLACK, "triangle-up"), "chatter": (ORANGE, "x")}
_MARKS = ("circle", "square", "diamond", "triangle-up", "cross", "x")
_WIDE = 30.0
_RPM = "spindle speed [rpm]"
_LOOK: dict[str, Any] = {"displaylogo": False, "responsive": True, "showTips": False}
# Buttons are named one by one: among those that plotly would show is one that sends the chart to its makers.
_BUTTONS = ["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]
CONFIG = {**_LOOK, "modeBarButtons": [["toImage"], _BUTTONS]}
BRUSHED = {**_LOOK, "modeBarButtons": [["toImage"], ["select2d", "lasso2d"], _BUTTONS]}

Figure = dict[str, Any]


def response_figure(now: Curves, before: Curves | None, records: Sequence[Measured] = ()) -> Figure:
    """Receptance of the tool point in µm/N over frequency, by tool axis: at rest and vibrating; A thin; measured."""
    traces = [_record(one, i) for i, one in enumerate(records)]
    for trace, one in zip(traces, records, strict=True):
        trace["showlegend"] = one is next(first for first in records if first.axis == one.axis)
    for curves, kept in _both(now, before):
        for axis, colour in zip(curves.receptance, (BLUE, ORANGE, GREEN), strict=False):
            rest, moving = (np.abs(h[axis]) * 1e6 for h in (curves.receptance_at_rest, curves.receptance))
            lines = [_line(curves.frequency, rest, f"{axis}, at rest", colour, kept)]
            if not np.array_equal(rest, moving):
                lines[0]["line"]["dash"] = "dot"
                lines.append(_line(curves.frequency, moving, f"{axis}, vibrating", colour, kept))
            traces += lines
    return _figure(
        traces,
        "frf",
        xaxis=_axis("frequency [Hz]", **_spread(now.frequency)),
        yaxis=_axis("|receptance| [µm/N]", type="log", exponentformat="none", dtick=1),
    )


def _spread(frequency: Array) -> dict[str, Any]:
    """A band of several decades by its logarithm: low modes would be a stroke at the left end."""
    wide = frequency[0] > 0 and frequency[-1] > _WIDE * frequency[0]
    return {"type": "log", "exponentformat": "none", "dtick": "D2"} if wide else {}


def gain_figure(now: Curves, before: Curves | None, connection: str) -> Figure:
    """Describing function of a connection over its amplitude: Re and Im in N/µm, the present one marked."""
    traces, marks = [], []
    for curves, kept in _both(now, before):
        gains = curves.gains.get(connection)
        if gains is None:
            continue
        amplitude = curves.amplitude * 1e6
        traces.append(_line(amplitude, gains.real * 1e-6, "Re", BLUE, kept))
        traces.append(_line(amplitude, gains.imag * 1e-6, "Im", ORANGE, kept, yaxis="y2"))
        present = curves.present.get(connection)
        if present and not kept:
            marks.append(_upright(present * 1e6, "y domain"))
            for part, colour, axis in (("real", BLUE, "y"), ("imag", ORANGE, "y2")):
                level = np.interp(np.log(present), np.log(curves.amplitude), getattr(gains, part)) * 1e-6
                traces.append(_points([present * 1e6], [level], "present amplitude", colour, "circle", 12, yaxis=axis))
                traces[-1]["showlegend"] = False
            marks.append(_upright(present * 1e6, "y2 domain"))
    return _figure(
        traces,
        "gain-" + connection,
        shapes=marks,
        xaxis=_axis("joint amplitude [µm]", type="log", anchor="y2", exponentformat="none", dtick=1),
        yaxis=_axis("Re [N/µm]", domain=[0.56, 1.0]),
        yaxis2=_axis("Im [N/µm]", domain=[0.0, 0.44]),
    )


def lobes_figure(
    now: Curves, before: Curves | None, speed: float | None, reading: Reading | None, tried: Sequence[Tried] = ()
) -> Figure:
    """Limiting depth in mm over speed, above the chatter frequency; A thin; where one reads is marked, and cuts are."""
    # Nothing drawn, but a click finds a speed on it where the depth has no bound.
    floor = {"x": _packed(now.speed), "y": _packed(0 * now.speed), "mode": "lines", "line": {"width": 0}}
    traces: list[Any] = [{**floor, "hoverinfo": "none", "showlegend": False}]
    for curves, kept in _both(now, before):
        depth = np.where(np.isfinite(curves.depth), curves.depth * 1e3, np.nan)
        name = "limiting depth, preview" if curves.method == PREVIEW else "limiting depth"
        traces.append(_line(curves.speed, depth, name, BLUE, kept))
        for kind, colour, dash in (("hopf", BLUE, "solid"), ("flip", ORANGE, "dot")):
            of = np.isfinite(curves.depth) & (np.asarray(curves.kind) == kind)
            if of.any():
                trace = _line(*_pieces(curves, of), f"{kind} chatter", GREY if kept else colour, kept, "y2")
                trace["line"] |= {"width": 2 if kept else 6, "dash": dash, "simplify": False}
                traces.append(trace)
    marks = []
    if speed is not None:
        marks = [_upright(speed, "y domain"), _upright(speed, "y2 domain")]
    if reading is not None and np.isfinite(reading.depth):
        traces.append(_points([reading.speed], [reading.depth * 1e3], "reading", BLACK, "circle-open", 16))
        traces.append(_points([reading.speed], [reading.chatter_frequency], "reading", BLACK, "circle-open", 16, "y2"))
        traces[-1]["showlegend"] = False
    traces += [trace for verdict, look in _VERDICTS.items() for trace in _cuts(tried, verdict, *look)]
    top = max([_top([now, *([before] if before else [])]), *(1.08e3 * one.cut.depth for one in tried)])
    return _figure(
        traces,
        "lobes",
        shapes=marks,
        hoverdistance=-1,
        xaxis=_axis(_RPM, anchor="y2", tickformat=",d"),
        yaxis=_axis("depth [mm]", domain=[0.42, 1.0], range=[0.0, top]),
        yaxis2=_axis("chatter [Hz]", domain=[0.0, 0.33]),
    )


def _cuts(tried: Sequence[Tried], verdict: str, colour: str, symbol: str) -> Iterator[dict[str, Any]]:
    """Test cuts of a verdict on the chart, those made otherwise than the file cuts pale, and what was heard of them."""
    for alike in (True, False):
        found = [one.cut for one in tried if one.alike == alike and one.cut.verdict == verdict]
        if not found:
            continue
        name = f"cut: {verdict}" if alike else f"cut: {verdict}, made otherwise"
        heard = [cut for cut in found if cut.chatter_frequency is not None]
        for cuts, values, axis in (
            (found, [1e3 * cut.depth for cut in found], "y"),
            (heard, [cut.chatter_frequency for cut in heard], "y2"),
        ):
            trace = _points([cut.speed for cut in cuts], values, name, colour, symbol, 13, axis)
            trace["text"] = [cut.name for cut in cuts]
            trace["hovertemplate"] = "%{text}: %{y:.5g}<extra>" + name + "</extra>"
            trace["marker"]["opacity"] = 1.0 if alike else 0.35
            trace["showlegend"] = axis == "y"
            if cuts:
                yield trace


def _pieces(curves: Curves, of: Any) -> tuple[Any, Any]:
    """Chatter frequency over speed, broken where another lobe begins; a speed alone becomes a short line."""
    number = np.flatnonzero(of)
    ends = np.flatnonzero((np.diff(number) > 1) | (np.diff(curves.lobe[number]) != 0)) + 1
    reach = 0.3 * np.min(np.diff(curves.speed), initial=np.inf) if len(curves.speed) > 1 else 1.0
    x, y = [], []
    for piece in np.split(number, ends):
        along = curves.speed[piece] if len(piece) > 1 else curves.speed[piece] + reach * np.array([-1.0, 1.0])
        x += [*along, along[-1]]
        y += [*np.broadcast_to(curves.chatter_frequency[piece], along.shape), np.nan]
    return x, y


def scatter_figure(study: Scatter, across: int, up: int, chosen: Sequence[int], here: int | None) -> Figure:
    """The designs of a study in two of its columns; the chosen ones stand out."""
    x, y = study.rows[:, across], study.rows[:, up]
    kinds = (
        ("misses a constraint", ~study.feasible, GREY, "x", 9),
        ("meets the constraints", study.feasible & ~study.front, BLUE, "circle", 11),
        ("beaten by none", study.front, GREEN, "diamond", 14),
    )
    traces = []
    for name, of, colour, symbol, size in kinds:
        numbers = np.flatnonzero(of)
        if not len(numbers):
            continue
        trace = _points(x[numbers], y[numbers], name, colour, symbol, size)
        words = "design %{customdata}<br>%{x:.4g}, %{y:.4g}<extra>" + name + "</extra>"
        trace |= {"customdata": numbers.tolist(), "hovertemplate": words}
        if chosen:
            trace["selectedpoints"] = np.flatnonzero(np.isin(numbers, chosen)).tolist()
            trace["unselected"] = {"marker": {"opacity": 0.3}}
            trace["selected"] = {"marker": {"opacity": 1.0, "color": ORANGE, "size": size + 3}}
        traces.append(trace)
    if here is not None:
        traces.append(_points(x[[here]], y[[here]], "on the sliders", BLACK, "circle-open", 22))
        traces[-1]["hoverinfo"] = "skip"
    labels = [labelled(study.names[i], study.units[i]) for i in (across, up)]
    axes = {"xaxis": _axis(labels[0]), "yaxis": _axis(labels[1])}
    return _figure(traces, "|".join(labels), dragmode="select", hovermode="closest", **axes)


def labelled(name: str, unit: str) -> str:
    """A quantity with its unit."""
    return f"{name} [{unit}]" if unit else name


def _top(charts: Sequence[Curves]) -> float:
    """Upper end of the depth axis in mm: the highest limit, unless a few peaks would press the rest flat."""
    finite = np.concatenate([c.depth[np.isfinite(c.depth)] for c in charts]) * 1e3
    return 1.08 * min(float(finite.max()), 6 * float(np.median(finite))) if len(finite) else 1.0


def _both(now: Curves, before: Curves | None) -> list[tuple[Curves, bool]]:
    """A first, so that the present curves lie over it."""
    return [*([(before, True)] if before is not None else []), (now, False)]


def _line(x: Any, y: Any, name: str, colour: str, kept: bool, yaxis: str = "y") -> dict[str, Any]:
    style = {"color": colour, "width": 1.5 if kept else 3.5, "dash": "dash" if kept else "solid"}
    title = f"A: {name}" if kept else name
    trace = {"x": _packed(x), "y": _packed(y), "mode": "lines", "name": title, "line": style, "yaxis": yaxis}
    return {**trace, "showlegend": not kept, "hovertemplate": "%{y:.4g}<extra>" + title + "</extra>"}


def _record(one: Measured, number: int) -> dict[str, Any]:
    """A measured record as small marks; the curves lie over them."""
    symbol, shade = _MARKS[number % len(_MARKS)], (GREY, BLACK)[number // len(_MARKS) % 2]
    size = np.abs(one.record.receptance) * 1e6
    trace = _points(one.record.frequency, size, f"{one.axis}, measured", shade, symbol, 4)
    words = f"{one.record.name}, {one.record.force:g} N"
    return {**trace, "hovertemplate": "%{y:.4g}<extra>" + words + "</extra>", "legendgroup": one.axis}


def _points(x: Any, y: Any, name: str, colour: str, symbol: str, size: float, yaxis: str = "y") -> dict[str, Any]:
    marker: dict[str, Any] = {"color": colour, "symbol": symbol, "size": size}
    if symbol.endswith("-open"):
        marker["line"] = {"width": 3}
    trace = {"x": _packed(x), "y": _packed(y), "mode": "markers", "name": name, "marker": marker, "yaxis": yaxis}
    return {**trace, "hovertemplate": "%{y:.5g}<extra>" + name + "</extra>"}


def _packed(values: Any) -> dict[str, str]:
    """Numbers as plotly unpacks them, to the last bit and without a decimal in between."""
    raw = np.ascontiguousarray(values, dtype="<f8").tobytes()
    return {"dtype": "f8", "bdata": base64.b64encode(raw).decode()}


def _axis(title: str, **more: Any) -> dict[str, Any]:
    # Labels lie flat and none is hidden, so that plotly need not measure each of them at every redraw.
    return {
        "tickangle": 0,
        "ticklabeloverflow": "allow",
        "title": {"text": title, "standoff": 6},
        "ticks": "outside",
        "showline": True,
        "linecolor": BLACK,
        "linewidth": 1.5,
        "gridcolor": "#d5dae0",
        "zeroline": False,
        "automargin": True,
        **more,
    }


def _upright(x: float, yref: str) -> dict[str, Any]:
    line = {"color": BLACK, "width": 2, "dash": "dash"}
    return {"type": "line", "x0": x, "x1": x, "y0": 0, "y1": 1, "yref": yref, "line": line}


def _figure(traces: list[Any], keeps: str, **layout: Any) -> Figure:
    """One look for all; ``uirevision`` leaves a zoom as it is while the sliders move. One thin line stands for A."""
    thin = next((trace for trace in traces if str(trace.get("name", "")).startswith("A: ")), None)
    if thin is not None:
        thin |= {"showlegend": True, "name": "A"}
    return {
        "data": traces,
        "layout": {
            "font": {"size": _SIZE, "color": BLACK, "family": "system-ui, 'DejaVu Sans', Arial, sans-serif"},
            "margin": {"l": 70, "r": 44, "t": 30, "b": 52},
            "modebar": {"orientation": "v"},
            "legend": {"orientation": "h", "yref": "container", "y": 1, "yanchor": "top", "x": 0},
            "paper_bgcolor": "#ffffff",
            "plot_bgcolor": "#ffffff",
            "hoverlabel": {"font": {"size": _SIZE}, "namelength": -1},
            "uirevision": keeps,
            "hovermode": "x unified",
            **layout,
        },
    }
