"""A web page on this computer: sliders, responses, lobes, designs of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from jointlib.cli.arguments import Given, Target, Verb, input_file, tool_option
from jointlib.cli.output import Working


@click.command("explore", cls=Verb)
@input_file("machine")
@click.option("--study", type=Given(), help="Study file whose designs are shown; with --results.")
@click.option("--results", type=Given(), help="Folder of 'jointlib study run'.")
@click.option(
    "-o", "output", type=Target(folder=True), default=Path("explore"), help="Folder for files; default: explore."
)
@click.option("--measured", type=Given(), multiple=True, help="Measured FRFs to lay over it.")
@tool_option
@click.option("--port", type=click.IntRange(0, 65535), help="Default: 8050, or any that is free; 0: any that is free.")
@click.option("--host", default="127.0.0.1", help="Address to listen at; default: 127.0.0.1, this computer alone.")
def command(machine: Path, changes: dict[str, str], output: Path, host: str, **asked: Any) -> None:
    """Show MACHINE on a page that answers to sliders: responses, describing functions, stability lobes.

    The page asks nothing of the internet and is shown to this computer alone. Ctrl-C ends it.

    \b
    Example:
      jointlib explore machines/library/guide_mill.toml
    """
    from ..answers.explore import explore

    tool = changes.get("tool.use")
    page = explore(machine, output=output, tool=tool, host=host, wait=True, progress=Working(), **asked)
    for remark in page.remarks:
        click.echo(remark)
    if not page.alone:
        click.echo(
            f"jointlib: whoever reaches {host} over the network can use this page and write into {output}", err=True
        )
    click.echo(f"{page.address} shows {machine}; Ctrl-C ends it")
    page.serve()  # Ctrl-C is what this returns from.
    if page.writing.locked():
        click.echo("finishing the file that is being written …", err=True)
    with page.writing:
        click.echo("ended")
