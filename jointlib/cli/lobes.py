"""``jointlib lobes``: stability lobes of a machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option
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
@click.option("--witness", is_flag=True, help="Not in this version: check by time simulation.")
@click.option("-o", "output", type=Target(".npz"), help="Also write the charts to this .npz file.")
@json_option
def command(
    machine: Path,
    method: str | None,
    amplitude: tuple[float, ...],
    speed: tuple[float, ...],
    depth: tuple[float, ...],
    witness: bool,
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
    from machines import lobes_at_amplitude, read_machine
    from machines.lobes.frozen_modes import multipliers

    if witness:
        raise InputError("--witness: not in this version, expected --speed alone for the critical depth")
    if depth and not speed:
        raise InputError("--depth: needs --speed, expected the spindle speeds of these depths")
    model = read_machine(machine)
    speeds = np.array(speed) if speed else default_speeds(model)
    with working("computing lobes"):
        model, remarks = with_joints(model)
        charts = [lobes_at_amplitude(model, speeds, A, method) for A in amplitude or (0.0,)]
        growth = [multipliers(model, speeds, depth, A) for A in amplitude or (0.0,)] if depth else []
    data = chart_data(charts, speeds, amplitude)
    if depth:
        data["multiplier"] = growth if amplitude else growth[0]
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
        if depth:
            header = ("speed [rpm]", *(f"|μ| at {w * 1e3:g} mm" for w in depth))
            lines += table(
                header, [(f"{n:g}", *(f"{v:.6g}" for v in row)) for n, row in zip(speeds, growth[i], strict=True)]
            )
        lines += chart.warnings
    if output is not None:
        write_lobes(output, charts, speeds, amplitude or (0.0,))
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


def write_lobes(path: Path, charts: Sequence[Any], speeds: Any, amplitude: Sequence[float]) -> None:
    """``speed`` (rpm), ``amplitude`` (m), and depth (m), chatter_frequency (Hz), lobe as [amplitude, speed]."""
    from jointlib.io.atomic import write_npz

    fields = ("depth", "chatter_frequency", "lobe", "kind", "minimum_depth")
    arrays = {name: np.array([getattr(c, name) for c in charts]) for name in fields}
    write_npz(path, {"speed": speeds, "amplitude": np.array(amplitude), **arrays})
