"""Stability lobes as files: numbers or a picture."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.arrays import Array
from jointlib.io.atomic import write_text
from jointlib.shown.progress import Progress

from ...cutting.rest.chart_file import on_common_speeds, write_lobes
from .lobes_over_amplitude import lenses_to

if TYPE_CHECKING:
    from ...road.each_tool import ToolLobes
    from ..lobes import Lobes


def write_charts(
    path: Path,
    found: Lobes,
    tools: Sequence[Sequence[ToolLobes]],
    zones: Any,
    band: Any,
    field: Any,
    safe: Any,
    best: Any,
    budget: float,
    progress: Progress,
) -> list[str]:
    """The charts by the suffix of the file, with the safe depth and the band (m) where they are known; what is told.

    ``tools`` are those of a machine with several, by amplitude; a picture marks the ``best`` pocket, and
    takes ``budget`` (s) to complete its charts.
    """
    if path.suffix == ".svg":
        return _draw(path, found, zones, band, field, best, budget, progress)
    over = found.data.get("over_amplitude")
    if zones is None and over is not None:
        safe = np.fmin(safe, over["safe_depth"])
    bounded = band is not None or zones is not None or over is not None
    names = [tool.name for tool in found.tools]
    others = on_common_speeds({name: [each[i].chart for each in tools] for i, name in enumerate(names)})
    _write(path, found.charts, found.charts[-1].speed, found.amplitude, others, safe if bounded else None, band)
    return []


def _draw(
    path: Path, found: Lobes, zones: Any, band: Any, field: Any, best: Any, budget: float, progress: Progress
) -> list[str]:
    """The charts as a picture, with what is unstable up to the end of its axis."""
    from ...cutting.process.cutting import Cutting
    from ...report.figures.lobes_figure import axis_top, lobes_figure

    charts = list(zip(found.amplitude, found.charts, strict=True))
    amplitude, first = charts[0]
    tools = ((tool.name, tool.chart) for tool in found.tools if tool.name != found.machine.tool_name)
    others = [(name, chart) for name, chart in tools if chart is not None]
    top = 1e-3 * axis_top([chart for _, chart in (*charts, *others)])
    unstable, said = ((), []) if amplitude or first.left_out else lenses_to(found.machine, first, top, budget, progress)
    cutting = Cutting(**(found.machine.cutting or {}))
    limits = None if band is None else band[0]
    figure = lobes_figure(charts, cutting, best, zones, limits, unstable, field, others, found.preview)
    write_text(path, figure.svg)
    return said


def _write(
    path: Path,
    charts: Sequence[Any],
    speeds: Any,
    amplitude: Sequence[float],
    tools: tuple[Array, Mapping[str, Array]],
    safe: Any = None,
    band: Any = None,
) -> None:
    """The charts as numbers, by the suffix of the file; the safe depth (m) and the band (m) where they are known."""
    if path.suffix == ".npz":
        more = {f"depth_{name}": depth for name, depth in tools[1].items()}
        more |= {"tool_speed": tools[0]} if more else {}
        more |= {} if safe is None else {"safe_depth": safe}
        write_lobes(path, charts, speeds, amplitude, more | ({} if band is None else {"band": band}))
        return
    names = ["amplitude", "speed", "depth", "chatter_frequency", "kind", "lobe"]
    names += [] if safe is None else ["safe_depth"]
    names += [] if band is None else ["low", "median", "high"]
    rows = []
    for i, (A, c) in enumerate(zip(amplitude, charts, strict=True)):
        columns: list[Any] = [speeds, c.depth, c.chatter_frequency, c.kind, c.lobe]
        columns += [] if safe is None else [safe]
        columns += [] if band is None else list(band[i])
        rows += [[f"{A:g}", *map(_cell, row)] for row in zip(*columns, strict=True)]
    names += [f"depth_{name}" for name in tools[1]]
    rows = _with_tools(rows, len(names), amplitude, speeds, tools) if tools[1] else rows
    told = "# m, rpm, m, Hz; an infinite depth is stable at any depth"
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows([names, *rows])
    write_text(path, f"{told}\n{table.getvalue()}")


def _with_tools(
    rows: Sequence[Sequence[str]],
    width: int,
    amplitude: Sequence[float],
    speeds: Array,
    tools: tuple[Array, Mapping[str, Array]],
) -> list[list[str]]:
    """The rows with the depth of every tool, and one for every speed that only other tools have.

    A cell is empty where nothing was computed.
    """
    out, each = [], len(rows) // len(amplitude)
    for i, A in enumerate(amplitude):
        at = dict(zip(speeds.tolist(), rows[i * each : (i + 1) * each], strict=True))
        for k, rpm in enumerate(tools[0].tolist()):
            depths = ["" if np.isnan(depth[i, k]) else _cell(float(depth[i, k])) for depth in tools[1].values()]
            left = [f"{A:g}", _cell(rpm)] + [""] * (width - len(depths) - 2)
            out.append([*at.get(rpm, left), *depths])
    return out


def _cell(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
