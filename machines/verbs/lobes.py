"""Stability lobes of a machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import SoFar, Working, emit, wrote

from ..road.cutting import BUDGET
from .quantities import AMPLITUDE, DEPTH


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
    "--optimise",
    type=click.Choice(["pitch"]),
    help="Pitches that lift the least depth most, from the lowest to the highest --speed, or over the file's range.",
)
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the depths from so many samples of what is uncertain."
)
@click.option(
    "--budget",
    type=Quantity("s", lower=0),
    default=BUDGET,
    help="Time of the whole, beside what is asked for at --speed: charts over the range, of all tools, end with what "
    f"is known when it is up, and what comes after them is left out where it takes longer; default: {BUDGET:g} s.",
)
@click.option("-o", "output", type=Target(".npz", ".csv", ".svg"), help="Also write the charts: numbers or a picture.")
@tool_option
@json_option
def command(machine: Path, changes: dict[str, str], as_json: bool, **asked: Any) -> None:
    """Depth of cut at which MACHINE starts to chatter, over spindle speed, with chatter frequency and lobe.

    With depths too, also the largest multiplier |μ| of a vibration from one tooth to the next: below 1 it dies out.

    \b
    Example:
      jointlib lobes machines/library/two_mode_tool.toml --speed 6000 9000 12000
    """
    from ..answers.lobes import lobes

    so_far = SoFar(as_json)
    found = lobes(machine, tool=changes.get("tool.use"), progress=Working(), said=so_far, **asked)
    found.lines.extend(map(wrote, found.files))
    so_far(found.lines)
    if as_json:
        emit(True, found.data, [])
