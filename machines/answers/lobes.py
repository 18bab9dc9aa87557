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
from ..cutting.amplitude.pocket import WANDER, best_pocket
from ..cutting.amplitude.zones import safe_limit
from ..cutting.process.chart import StabilityLobes, draw_charts
from ..cutting.process.cutting import Cutting
from ..cutting.rest.beyond_record import refuse_unknown
from ..cutting.rest.chart_file import chart_data, default_speeds
from ..files.opened import machine_of, tool_names
from ..model.machine import Machine
from ..ranges import DEEPEST, LARGEST_AMPLITUDE
from ..road.cutting import BUDGET
from ..road.each_tool import ToolLobes
from ..road.knocks import knocks_in_pocket, safe_from_knocks
from ..road.open_joints import with_joints
from ..uncertainty.drawn_machines import refuse_certain, refuse_too_many
from .told.lobe_files import write_charts
from .told.lobes_between import limit_between
from .told.lobes_forced import forced
from .told.lobes_growth import grown, growth_tables
from .told.lobes_of_tools import Asked, charts_of_tools
from .told.lobes_over_amplitude import (
    bands,
    lenses,
    over_amplitude,
    witnessed,
    zones_of,
)
from .told.lobes_preview import previewed


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
    preview: StabilityLobes | None = None
    """By zero-order at every speed, where the time did not suffice for the others at all of them."""

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
        Seconds of the whole, beside what is asked for at ``speed``: charts over the range, of all tools of a file, end
        with what is known, and what comes after them is left out where it takes longer.
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
    during, tell = progress or Silent(), said or (lambda lines: None)
    model, names, begun = machine_of(machine, tool), tool_names(machine, tool), time.monotonic()
    speeds = np.array(rates) if rates else default_speeds(model)
    share = None if rates else seconds / max(1, len(names))
    with during.step("computing lobes" if share is None else f"computing lobes, in at most {share:.3g} s"):
        model, remarks = with_joints(model)
        if samples is not None:
            refuse_certain(model)
            refuse_too_many(model, samples)
        started = time.monotonic()
        charts = charts_by_amplitude(model, speeds, sizes or (0.0,), method, share)
        for chart in charts:
            refuse_unknown(chart)
        speeds = charts[-1].speed
        took = time.monotonic() - started
    lines = list(remarks)
    for A, chart in zip(sizes or (0.0,), charts, strict=True):
        lines += [_limit(model, A, chart), *(_at_speeds(speeds, chart) if rates else [])]
    with during.step("computing multipliers"):
        growth, told = grown(model, speeds, depths, sizes, witness)
    data = chart_data(charts, speeds, sizes)
    data["warnings"] = [*remarks, *data["warnings"]]
    if growth:
        data["multiplier"] = growth if sizes else growth[0]
        lines += growth_tables(growth, speeds, depths, sizes)
    lines += [*dict.fromkeys(said for chart in charts for said in chart.warnings), *told]
    tell(lines)
    each = None if isinstance(machine, Machine) else Path(machine)
    asked = Asked(model, each, names, method, speeds if rates else None, begun + seconds)
    tools = charts_of_tools(asked, list(zip(sizes or (0.0,), charts, strict=True)), during, lines, tell)
    if any(tools):
        data["tools"] = [
            one.as_json() | ({"amplitude": A} if A else {})
            for A, each in zip(sizes or (0.0,), tools, strict=True)
            for one in each
        ]
    # What is asked for at given speeds is no part of the budget, which is that of all else.
    ends = seconds + (time.monotonic() if rates else begun)
    preview, words = previewed(model, charts[0], during)
    lines += words
    found = Lobes(model, sizes or (0.0,), tuple(charts), data, lines, tools=tools[0], preview=preview)
    if preview is not None:
        data["preview"] = chart_data([preview], preview.speed, ())
    if not sizes:
        lines += _added(data, *safe_from_knocks(model, charts[0], _left(ends), during))
    if rates and not sizes:
        tell(lines)
        further, unstable, words = lenses(model, charts[0], depths, _left(ends), during)
        lines += _added(data, further, words)
        tell(lines)
        first = growth[0] if growth else None
        lines += _added(data, *over_amplitude(model, rates, depths, method, unstable, first, _left(ends), during))
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
    zones, words = zones_of(model, charts, sizes, took, _left(ends), during) if drawn or sizes else (None, [])
    lines += words
    band = np.reshape(data["band"]["depth"], (-1, 3, len(speeds))) if samples else None
    safe = safe_limit(charts, zones, None if band is None else band[0])
    between, best = limit_between(model, found.amplitude, charts[0].method, zones, samples), None
    if not rates:
        with during.step("looking for the best speed"):
            best = best_pocket(speeds, safe, Cutting(**(model.cutting or {})), between)
    if best is not None:
        lines.append(f"recommended: {best.words()}{charts[0].short_of}")
        data["pocket"] = {"speed": best.speed, "depth": best.depth, "margin": best.margin}
        if not sizes:
            lines += _added(data["pocket"], *knocks_in_pocket(model, charts[0], best, _left(ends), during))
    elif not rates and not all(np.any(chart.known_below > 0) for chart in charts):
        lines.append(
            "No speed and depth are recommended: the records end on a mode that may chatter; expected them to a higher "
            "frequency"
        )
    elif charts[0].left_out and np.any(np.isfinite(safe)):
        lines.append(
            f"No speed and depth are recommended: nowhere are three speeds known within {100 * WANDER:g} % of one"
            f"{charts[0].short_of}; expected a larger --budget, or --method zero-order for a preview"
        )
    field = None
    tell(lines)
    if not sizes:
        further, words, field = forced(model, charts[0], depths, best, (safe, between), during)
        lines += _added(data, further, words)
    if target is not None:
        lines += write_charts(target, found, tools, zones, band, field, safe, best, _left(ends), during)
        found.files.append(target)
    return found


def _left(ends: float) -> float:
    """Seconds until a time of `time.monotonic`."""
    return max(0.0, ends - time.monotonic())


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
            f"stable at {chart.reach}{chart.up_to} below {chart.minimum_depth * 1e3:.5g} mm{at} "
            f"(chatter at {chart.minimum_frequency:.5g} Hz), {chart.method}"
        )
    known = "" if chart.known_to is None else f" up to {chart.known_to:g} Hz, above which nothing is known"
    return f"no chatter at any depth{at}{known}, {chart.method}"


def _at_speeds(speeds: Array, chart: StabilityLobes) -> list[str]:
    """A table of the limits at the speeds that were asked for."""
    unbounded = "unbounded" if chart.known_to is None else f"up to {chart.known_to:g} Hz"
    columns = (speeds, chart.depth, chart.doubtful, chart.chatter_frequency, chart.kind, chart.lobe)
    rows = [
        (f"{n:g}", "not known", "", "", "")
        if chart.known_to is not None and f > chart.known_to
        else (f"{n:g}", f"{'at most ' if doubted else ''}{b * 1e3:.6g}", f"{f:.6g}", str(kind), str(k))
        if np.isfinite(b)
        else (f"{n:g}", unbounded, "", "", "")
        for n, b, doubted, f, kind, k in zip(*columns, strict=True)
    ]
    return table(("speed [rpm]", "depth [mm]", "chatter [Hz]", "kind", "lobe"), rows)
