"""Stability lobes of a machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit, emit_so_far, table, working, wrote
from jointlib.errors import InputError

from ..road.cutting import BUDGET
from .quantities import AMPLITUDE, DEPTH
from .told.lobes_forced import forced
from .told.lobes_over_amplitude import (
    bands,
    grown,
    lenses,
    lenses_to,
    over_amplitude,
    safe_from_knocks,
    witnessed,
    zones_of,
)


@click.command("lobes", cls=Verb)
@input_file("machine")
@click.option(
    "--method",
    help="turning; for milling multi-frequency, collocation or zero-order (a preview); default: what suits.",
)
@click.option("--amplitude", type=AMPLITUDE, multiple=True, help="Tool-point amplitude; default: vanishing.")
@click.option("--speed", type=Quantity("rpm"), multiple=True, help="Spindle speed; default: 200 over the file's range.")
@click.option(
    "--depth",
    type=DEPTH,
    multiple=True,
    help="Depths of cut; with --speed: by what a vibration grows.",
)
@click.option("--witness", is_flag=True, help="Simulate the cut in time at --speed and --depth.")
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the depths from so many samples of what is uncertain."
)
@click.option(
    "--budget",
    type=Quantity("s", lower=0),
    default=BUDGET,
    help=f"Time for the chart over the range, which then ends with what is known, and for limits over amplitude, which "
    f"are left out where they take longer; default: {BUDGET:g} s.",
)
@click.option("-o", "output", type=Target(".npz", ".csv", ".svg"), help="Also write the charts: numbers or a picture.")
@tool_option
@json_option
def command(
    machine: Path,
    method: str | None,
    amplitude: tuple[float, ...],
    speed: tuple[float, ...],
    depth: tuple[float, ...],
    witness: bool,
    samples: int | None,
    budget: float,
    output: Path | None,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """Depth of cut at which MACHINE starts to chatter, over spindle speed, with chatter frequency and lobe.

    With depths too, also the largest multiplier |μ| of a vibration from one tooth to the next: below 1 it dies out.

    \b
    Example:
      jointlib lobes machines/library/two_mode_tool.toml --speed 6000 9000 12000
    """
    from .. import Cutting, lobes_at_amplitude, lobes_over_range, read_machine
    from ..cutting.amplitude.amplitude_limits import depends_on_amplitude
    from ..cutting.amplitude.pocket import best_pocket
    from ..cutting.amplitude.zones import safe_limit
    from ..cutting.rest.chart_file import chart_data, default_speeds
    from ..road.open_joints import with_joints
    from ..uncertainty.lobe_bands import refuse_certain

    if witness and not (speed and depth):
        raise InputError("--witness: simulates one point at a time, expected --speed and --depth with it")
    if depth and not speed:
        raise InputError("--depth: needs --speed, expected the spindle speeds of these depths")
    model = read_machine(machine, changes)
    speeds = np.array(speed) if speed else default_speeds(model)
    with working("computing lobes"):
        model, remarks = with_joints(model)
        if samples:
            refuse_certain(model)
        charts = []
        for A in amplitude or (0.0,):
            # At rest over a range what dips between the speeds is looked for; other amplitudes take the same speeds.
            rest = not speed and not A
            charts.append(
                lobes_over_range(model, speeds, A, method, budget)
                if rest
                else lobes_at_amplitude(model, speeds, A, method)
            )
            speeds = charts[-1].speed
        growth, told = grown(model, speeds, depth, amplitude, witness)
    data = chart_data(charts, speeds, amplitude)
    if growth:
        data["multiplier"] = growth if amplitude else growth[0]
    data["warnings"] = [*remarks, *data["warnings"]]
    lines: list[str] = list(remarks)
    small = " for small vibrations" if depends_on_amplitude(model) else ""
    for i, (A, chart) in enumerate(zip(amplitude or (0.0,), charts, strict=True)):
        at = f" at a tool-point amplitude of {A * 1e6:g} um" if A else small
        if np.isfinite(chart.minimum_depth):
            lines.append(
                f"stable at {chart.reach} below {chart.minimum_depth * 1e3:.5g} mm{at} "
                f"(chatter at {chart.minimum_frequency:.5g} Hz), {chart.method}"
            )
        else:
            known = "" if chart.known_to is None else f" up to {chart.known_to:g} Hz, above which nothing is known"
            lines.append(f"no chatter at any depth{at}{known}, {chart.method}")
        emit_so_far(as_json, lines)
        if not A:
            further, said = safe_from_knocks(model, chart)
            data |= further
            lines += said
        if speed:
            rows = [
                (f"{n:g}", f"{b * 1e3:.6g}", f"{f:.6g}", str(kind), str(k))
                if np.isfinite(b)
                else (f"{n:g}", "unbounded" if chart.known_to is None else f"up to {chart.known_to:g} Hz", "", "", "")
                for n, b, f, kind, k in zip(
                    speeds, chart.depth, chart.chatter_frequency, chart.kind, chart.lobe, strict=True
                )
            ]
            lines += table(("speed [rpm]", "depth [mm]", "chatter [Hz]", "kind", "lobe"), rows)
        if growth:
            header = ("speed [rpm]", *(f"|μ| at {w * 1e3:g} mm" for w in depth))
            lines += table(
                header, [(f"{n:g}", *(f"{v:.6g}" for v in row)) for n, row in zip(speeds, growth[i], strict=True)]
            )
        lines += chart.warnings
    lines += told
    if speed and not amplitude:
        emit_so_far(as_json, lines)
        further, unstable, said = lenses(model, charts[0], depth)
        data |= further
        lines += said
        emit_so_far(as_json, lines)
        further, said = over_amplitude(model, speed, depth, method, unstable, growth[0] if growth else None, budget)
        data |= further
        lines += said
    if samples:
        emit_so_far(as_json, lines)
        data["band"], said = bands(model, charts, amplitude, samples)
        lines += said if speed else []
    if witness:
        emit_so_far(as_json, lines)
        data["witness"], said = witnessed(model, speed, depth, amplitude)
        lines += said
    cutting = Cutting(**(model.cutting or {}))
    drawn = output is not None and output.suffix == ".svg"
    zones = zones_of(model, charts, amplitude) if drawn or amplitude else None
    band = np.reshape(data["band"]["depth"], (-1, 3, len(speeds))) if samples else None
    safe = safe_limit(charts, zones, None if band is None else band[0])
    best = None if speed else best_pocket(speeds, safe, cutting)
    if best is not None:
        lines.append(f"recommended: {best.words()}")
        data["pocket"] = {"speed": best.speed, "depth": best.depth, "margin": best.margin}
    field = None
    emit_so_far(as_json, lines)
    if not amplitude:
        further, said, field = forced(model, charts[0], depth, best, safe)
        data |= further
        lines += said
    if output is not None:
        sizes = amplitude or (0.0,)
        if drawn:
            _draw(output, model, list(zip(sizes, charts, strict=True)), cutting, zones, band, field)
        else:
            if zones is None and "over_amplitude" in data:
                safe = np.fmin(safe, data["over_amplitude"]["safe_depth"])
            bounded = bool(samples) or zones is not None or "over_amplitude" in data
            _write(output, charts, speeds, sizes, safe if bounded else None, band)
        lines.append(wrote(output))
    emit(as_json, data, lines)


def _draw(
    path: Path, model: Any, charts: Sequence[tuple[float, Any]], cutting: Any, zones: Any, band: Any, field: Any
) -> None:
    """The charts as a picture, with what is unstable up to the end of its axis."""
    from jointlib.io.atomic import write_text

    from ..report.figures.lobes_figure import axis_top, lobes_figure

    amplitude, first = charts[0]
    top = 1e-3 * axis_top([chart for _, chart in charts])
    unstable = () if amplitude else lenses_to(model, first, top)
    figure = lobes_figure(charts, cutting, zones, None if band is None else band[0], unstable, field)
    write_text(path, figure.svg)


def _write(
    path: Path, charts: Sequence[Any], speeds: Any, amplitude: Sequence[float], safe: Any = None, band: Any = None
) -> None:
    """The charts as numbers, by the suffix of the file; the safe depth (m) and the band (m) where they are known."""
    if path.suffix == ".npz":
        from ..cutting.rest.chart_file import write_lobes

        more = {} if safe is None else {"safe_depth": safe}
        write_lobes(path, charts, speeds, amplitude, more | ({} if band is None else {"band": band}))
        return
    from jointlib.io.atomic import write_text

    names = ["amplitude", "speed", "depth", "chatter_frequency", "kind", "lobe"]
    names += [] if safe is None else ["safe_depth"]
    names += [] if band is None else ["low", "median", "high"]
    rows = []
    for i, (A, c) in enumerate(zip(amplitude, charts, strict=True)):
        columns: list[Any] = [speeds, c.depth, c.chatter_frequency, c.kind, c.lobe]
        columns += [] if safe is None else [safe]
        columns += [] if band is None else list(band[i])
        rows += [",".join([f"{A:g}", *map(_cell, row)]) for row in zip(*columns, strict=True)]
    told = "# m, rpm, m, Hz; an infinite depth is stable at any depth"
    write_text(path, "\n".join([told, ",".join(names), *rows]) + "\n")


def _cell(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
