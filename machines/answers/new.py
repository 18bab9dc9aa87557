"""A commented file to begin with: machine, joint, measurement, study."""

from __future__ import annotations

import json
import os
from importlib.resources import files
from pathlib import Path

from jointlib.answers.given import File
from jointlib.errors import InputError, nearest
from jointlib.io.atomic import to_write, write_text

from ..files.machine_file import cutting_table, read_machine

KINDS = ("machine", "joint", "measurement", "study")


def new(kind: str, output: File, *, machine: File | None = None) -> tuple[Path, ...]:
    """Write a machine, joint, measurement or study to begin with, commented, and it runs as it is: ``jointlib new``.

    A measurement brings a simulated record, a study without ``machine`` its machine; both are written beside it. What
    exists is never overwritten.

    Parameters
    ----------
    kind
        ``"machine"``, ``"joint"``, ``"measurement"`` or ``"study"``.
    output
        The .toml file to write.
    machine
        Of a study: the file of a milling machine that is there already.

    Returns
    -------
    tuple of Path
        Every file that was written, the one that was asked for first.
    """
    output = to_write(output, "output", ".toml")
    if machine is not None and kind != "study":
        raise InputError(f"--machine: given with a {kind}, expected with a study alone")
    if kind not in KINDS:
        raise InputError(f"new: {kind!r}, {nearest(kind, KINDS)}")
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
            base = Path(machine)
            _can_be_studied(base)
        made[output] = _naming(made[output], "machine.toml", Path(os.path.relpath(base, output.parent)).as_posix())
    _write_all(made)
    return tuple(made)


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
    read_machine(machine)
    missing = {"teeth", "immersion"} - cutting_table(machine).get("cutting", {}).keys()
    if missing:
        raise InputError(f"{machine}: [cutting] has no {' and no '.join(sorted(missing))}, which the study varies")


def _write_all(made: dict[Path, str]) -> None:
    """Every file or none, and none that exists; the file that names the others comes last."""
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
