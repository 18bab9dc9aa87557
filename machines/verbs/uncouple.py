"""The end of a spindle without the blank that it was measured with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import FrequencyRange, Given, Quantity, Target, Verb, input_file, json_option
from jointlib.cli.output import Working, emit, wrote


@click.command("uncouple", cls=Verb)
@input_file("measured", metavar="MEASURED...", nargs=-1, required=True)
@click.option("--remove", type=Given(), multiple=True, required=True, help="Component or tool file of the blank.")
@click.option("-o", "output", type=Target(".toml"), required=True, help="The component file to write.")
@click.option("--at", help="Station of the blank that is coupled; default: where nothing was measured.")
@click.option("--band", type=FrequencyRange(), help="lo:hi, the lines that are used.")
@click.option("--condition", help="Which one of several levels.")
@click.option(
    "--overhang",
    type=Quantity("m", lower=0),
    help="From the tip to the face of the spindle: a longer blank is refused.",
)
@json_option
def command(measured: tuple[Path, ...], as_json: bool, **asked: Any) -> None:
    """End receptances of a spindle, deflection and rotation, from MEASURED FRFs of it with a known blank.

    With one --remove all files are of one assembly; with as many as files each is of its own, all on one spindle.

    \b
    Example:
      jointlib uncouple machines/library/bar.measurement.toml --remove machines/library/bar.component.toml -o end.toml
    """
    from ..answers.uncouple import uncouple

    found = uncouple(measured, progress=Working(), **asked)
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, found.files)])
