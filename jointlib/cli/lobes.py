"""``jointlib lobes``: stability lobes of a machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option
from jointlib.cli.lobes_over_amplitude import bands, grown, over_amplitude, witnessed
from jointlib.cli.output import emit, table, working, wrote
from jointlib.errors import InputError


@click.command("lobes", cls=Verb)
@input_file("machine")
@click.option(
    "--method",
    help="turning; for milling multi-frequency, collocation or zero-order (a preview); default: what suits.",
)
@click.option(
    "--amplitude", type=Quantity("m", lower=0), multiple=True, help="Tool-point amplitude; default: vanishing."
)
@click.option("--speed", type=Quantity("rpm"), multiple=True, help="Spindle speed; default: 200 over the file's range.")
@click.option(
    "--depth",
    type=Quantity("m", lower=0),
    multiple=True,
    help="Depths of cut; with --speed: by what a vibration grows.",
)
@click.option("--witness", is_flag=True, help="Simulate the cut in time at --speed and --depth.")
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the depths from so many samples of what is uncertain."
)
@click.option("-o", "output", type=Target(".npz", ".csv", ".svg"), help="Also write the charts: numbers or a picture.")
@json_option
def command(
    machine: Path,
    method: str | None,
    amplitude: tuple[float, ...],
    speed: tuple[float, ...],
    depth: tuple[float, ...],
    witness: bool,
    samples: int | None,
    output: Path | None,
    as_json: bool,
) -> None:
    """Depth of cut at which MACHINE starts to chatter, over spindle speed, with chatter frequency and lobe.

    With depths too, also the largest multiplier |μ| of a vibration from one tooth to the next: below 1 it dies out.

    \b
    Example:
      jointlib lobes machines/library/two_mode_tool.toml --speed 6000 9000 12000
    """
    from jointlib.cli.joints import with_joints
    from machines import Cutting, lobes_at_amplitude, read_machine
    from machines.lobes.pocket import pocket

    if witness and not (speed and depth):
        raise InputError("--witness: simulates one point at a time, expected --speed and --depth with it")
    if depth and not speed:
        raise InputError("--depth: needs --speed, expected the spindle speeds of these depths")
    model = read_machine(machine)
    speeds = np.array(speed) if speed else default_speeds(model)
    with working("computing lobes"):
        model, remarks = with_joints(model)
        charts = [lobes_at_amplitude(model, speeds, A, method) for A in amplitude or (0.0,)]
        growth, told = grown(model, speeds, depth, amplitude, witness)
    data = chart_data(charts, speeds, amplitude)
    if growth:
        data["multiplier"] = growth if amplitude else growth[0]
    if speed and not amplitude:
        further, said = over_amplitude(model, speed, depth, method)
        data |= further
        told += said
    if samples:
        data["band"], said = bands(model, speeds, amplitude, samples)
        told += said if speed else []
    if witness:
        data["witness"], said = witnessed(model, speed, depth, amplitude)
        told += said
    data["warnings"] = [*remarks, *data["warnings"]]
    lines: list[str] = list(remarks)
    for i, (A, chart) in enumerate(zip(amplitude or (0.0,), charts, strict=True)):
        at = f" at a tool-point amplitude of {A * 1e6:g} um" if A else ""
        if np.isfinite(chart.minimum_depth):
            lines.append(
                f"stable at {reach(chart)} below {chart.minimum_depth * 1e3:.5g} mm{at} "
                f"(chatter at {chart.minimum_frequency:.5g} Hz), {chart.method}"
            )
        else:
            lines.append(f"no chatter at any depth{at} inside the file's frequency range, {chart.method}")
        if speed:
            rows = [
                (f"{n:g}", f"{b * 1e3:.6g}", f"{f:.6g}", str(kind), str(k))
                if np.isfinite(b)
                else (f"{n:g}", "unbounded", "", "", "")
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
    cutting = Cutting(**(model.cutting or {}))
    best = None if speed else pocket(charts, cutting)
    if best is not None:
        lines.append(f"recommended: {best.words()}")
        data["pocket"] = {"speed": best.speed, "depth": best.depth, "margin": best.margin}
    if output is not None:
        _write(output, charts, speeds, amplitude or (0.0,), cutting)
        lines.append(wrote(output))
    emit(as_json, data, lines)


def reach(chart: Any) -> str:
    """The speeds that the minimum depth of a chart is of."""
    return "every speed" if chart.method in ("turning", "zero-order") else "these speeds"


def default_speeds(machine: Any, count: int = 200) -> Any:
    """Evenly spaced speeds over the range of the machine file."""
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    if machine.cutting.get("speed") is None:
        raise InputError(f"{machine.where}: [cutting] has no speed, expected one or --speed")
    low, high = machine.cutting["speed"]
    return np.linspace(low, high, count)


def chart_data(charts: Sequence[Any], speeds: Any, amplitude: Sequence[float]) -> dict[str, Any]:
    """The promised keys; the axis of an option that was not given is left out."""

    def shaped(values: Sequence[Any]) -> Any:
        return list(values) if amplitude else values[0]

    kinds = [[str(k) or None for k in c.kind] for c in charts]
    lobes = [[int(k) if k >= 0 else None for k in c.lobe] for c in charts]
    return {
        "speed": speeds,
        "depth": shaped([c.depth for c in charts]),
        "chatter_frequency": shaped([c.chatter_frequency for c in charts]),
        "kind": shaped(kinds),
        "lobe": shaped(lobes),
        "minimum_depth": shaped([c.minimum_depth for c in charts]),
        "method": charts[0].method,
        "notes": list(charts[0].notes),
        "warnings": sorted({w for c in charts for w in c.warnings}),
        **({"amplitude": list(amplitude)} if amplitude else {}),
    }


def _write(path: Path, charts: Sequence[Any], speeds: Any, amplitude: Sequence[float], cutting: Any) -> None:
    """The charts by the suffix of the file."""
    if path.suffix == ".npz":
        write_lobes(path, charts, speeds, amplitude)
        return
    from jointlib.io.atomic import write_text

    if path.suffix == ".svg":
        from machines.report.lobes_figure import lobes_figure

        write_text(path, lobes_figure(list(zip(amplitude, charts, strict=True)), cutting).svg)
        return
    rows = ["amplitude,speed,depth,chatter_frequency,kind,lobe"]
    for A, c in zip(amplitude, charts, strict=True):
        columns = (speeds, c.depth, c.chatter_frequency, c.kind, c.lobe)
        rows += [f"{A:g},{n:.10g},{b:.10g},{f:.10g},{kind},{k}" for n, b, f, kind, k in zip(*columns, strict=True)]
    write_text(path, "\n".join(["# m, rpm, m, Hz; an infinite depth is stable at any depth", *rows]) + "\n")


def write_lobes(path: Path, charts: Sequence[Any], speeds: Any, amplitude: Sequence[float]) -> None:
    """``speed`` (rpm), ``amplitude`` (m), and depth (m), chatter_frequency (Hz), lobe as [amplitude, speed]."""
    from jointlib.io.atomic import write_npz

    fields = ("depth", "chatter_frequency", "lobe", "kind", "minimum_depth")
    arrays = {name: np.array([getattr(c, name) for c in charts]) for name in fields}
    write_npz(path, {"speed": speeds, "amplitude": np.array(amplitude), **arrays})
