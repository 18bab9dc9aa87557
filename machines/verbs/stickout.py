"""How far a tool may stick out so that the wanted speed lies in a pocket."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import Quantity, Target, Verb, input_file, json_option, tool_option
from jointlib.cli.output import Working, emit, wrote


@click.command("stickout", cls=Verb)
@input_file("machine")
@click.option("--between", type=Quantity("m", lower=0), multiple=True, required=True, help="Shortest and longest.")
@click.option("--speed", type=Quantity("rpm", lower=0), required=True, help="Spindle speed that is wanted.")
@click.option("--count", type=int, default=13, show_default=True, help="Stick-outs of the curve.")
@click.option("--component", help="Which component of kind tool; default: the only one.")
@click.option("--method", help="Of the lobes; default: what suits.")
@click.option("-o", "output", type=Target(".csv", ".svg"), help="The file of the curve to write.")
@tool_option
@json_option
def command(machine: Path, changes: dict[str, str], as_json: bool, **asked: Any) -> None:
    """The stick-outs of a tool that put a pocket at a speed, and the depth of cut over the stick-out.

    \b
    Example:
      jointlib stickout machines/library/end_mill.toml --between 66mm 76mm --speed 15000 --method zero-order
    """
    from ..answers.stickout import stickout

    found = stickout(machine, tool=changes.get("tool.use"), progress=Working(), **asked)
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, found.files)])
