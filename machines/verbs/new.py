"""A commented file to begin with: machine, joint, measurement, study."""

from __future__ import annotations

import json
import os
from importlib.resources import files
from pathlib import Path

import click

from jointlib.cli.arguments import Target, Verb, json_option
from jointlib.cli.output import emit, wrote
from jointlib.errors import InputError

KINDS = ("machine", "joint", "measurement", "study")


@click.command("new", cls=Verb)
@click.argument("kind", type=click.Choice(KINDS))
@click.option("-o", "output", type=Target(".toml"), required=True, help="The .toml file to write; it must not exist.")
@click.option("--machine", type=click.Path(path_type=Path), help="Of a study: a milling machine that is there already.")
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
    if machine is not None and kind != "study":
        raise InputError(f"--machine: given with a {kind}, expected with a study alone")
    made = {output: files("jointlib").joinpath("templates", f"{kind}.toml").read_text("utf-8")}
    if kind == "measurement":
        record = _beside(output, ".measurement", ".csv")
        made[record] = files("machines").joinpath("library", "guide_mill", "static.csv").read_text("utf-8")
        made[output] = _naming(made[output], "record.csv", record.name)
    elif kind == "study":
        if machine is None:
            base = _beside(output, ".study", ".toml")
            made[base] = files("jointlib").joinpath("templates", "machine.toml").read_text("utf-8")
        else:
            base = machine
            _can_be_studied(base)
        made[output] = _naming(made[output], "machine.toml", Path(os.path.relpath(base, output.parent)).as_posix())
    _write_all(made)
    emit(as_json, {"file": str(output), "beside": [str(p) for p in made if p != output]}, [wrote(p) for p in made])


def _beside(output: Path, ending: str, suffix: str) -> Path:
    """The neighbour of a file that is named like it: ``mill.toml`` of ``mill.study.toml``."""
    stem = output.stem.removesuffix(ending)
    neighbour = output.with_name(f"{stem}{suffix}")
    return output.with_name(f"{stem}.machine.toml") if neighbour == output else neighbour


def _naming(template: str, placeholder: str, name: str) -> str:
    """The template with the name of the other file in the place of the one it has; JSON's strings are TOML's too."""
    return template.replace(f'"{placeholder}"', json.dumps(name, ensure_ascii=False))


def _can_be_studied(machine: Path) -> None:
    """Refuse a machine file with a fault, or without what the study varies."""
    from .. import read_machine
    from ..files.machine_file import cutting_table

    read_machine(machine)
    missing = {"teeth", "immersion"} - cutting_table(machine).get("cutting", {}).keys()
    if missing:
        raise InputError(f"{machine}: [cutting] has no {' and no '.join(sorted(missing))}, which the study varies")


def _write_all(made: dict[Path, str]) -> None:
    """Every file or none, and none that exists; the file that names the others comes last."""
    from jointlib.io.atomic import write_text

    for path in made:
        if os.path.lexists(path):
            raise InputError(f"{path}: exists already, expected the name of a new file")
    done: list[Path] = []
    try:
        for path, text in reversed(made.items()):
            write_text(path, text)
            done.append(path)
    except BaseException:
        for path in done:
            path.unlink(missing_ok=True)
        raise
