"""The whole road for a machine: identify, trace, mend, couple, check, cut, export."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Steps, emit, wrote
from jointlib.errors import CheckFailed, InputError

from .quantities import AMPLITUDE


@click.command("run", cls=Verb)
@input_file("machine")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder for everything written.")
@click.option("--amplitude", type=AMPLITUDE, multiple=True, help="Tool-point amplitudes of the lobes.")
@tool_option
@json_option
def command(machine: Path, output: Path, amplitude: tuple[float, ...], changes: dict[str, str], as_json: bool) -> None:
    """Identify the joints of MACHINE, doubt and mend them, couple, check, cut, export, and write one report.

    \b
    Example:
      jointlib run machines/library/guide_mill.toml -o out
    """
    from .. import read_machine
    from .. import run as whole_road
    from ..road.run import AMPLITUDES

    if amplitude and read_machine(machine, changes).cutting is None:
        raise InputError(f"--amplitude: {machine} has no [cutting], so there are no lobes to compute")
    words = ["jointlib", "run", str(machine), "-o", str(output)]
    words += ["--amplitude", *(f"{A:g}" for A in amplitude)] if amplitude else []
    words += ["--tool", *changes.values()] if changes else []
    said, tool = shlex.join(words), changes.get("tool.use")
    road = whole_road(machine, output, progress=Steps(), amplitudes=amplitude or AMPLITUDES, command=said, tool=tool)
    doubts = [f"warning: {doubt}" for doubt in road.doubts]
    emit(as_json, road.data, [*road.advice, *doubts, *road.said, *(wrote(path) for path in road.written)])
    if road.failed:
        raise CheckFailed("; ".join(f"failed: {why}" for why in road.failed))
