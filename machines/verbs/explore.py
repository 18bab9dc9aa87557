"""A web page on this computer: sliders, responses, lobes, designs of a study."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from jointlib.cli.arguments import Target, Verb, input_file, tool_option
from jointlib.cli.output import working
from jointlib.errors import InputError

if TYPE_CHECKING:
    from jointlib.joint import Joint


@click.command("explore", cls=Verb)
@input_file("machine")
@click.option("--study", type=click.Path(path_type=Path), help="Study file whose designs are shown; with --results.")
@click.option("--results", type=click.Path(path_type=Path), help="Folder of 'jointlib study run'.")
@click.option(
    "-o", "output", type=Target(folder=True), default=Path("explore"), help="Folder for files; default: explore."
)
@click.option("--measured", type=click.Path(path_type=Path), multiple=True, help="Measured FRFs to lay over it.")
@tool_option
@click.option("--port", type=click.IntRange(0, 65535), help="Default: 8050, or any that is free; 0: any that is free.")
@click.option("--host", default="127.0.0.1", help="Address to listen at; default: 127.0.0.1, this computer alone.")
def command(
    machine: Path,
    study: Path | None,
    results: Path | None,
    output: Path,
    measured: tuple[Path, ...],
    changes: dict[str, str],
    port: int | None,
    host: str,
) -> None:
    """Show MACHINE on a page that answers to sliders: responses, describing functions, stability lobes.

    The page asks nothing of the internet and is shown to this computer alone. Ctrl-C ends it.

    \b
    Example:
      jointlib explore machines/library/guide_mill.toml
    """
    if importlib.util.find_spec("dash") is None:
        raise InputError("explore: needs the package dash, install it with pip install 'jointlib[explore]'")
    if (study is None) != (results is None):
        raise InputError("--study and --results: expected both, the study file and the folder of its results")
    from ..explore.scene import Explorer
    from ..explore.server import bound, explorer_app, is_this_computer, listening

    with bound(host, port) as place:
        alone = is_this_computer(place.getsockname()[0])
        with working("reading the machine"):
            joints, remarks = identified(machine, changes)
            explorer = Explorer(machine, study, results, joints, next(iter(changes.values()), ""), measured)
            app, writing = explorer_app(explorer, machine.stem, output, exported, alone)
        server = listening(app, place)
    for remark in remarks:
        click.echo(remark)
    if not alone:
        click.echo(
            f"jointlib: whoever reaches {host} over the network can use this page and write into {output}", err=True
        )
    name = f"[{server.host}]" if ":" in server.host else server.host
    click.echo(f"http://{name}:{server.port} shows {machine}; Ctrl-C ends it")
    # Ctrl-C is what this returns from.
    server.serve_forever()
    if writing.locked():
        click.echo("finishing the file that is being written …", err=True)
    with writing:
        click.echo("ended")


def identified(path: Path, changes: dict[str, str] | None = None) -> tuple[dict[str, Joint], Sequence[str]]:
    """Joints that the machine leaves to be identified, and what is to be said of them."""
    from .. import read_machine
    from ..road.open_joints import with_joints

    machine = read_machine(path, changes)
    open_ones = {c.name for c in machine.connections if c.identify is not None}
    found, remarks = with_joints(machine)
    return {c.name: c.joint for c in found.connections if c.name in open_ones and c.joint is not None}, remarks


def exported(machine: Path, target: Path) -> Sequence[str]:
    """The machine of a file as an FMU; which runtime it has, and what else there is to say."""

    from jointlib.registry import plugin

    from .. import read_machine
    from ..road.open_joints import with_joints

    model, remarks = with_joints(read_machine(machine))
    done = plugin("jointlib.exports", "fmu", "explore")(model, target)
    runtime = "native code (C)" if done.runtime == "c" else "Python, because no C compiler was found"
    verified = f"verified with {', '.join(done.verified_with)}" if done.verified_with else "not verified"
    return [f"It computes in {runtime}, {verified}.", *done.messages, *remarks]
