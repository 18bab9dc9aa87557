"""Compare many configurations of a machine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from jointlib.cli.arguments import Target, Verb, input_file, json_option
from jointlib.cli.output import Working, emit, wrote

if TYPE_CHECKING:
    from ..answers.study import StudyResults


tools_option = click.option(
    "--tool",
    "tools",
    multiple=True,
    metavar="NAME",
    help="Named tools of the machine; of several the worst counts. Default: those that the study says.",
)


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
        click.option(
            "-o", "output", type=Target(folder=True, shared=True), required=True, help="Folder of the results."
        ),
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
    _compute(study, tools, output, as_json, "run", **how)


@command.command("resume", cls=Verb)
@_options
def resume(study: Path, output: Path, as_json: bool, tools: tuple[str, ...], **how: Any) -> None:
    """Go on with STUDY in a folder where it was begun.

    \b
    Example:
      jointlib study resume machines/library/guide_mill.study.toml -o study
    """
    _compute(study, tools, output, as_json, "resume", **how)


@command.command("report", cls=Verb)
@input_file("study")
@click.option("-o", "output", type=Target(folder=True, shared=True), required=True, help="Folder of the results.")
@tools_option
@click.option("--table", "target", type=Target(".parquet", ".csv"), help="Write every configuration to this file.")
@json_option
def report(study: Path, output: Path, tools: tuple[str, ...], target: Path | None, as_json: bool) -> None:
    """Say what the results of STUDY in the folder amount to, in a report, with the best machine as a file.

    \b
    Example:
      jointlib study report machines/library/guide_mill.study.toml -o study
    """
    from ..answers.study import study as studied

    _tell(studied(study, output, part="report", tool=tools, table=target, progress=Working()), as_json)


def _compute(
    study: Path, tools: tuple[str, ...], output: Path, as_json: bool, part: Literal["run", "resume"], **how: Any
) -> None:
    from ..answers.study import study as studied

    try:
        found = studied(study, output, part=part, tool=tools, progress=Working(), **how)
    except KeyboardInterrupt:
        click.echo("\njointlib: what is computed is kept; 'jointlib study resume' goes on with it", err=True)
        raise
    _tell(found, as_json)


def _tell(found: StudyResults, as_json: bool) -> None:
    emit(as_json, found.as_json(), [*found.words(), *map(wrote, found.files)])
