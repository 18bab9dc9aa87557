"""Compare many configurations of a machine."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import working, wrote
from jointlib.errors import InputError

from .told.study_told import tell

if TYPE_CHECKING:
    from jointlib.joint import Joint

    from ..study.study import Study


_PER_PROCESSOR = 4
_SHARD = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")
tools_option = click.option(
    "--tool",
    "tools",
    multiple=True,
    metavar="NAME",
    help="Named tools of the machine; of several the worst counts. Default: those that the study says.",
)
_ADDRESS = re.compile(r"((tcp|tls|ucx|ws|wss)://)?[^\s/]+:[0-9]{1,5}")


class _Parts(click.Group):
    """The parts of the verb; a study file without one is asked for one."""

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        if args and args[0] not in self.commands:
            raise click.UsageError(f"study: {args[0]!r}, expected one of {', '.join(self.commands)} before the file")
        return super().resolve_command(ctx, args)


@click.group("study", cls=_Parts, invoke_without_command=True)
@click.pass_context
def command(ctx: click.Context) -> None:
    """Compare many configurations of a machine: compute them, go on after a stop, say which is best.

    \b
    Example:
      jointlib study run machines/library/guide_mill.study.toml -o study
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def _options(function: Any) -> Any:
    for option in (
        json_option,
        tools_option,
        click.option("-o", "output", type=Target(folder=True), required=True, help="Folder of the results."),
        click.option("--scheduler", help="Address of a Dask scheduler, whose workers compute instead."),
        click.option("--shard", help="k/n: only the k-th of n parts, for batch queues that share the folder."),
        click.option("--workers", type=click.IntRange(min=1), help="Processes; default: one per processor."),
        input_file("study"),
    ):
        function = option(function)
    return function


@command.command("run", cls=Verb)
@_options
def run(study: Path, output: Path, as_json: bool, tools: tuple[str, ...], **how: Any) -> None:
    """Compute every configuration of STUDY, and end with a report and the best machine as a file.

    What is in the folder already is not computed again.

    \b
    Example:
      jointlib study run machines/library/guide_mill.study.toml -o study
    """
    _compute(study, tools, output, as_json, new=True, **how)


@command.command("resume", cls=Verb)
@_options
def resume(study: Path, output: Path, as_json: bool, tools: tuple[str, ...], **how: Any) -> None:
    """Go on with STUDY in a folder where it was begun.

    \b
    Example:
      jointlib study resume machines/library/guide_mill.study.toml -o study
    """
    _compute(study, tools, output, as_json, new=False, **how)


@command.command("report", cls=Verb)
@input_file("study")
@click.option("-o", "output", type=Target(folder=True), required=True, help="Folder of the results.")
@tools_option
@click.option("--table", "target", type=Target(".parquet", ".csv"), help="Write every configuration to this file.")
@json_option
def report(study: Path, output: Path, tools: tuple[str, ...], target: Path | None, as_json: bool) -> None:
    """Say what the results of STUDY in the folder amount to, in a report, with the best machine as a file.

    \b
    Example:
      jointlib study report machines/library/guide_mill.study.toml -o study
    """
    from ..study.run import begin, planned
    from ..study.study_file import read_study
    from ..study.tables import write_table

    opened = read_study(study, tuple(dict.fromkeys(tools)))
    if not (output / "study.json").is_file():
        raise InputError(f"-o {output}: holds no study, expected the folder of 'jointlib study run'")
    store = begin(opened, output)
    if target is not None:
        write_table(planned(opened, output), store, target)
    tell(planned(opened, output), store, identified(opened), output, as_json)
    if target is not None and not as_json:
        click.echo(wrote(target))


def _compute(
    study: Path,
    tools: tuple[str, ...],
    output: Path,
    as_json: bool,
    new: bool,
    workers: int | None = None,
    shard: str | None = None,
    scheduler: str | None = None,
) -> None:
    from ..study.run import begin, evaluate_all, planned
    from ..study.study_file import read_study
    from ..study.values import check_values

    part = _part(shard)
    most = _PER_PROCESSOR * (os.cpu_count() or 1)
    if workers is not None and workers > most:
        raise InputError(f"--workers: {workers}, expected at most {most}, {_PER_PROCESSOR} for each processor")
    if scheduler is not None and not _ADDRESS.fullmatch(scheduler):
        raise InputError(f"--scheduler: {scheduler!r}, expected an address such as tcp://10.0.0.5:8786")
    opened = read_study(study, tuple(dict.fromkeys(tools)))
    if not new and not (output / "study.json").is_file():
        raise InputError(f"-o {output}: holds no study to resume, expected the folder of 'jointlib study run'")
    store = begin(opened, output)
    joints = identified(opened)
    missing = len(store.missing())
    if missing:
        check_values(opened, joints)
    try:
        with working(f"computing {missing} of {store.blocks} blocks"):
            evaluate_all(opened, store, joints, workers, part, scheduler)
    except KeyboardInterrupt:
        click.echo("\njointlib: what is computed is kept; 'jointlib study resume' goes on with it", err=True)
        raise
    tell(planned(opened, output), store, joints, output, as_json)


def _part(shard: str | None) -> tuple[int, int]:
    if shard is None:
        return 1, 1
    found = _SHARD.fullmatch(shard)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--shard: {shard!r}, expected k/n such as 2/8")
    return int(found[1]), int(found[2])


def identified(study: Study) -> dict[str, Joint]:
    """Joints that the base machine leaves to be identified, once for all configurations."""
    from .. import read_machine
    from ..road.open_joints import with_joints

    joints: dict[str, Joint] = {}
    for tool in study.with_tools:
        machine = read_machine(study.base, dict(tool))
        for name, joint in joints.items():
            if name in [c.name for c in machine.connections]:
                machine = machine.with_joint(name, joint)
        names = [c.name for c in machine.connections if c.identify is not None and c.name not in joints]
        if names:
            found, _ = with_joints(machine)
            joints |= {c.name: c.joint for c in found.connections if c.name in names and c.joint is not None}
    return joints
