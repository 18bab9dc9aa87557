"""Find what a joint model leaves unexplained, name it, mend the joint."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Given, Target, Verb, input_file, json_option
from jointlib.cli.output import Working, emit, wrote


@click.command("trace", cls=Verb)
@input_file("measurement")
@click.option("--joint", type=Given(), help="The joint model to doubt.")
@click.option("--machine", type=Given(), help="The machine to doubt, for measured FRFs.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of whatever is drawn, noted in the report.")
@click.option("--safe", type=float, help="Test cuts: how probably stable the most productive cut is; default 0.95.")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder for what is written.")
@json_option
def command(
    measurement: Path,
    joint: Path | None,
    machine: Path | None,
    seed: int,
    safe: float | None,
    output: Path,
    as_json: bool,
) -> None:
    """Say what a joint leaves unexplained of MEASUREMENT, name the effect it lacks, mend it, show before and after.

    With --machine, MEASUREMENT holds frequency responses at several forces (kind "frf"): say which connection of the
    machine they point to, and mend the joint in it; or test cuts (kind "cuts"): say which of them its chart cannot
    explain, which effect would, and what to cut next.

    \b
    Examples:
      jointlib trace machines/library/guide_mill/rig.measurement.toml --joint machines/library/guide_mill/start.joint.toml -o traced
      jointlib trace machines/library/three_joints/tip.measurement.toml --machine machines/library/three_joints.toml -o traced
      jointlib trace machines/library/end_mill_cuts/cuts.measurement.toml --machine machines/library/end_mill_cuts/mill.toml -o traced
    """  # noqa: E501
    from ..answers.trace import trace

    found = trace(measurement, joint=joint, machine=machine, seed=seed, safe=safe, output=output, progress=Working())
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, found.files)])
