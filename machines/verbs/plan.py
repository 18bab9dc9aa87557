"""Say what to measure so that effects can be told apart."""

from __future__ import annotations

from pathlib import Path

import click

from jointlib.cli.arguments import Given, Quantity, Target, Verb, Words, input_file, json_option, tool_option
from jointlib.cli.output import Working, emit, wrote


@click.command("plan", cls=Verb)
@input_file("file")
@click.option("--rig", type=Given(), help="Measurement file of a rig like yours: bodies, channels.")
@click.option(
    "--effects", multiple=True, type=Words(), help="Effects in question, or faults; default: what a joint may lack."
)
@click.option(
    "--noise",
    multiple=True,
    type=Words(),
    help="Rms: of a sample 0.02m/s^2, a1=0.05m/s^2, P=0.1N; of a line 1e-9m/N; 60dB.",
)
@click.option("--amplitude", type=Quantity("m", 0.0), help="How far the joint may be moved; default: its validity.")
@click.option("--force", type=Quantity("N", 0.0), help="Of a machine: the largest that is safe; default: its file's.")
@click.option("--size", help="Share of the joint force from which an effect counts, 2%; of a response, 5%.")
@click.option("--rate", type=Quantity("Hz", 0.0), help="Sample rate; default: that of --rig, or as the joint asks.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of phases, noise and what is hidden.")
@click.option("-o", "output", type=Target(folder=True), required=True, help="A new folder for what is written.")
@tool_option
@json_option
def command(
    file: Path,
    rig: Path | None,
    effects: tuple[str, ...],
    noise: tuple[str, ...],
    amplitude: float | None,
    force: float | None,
    size: str | None,
    rate: float | None,
    seed: int,
    output: Path,
    changes: dict[str, str],
    as_json: bool,
) -> None:
    """Say which test decides between the effects in question of FILE, a joint or a machine, and write what to play and
    the measurement file to fill.

    For a joint that is a rig shaken by multisines, for a machine frequency responses at several forces. The cheapest
    test is chosen by how far effects lie apart in it; what it decides is what `jointlib trace` answers on simulated
    records of it, every effect hidden in turn. What stays confused is tried under other tests.

    \b
    Examples:
      jointlib plan machines/library/guide.joint.toml --rig machines/library/guide_mill/rig.measurement.toml --effects quadratic-damping -o plan
      jointlib plan machines/library/three_joints.toml --effects guide:coulomb bearing:refit -o tip_plan
    """  # noqa: E501

    from ..answers.plan import plan

    found = plan(
        file,
        rig=rig,
        effects=effects,
        noise=noise,
        amplitude=amplitude,
        force=force,
        size=size,
        rate=rate,
        seed=seed,
        folder=output,
        tool=changes.get("tool.use"),
        progress=Working(),
    )
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, found.files)])
