"""Nonlinear forced response of a machine, all branches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import FrequencyRange, Given, Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Working, emit, wrote

PLOTS = ("mag-phase", "re-im", "nyquist")


@click.command("frf", cls=Verb)
@input_file("machine")
@click.option("--force", type=Quantity("N"), multiple=True, help="Peak force; default: those of the file.")
@click.option("--frequency", type=FrequencyRange(), help="lo:hi:n; default: the range of the file.")
@click.option("--drive", help="Degree of freedom the force acts on; default: that of the file, else each of the tool.")
@click.option(
    "--harmonics",
    help="auto (the default: further ones where they matter by more than 0.1 %), 1 (the first alone; the default of "
    "--samples), or multiples such as 1,3,5.",
)
@click.option(
    "--samples", type=click.IntRange(40), help="Band of the receptance from so many samples of what is uncertain."
)
@click.option(
    "-o",
    "output",
    type=Target(".npz", ".csv", ".frf", ".svg", ".png"),
    required=True,
    help=".npz: every branch; .csv, .frf (CutPro): receptances, one file per force and output; .svg, .png: a picture.",
)
@click.option("--measured", type=Given(), multiple=True, help="Measured FRFs to lay over it.")
@click.option("--contacts", is_flag=True, help="Also list the peaks of every contact.")
@click.option("--plot", type=click.Choice(PLOTS), default=PLOTS[0], help="What a picture shows.")
@tool_option
@json_option
def command(machine: Path, changes: dict[str, str], as_json: bool, **asked: Any) -> None:
    """Forced response of MACHINE at each force: every branch, with the peaks of the tool and of each joint.

    \b
    Example:
      jointlib frf machines/library/two_mass.toml --force 10 50N --frequency 1kHz:7kHz -o two_mass.npz
    """
    from ..answers.frf import frf

    found = frf(machine, tool=changes.get("tool.use"), progress=Working(), **asked)
    emit(as_json, found.data, [*found.lines, *map(wrote, found.files)])
