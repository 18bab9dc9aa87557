"""What a trace of a machine leaves behind: the report, the mended joint, and the machine file that holds it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.atomic import write_npz, write_text
from jointlib.io.joint_file import joint_table, write_joint
from jointlib.io.measurement_write import from_folder
from jointlib.io.toml import write_toml

from ..connection import Connection
from ..machine import Machine
from .report import MachineTrace

JOINT, MACHINE = "joint.toml", "machine.toml"


def write_trace(report: MachineTrace, folder: Path) -> tuple[tuple[Path, ...], MachineTrace]:
    """Write ``trace.json``, ``trace.npz``, ``machine.toml`` and, where a joint was mended, ``joint.toml``.

    Returns the paths, and the report with a warning more where a bundle had to be written out.
    """
    document, joint, said = mended_document(report.machine, report.mended, report.place, folder)
    report = replace(report, warnings=(*report.warnings, *said))
    paths = [folder / "trace.json", folder / "trace.npz", folder / MACHINE]
    if joint is not None and joint.joint is not None:
        paths.append(folder / JOINT)
        write_joint(paths[-1], joint.joint)
    write_text(paths[0], json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n")
    write_npz(paths[1], report.plots)
    write_toml(paths[2], "machine", document)
    return tuple(paths), report


def check_target(machine: Path, folder: Path) -> None:
    """Refuse a folder in which the mended files would replace the machine file or a file that it uses."""
    document = _read(machine)
    used = {machine.resolve(), *((machine.parent / name).resolve() for name in _files(document, machine.parent))}
    for name in (MACHINE, JOINT):
        if (folder / name).resolve() in used:
            raise InputError(f"-o {folder}: its {name} belongs to the machine to be traced, expected another folder")


def mended_document(
    machine: Machine, mended: Machine, place: str | None, folder: Path
) -> tuple[dict[str, Any], Connection | None, tuple[str, ...]]:
    """The machine file for another folder, with the joint of a place in ``joint.toml`` there.

    A bundle is made from its geometry and can hold no other joint, so it is written out as its rows. ``joint.toml``
    is then that of the first row; rows whose joint is another hold theirs themselves.
    """
    source = machine.source
    if source is None:
        raise InputError(f"{machine.where}: was not read from a file, expected one that the mended one follows")
    document = _moved(_read(source), source.parent, folder)
    document.pop("schema")
    if place is None:
        return document, None, ()
    changed = [c for c in mended.flexible if c.name == place]
    if changed:
        for table in document["connection"]:
            if table["name"] == place:
                table.pop("identify", None)
                table["joint"] = JOINT
        return document, changed[0], ()
    rows = [c for c in mended.flexible if c.name.startswith(f"{place}.")]
    document["bundle"] = [table for table in document["bundle"] if table["name"] != place]
    if not document["bundle"]:
        del document["bundle"]
    tables = [_table(row, row.joint is rows[0].joint) for row in rows]
    document["connection"] = [*document.get("connection", []), *tables]
    said = (
        f"{MACHINE}: the bundle {place} is made from its geometry and cannot hold the mended joint; it is written out "
        f"as its {len(rows)} rows.",
    )
    return document, rows[0], said


def _table(row: Connection, first: bool) -> dict[str, Any]:
    """A row of a bundle as a ``[[connection]]``."""
    out: dict[str, Any] = {"name": row.name, "between": list(row.between)}
    if row.at is not None and row.direction is not None:
        out |= {"at": list(row.at), "direction": list(row.direction)}
    assert row.joint is not None
    return {**out, "joint": JOINT if first else joint_table(row.joint)}


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_bytes().decode("utf-8-sig"))


def _is_file(value: object, folder: Path) -> bool:
    """A string with a suffix that names a file beside the machine file; whatever key a component reads it from."""
    if not isinstance(value, str) or not Path(value).suffix:
        return False
    try:
        return (folder / value).is_file()
    except OSError:  # no name that a file could have
        return False


def _files(value: object, folder: Path) -> list[str]:
    if isinstance(value, Mapping):
        return [name for part in value.values() for name in _files(part, folder)]
    if isinstance(value, list):
        return [name for part in value for name in _files(part, folder)]
    return [value] if isinstance(value, str) and _is_file(value, folder) else []


def _moved(value: Any, old: Path, new: Path) -> Any:
    """The same tables with the names of files seen from another folder."""
    if isinstance(value, Mapping):
        return {key: _moved(part, old, new) for key, part in value.items()}
    if isinstance(value, list):
        return [_moved(part, old, new) for part in value]
    return from_folder(new, old, value) if _is_file(value, old) else value
