"""``jointlib run``: the whole road for a machine."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Steps, emit, wrote
from jointlib.cli.steps.piece import walk
from jointlib.cli.steps.road import Road, pieces_of
from jointlib.errors import CheckFailed, InputError

_AMPLITUDES = (0.0, 2e-6, 5e-6, 10e-6)
"""Tool-point amplitudes of the lobes, m; onset first."""


@click.command("run", cls=Verb)
@input_file("machine")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder for everything written.")
@click.option("--amplitude", type=Quantity("m", lower=0), multiple=True, help="Tool-point amplitudes of the lobes.")
@tool_option
@json_option
def command(machine: Path, output: Path, amplitude: tuple[float, ...], changes: dict[str, str], as_json: bool) -> None:
    """Identify the joints of MACHINE, doubt and mend them, couple, check, cut, export, and write one report.

    \b
    Example:
      jointlib run machines/library/guide_mill.toml -o out
    """
    from jointlib.cli.lobes import default_speeds
    from jointlib.cli.told.joints import look_ahead
    from machines import read_machine

    model = read_machine(machine, changes)
    look_ahead(model)
    if model.cutting is not None:
        default_speeds(model)
    elif amplitude:
        raise InputError(f"--amplitude: {machine} has no [cutting], so there are no lobes to compute")
    words = ["jointlib", "run", str(machine), "-o", str(output)]
    words += ["--amplitude", *(f"{A:g}" for A in amplitude)] if amplitude else []
    words += ["--tool", *changes.values()] if changes else []
    road = Road(model, output, Steps(), shlex.join(words))
    road.warnings += model.remarks()
    if bare := ", ".join(model.without_equations):
        road.warnings.append(f"Only FRFs are known of {bare}: not checked against python-control.")
    walk(pieces_of(model, tuple(sorted(amplitude)) or _AMPLITUDES), road)
    data = road.close()
    doubts = [f"warning: {doubt}" for doubt in road.doubts]
    lost = [f"failed: {why}" for why in road.failed]
    emit(as_json, data, [*road.advice, *doubts, *lost, *road.said, *(wrote(path) for path in road.written)])
    if road.failed:
        raise CheckFailed("; ".join(road.failed))
