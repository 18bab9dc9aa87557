"""Say what a file holds, in plain words, with units."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import emit


@click.command("inspect", cls=Verb)
@input_file("file")
@click.option("-o", "output", type=Target(".svg", ".html"), help="Draw a machine into this file: .svg or .html.")
@click.option("--mode", type=click.IntRange(1), help="Show this mode, from 1 on in ascending frequency; with -o.")
@click.option("--contacts", is_flag=True, help="Of a machine: every connection on a line of its own.")
@tool_option
@json_option
def command(
    file: Path, output: Path | None, mode: int | None, contacts: bool, changes: dict[str, str], as_json: bool
) -> None:
    """Say what FILE holds: a measurement, joint, component, machine or study, a record (text, npz, tdms …), an FMU.

    Of a machine also masses, stiffnesses and first modes, and what looks like a mistake in it.
    With -o a machine is drawn as well: an SVG with four views, or an HTML page in which it turns and its modes move.

    \b
    Examples:
      jointlib inspect machines/library/guide.joint.toml
      jointlib inspect machines/library/lathe.toml -o lathe.html
    """
    from ..answers.inspect import inspect

    found = inspect(file, output=output, mode=mode, contacts=contacts, tool=changes.get("tool.use"))
    emit(as_json, found.as_json(), found.lines)
