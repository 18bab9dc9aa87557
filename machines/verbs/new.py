"""A commented file to begin with: machine, joint, measurement, study."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Given, Target, Verb, json_option
from jointlib.cli.output import emit, wrote

KINDS = ("machine", "joint", "measurement", "study")


@click.command("new", cls=Verb)
@click.argument("kind", type=click.Choice(KINDS))
@click.option("-o", "output", type=Target(".toml"), required=True, help="The .toml file to write; it must not exist.")
@click.option("--machine", type=Given(), help="Of a study: a milling machine that is there already.")
@json_option
def command(kind: str, output: Path, machine: Path | None, as_json: bool) -> None:
    """Write a machine, joint, measurement or study to begin with: commented, and it runs as it is.

    A measurement brings a simulated record, a study without --machine its machine; both are written beside it. What
    exists is never overwritten.

    \b
    Examples:
      jointlib new machine -o mill.toml
      jointlib new study --machine mill.toml -o mill.study.toml
      jointlib new joint -o slide.joint.toml
      jointlib new measurement -o vise.measurement.toml
    """
    from ..answers.new import new

    made = new(kind, output, machine=machine)
    emit(as_json, {"file": str(output), "beside": [str(p) for p in made if p != output]}, [wrote(p) for p in made])
