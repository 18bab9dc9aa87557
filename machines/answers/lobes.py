"""Stability lobes of a machine, with what bounds them over amplitude, and the forced vibration beside them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.answers.given import File, Quantities, Quantity, one, several
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.atomic import given_target
from jointlib.shown.progress import Progress, Silent
from jointlib.shown.result import Columns, Shown
from jointlib.shown.text import table

from ..cutting.amplitude.amplitude_limits import depends_on_amplitude
from ..cutting.amplitude.best_pitch import best_pitch
from ..cutting.amplitude.charts_by_amplitude import charts_by_amplitude
from ..cutting.amplitude.pocket import best_pocket
from ..cutting.amplitude.zones import safe_limit
from ..cutting.process.chart import StabilityLobes, draw_charts
from ..cutting.process.cutting import Cutting
from ..cutting.rest.chart_file import chart_data, default_speeds
from ..files.opened import machine_of, tool_names
from ..model.machine import Machine
from ..ranges import DEEPEST, LARGEST_AMPLITUDE
from ..road.cutting import BUDGET
from ..road.each_tool import ToolLobes, each_tool, words_of
from ..road.open_joints import with_joints
from ..uncertainty.drawn_machines import refuse_certain
from .told.lobe_files import write_charts
from .told.lobes_forced import forced
from .told.lobes_over_amplitude import (
    bands,
    grown,
    lenses,
    over_amplitude,
    safe_from_knocks,
    witnessed,
    zones_of,
)


@dataclass(frozen=True, eq=False, repr=False)
class Lobes(Shown):
    """What ``jointlib lobes`` finds."""

    machine: Machine
    """With its joints as they are used."""
    amplitude: tuple[float, ...]
    """Of the tool point in m, 0 for the onset of chatter."""
    charts: tuple[StabilityLobes, ...]
    """One an amplitude."""
    data: dict[str, Any] = field(default_factory=dict)
    """What the verb prints as JSON: limits over amplitude, bands, the recommended pocket, the forced vibration …"""
    lines: list[str] = field(default_factory=list)
    """What the verb prints in words."""
    files: list[Path] = field(default_factory=list)
    tools: tuple[ToolLobes, ...] = ()
    """Every tool of a file with several, where none was asked for, at the first amplitude."""

    def finding(self) -> str:
        """Below which depth the cut is stable, and the speed and depth that are recommended."""
        pocket = self.data.get("pocket")
        best = f"; recommended {pocket['speed']:.5g} rpm, {pocket['depth'] * 1e3:.4g} mm" if pocket else ""
        return f"{self.charts[0].finding()}{best}"

    def columns(self) -> Columns:
        """A row per amplitude and speed."""
        tables = [chart.columns() for chart in self.charts]
        sizes = [np.full(np.size(chart.speed), A) for A, chart in zip(self.amplitude, self.charts, strict=True)]
        joined = {
            name: (np.concatenate([np.asarray(each[name][0]) for each in tables]), unit)
            for name, (_, unit) in tables[0].items()
        }
        return {"amplitude": (np.concatenate(sizes), "m"), **joined}

    def plot(self, ax: Any = None) -> Any:
        """Limiting depth in mm over speed in rpm, a curve an amplitude, and one for every other tool."""
        others = [(tool.name, tool.chart) for tool in self.tools if tool.name != self.machine.tool_name]
        return draw_charts(zip(self.amplitude, self.charts, strict=True), ax, others)


def lobes(
    machine: Machine | File,
    *,
    method: str | None = None,
    amplitude: Quantities = (),
    speed: Quantities = (),
    depth: Quantities = (),
    witness: bool = False,
    optimise: str | None = None,
    samples: int | None = None,
    budget: Quantity = BUDGET,
    output: File | None = None,
    tool: str | None = None,
    progress: Progress | None = None,
    said: Callable[[Sequence[str]], None] | None = None,
) -> Lobes:
    """Depth of cut at which a machine starts to chatter, over spindle speed: ``jointlib lobes``.

    Parameters
    ----------
    machine
        A machine or its file.
    method
        ``"turning"``; for milling ``"multi-frequency"``, ``"collocation"`` or ``"zero-order"``, a preview; default:
        what suits.
    amplitude
        Of the tool point, m or with units; none is vanishing vibration.
    speed
        rpm or with units; none are 200 over the range of the file.
    depth
        Of cut, m or with units; with ``speed``: by what a vibration grows from tooth to tooth.
    witness
        Simulate the cut in time at ``speed`` and ``depth``.
    optimise
        ``"pitch"``: pitches that lift the least depth most from the lowest to the highest ``speed``, or over the range
        of the file.
    samples
        Band of the depths from so many samples of what is uncertain, at least 40.
    budget
        Seconds for the chart over the range, which then ends with what is known.
    output
        The file of the charts to write: .npz, .csv or .svg.
    tool
        Which of several named tools is in the machine; none: that of the file, with a table of what each cuts.
    progress, said
        Told of every part that takes long, and of all lines that stand before it.
    """
    sizes, rates = several(amplitude, "m", "--amplitude", 0, LARGEST_AMPLITUDE), several(speed, "rpm", "--speed")
    depths, seconds = several(depth, "m", "--depth", 0, DEEPEST), one(budget, "s", "--budget", 0) or 0.0
    target = given_target(output, ".npz", ".csv", ".svg")
    if witness and not (rates and depths):
        raise InputError("--witness: simulates one point at a time, expected --speed and --depth with it")
    if depths and not rates:
        raise InputError("--depth: needs --speed, expected the spindle speeds of these depths")
    if samples is not None and samples < 40:
        raise InputError(f"--samples: {samples}, expected at least 40")
    during, tell = progress or Silent(), said or (lambda lines: None)
    model = machine_of(machine, tool)
    speeds = np.array(rates) if rates else default_speeds(model)
    with during.step("computing lobes"):
        model, remarks = with_joints(model)
        if samples:
            refuse_certain(model)
        begun = time.monotonic()
        charts = charts_by_amplitude(model, speeds, sizes or (0.0,), method, seconds if not rates else None)
        speeds = charts[-1].speed
        took = time.monotonic() - begun
        growth, told = grown(model, speeds, depths, sizes, witness)
    data = chart_data(charts, speeds, sizes)
    if growth:
        data["multiplier"] = growth if sizes else growth[0]
    data["warnings"] = [*remarks, *data["warnings"]]
    asked = speeds, method, seconds / len(charts) if not rates else None
    pairs = list(zip(sizes or (0.0,), charts, strict=True))
    tools = [_tools(machine, model, tool, chart, A, asked, during) for A, chart in pairs]
    found = Lobes(model, sizes or (0.0,), tuple(charts), data, list(remarks), tools=tools[0])
    lines = found.lines
    for (A, _), each in zip(pairs, tools, strict=True):
        if each:
            data.setdefault("tools", []).extend(one.as_json() | ({"amplitude": A} if A else {}) for one in each)
            lines += [f"at a tool-point amplitude of {A * 1e6:g} um:"] if A else []
            lines += words_of(each, model.tool_name, speeds if rates else None)
    for i, (A, chart) in enumerate(pairs):
        lines.append(_limit(model, A, chart))
        if rates:
            lines += _at_speeds(speeds, chart)
        tell(lines)
        if not A:
            lines += _added(data, *safe_from_knocks(model, chart, max(seconds - took, 0.0), during))
        if growth:
            header = ("speed [rpm]", *(f"|μ| at {w * 1e3:g} mm" for w in depths))
            rows = [(f"{n:g}", *(f"{v:.6g}" for v in row)) for n, row in zip(speeds, growth[i], strict=True)]
            lines += table(header, rows)
        lines += chart.warnings
    lines += told
    if rates and not sizes:
        tell(lines)
        further, unstable, words = lenses(model, charts[0], depths, seconds, during)
        lines += _added(data, further, words)
        tell(lines)
        first = growth[0] if growth else None
        lines += _added(data, *over_amplitude(model, rates, depths, method, unstable, first, seconds, during))
    if samples:
        tell(lines)
        data["band"], words = bands(model, charts, sizes, samples, during)
        lines += words if rates else []
    if witness:
        tell(lines)
        data["witness"], words = witnessed(model, rates, depths, sizes, during)
        lines += words
    if optimise is not None:
        tell(lines)
        lines += _added(data, *_pitches(model, optimise, speeds, during))
    drawn = target is not None and target.suffix == ".svg"
    zones, words = zones_of(model, charts, sizes, took, seconds, during) if drawn or sizes else (None, [])
    lines += words
    band = np.reshape(data["band"]["depth"], (-1, 3, len(speeds))) if samples else None
    safe = safe_limit(charts, zones, None if band is None else band[0])
    best = None if rates else best_pocket(speeds, safe, Cutting(**(model.cutting or {})))
    if best is not None:
        lines.append(f"recommended: {best.words()}")
        data["pocket"] = {"speed": best.speed, "depth": best.depth, "margin": best.margin}
    field = None
    tell(lines)
    if not sizes:
        further, words, field = forced(model, charts[0], depths, best, safe, during)
        lines += _added(data, further, words)
    if target is not None:
        write_charts(target, found, tools, zones, band, field, safe, during)
        found.files.append(target)
    return found


def _tools(
    machine: Machine | File,
    model: Machine,
    tool: str | None,
    known: StabilityLobes,
    amplitude: float,
    asked: tuple[Array, str | None, float | None],
    during: Progress,
) -> tuple[ToolLobes, ...]:
    """All tools of a file with several at an amplitude (m), over their own speeds or those asked for; in one budget."""
    names, (speeds, method, budget) = tool_names(machine, tool), asked
    if isinstance(machine, Machine) or not names:
        return ()
    share = None if budget is None else budget / (len(names) - 1)

    def chart_of(other: Machine) -> StabilityLobes:
        at = speeds if share is None else default_speeds(other)
        return charts_by_amplitude(other, at, (amplitude,), method, share)[0]

    return each_tool(model, Path(machine), names, chart_of, known, budget is not None, during)


def _pitches(model: Machine, what: str, speeds: Array, during: Progress) -> tuple[dict[str, Any], list[str]]:
    """The pitches that lift the least depth most over a range of speeds, and told."""
    if what != "pitch":
        raise InputError(f"--optimise: {what!r}, expected 'pitch'")
    with during.step("looking for pitches"):
        found = best_pitch(model, float(np.min(speeds)), float(np.max(speeds)))
    row = {"pitch": found.pitch, "speed": found.speed, "depth": found.depth, "before": found.before}
    return {"optimised": row | {"method": found.method}}, [found.words()]


def _added(data: dict[str, Any], further: Mapping[str, Any], words: Sequence[str]) -> Sequence[str]:
    """The words of a part whose data are put to the others."""
    data |= further
    return words


def _limit(model: Machine, amplitude: float, chart: StabilityLobes) -> str:
    """The depth that is stable, or that every depth is."""
    small = " for small vibrations" if depends_on_amplitude(model) else ""
    at = f" at a tool-point amplitude of {amplitude * 1e6:g} um" if amplitude else small
    if np.isfinite(chart.minimum_depth):
        return (
            f"stable at {chart.reach} below {chart.minimum_depth * 1e3:.5g} mm{at} "
            f"(chatter at {chart.minimum_frequency:.5g} Hz), {chart.method}"
        )
    known = "" if chart.known_to is None else f" up to {chart.known_to:g} Hz, above which nothing is known"
    return f"no chatter at any depth{at}{known}, {chart.method}"


def _at_speeds(speeds: Array, chart: StabilityLobes) -> list[str]:
    """A table of the limits at the speeds that were asked for."""
    unbounded = "unbounded" if chart.known_to is None else f"up to {chart.known_to:g} Hz"
    columns = (speeds, chart.depth, chart.chatter_frequency, chart.kind, chart.lobe)
    rows = [
        (f"{n:g}", f"{b * 1e3:.6g}", f"{f:.6g}", str(kind), str(k))
        if np.isfinite(b)
        else (f"{n:g}", unbounded, "", "", "")
        for n, b, f, kind, k in zip(*columns, strict=True)
    ]
    return table(("speed [rpm]", "depth [mm]", "chatter [Hz]", "kind", "lobe"), rows)
