"""What a trace of a machine leaves behind: the report, the mended joint, and the machine file that holds it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.atomic import write_npz, write_text
from jointlib.io.joint_file import joint_table, write_joint
from jointlib.io.measurement_write import from_folder
from jointlib.io.toml_file import write_toml
from jointlib.joint import Joint

from ..files.machine_writer import machine_document
from ..model.machine import Machine
from ..model.named_files import documents_and_data
from .report import MachineTrace

JOINT, MACHINE = "joint.toml", "machine.toml"


def write_trace(report: MachineTrace, folder: Path) -> tuple[tuple[Path, ...], MachineTrace]:
    """Write ``trace.json``, ``trace.npz``, ``machine.toml`` and, where a joint was mended, ``joint.toml``.

    Returns the paths, and the report with a warning more where a bundle had to be written out.
    """
    document, joint, said = mended_document(report.machine, report.mended, report.place, folder)
    report = replace(report, warnings=(*report.warnings, *said))
    paths = [folder / "trace.json", folder / "trace.npz", folder / MACHINE]
    if joint is not None:
        paths.append(folder / JOINT)
        write_joint(paths[-1], joint)
    write_text(paths[0], json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n")
    write_npz(paths[1], report.plots)
    write_toml(paths[2], "machine", document)
    return tuple(paths), report


def check_target(machine: Path, folder: Path) -> None:
    """Refuse a folder in which the mended files would replace the machine file or a file that it uses."""
    used = {file.resolve() for file in documents_and_data(machine)}
    for name in (MACHINE, JOINT):
        if (folder / name).resolve() in used:
            raise InputError(f"-o {folder}: its {name} belongs to the machine to be traced, expected another folder")


def mended_document(
    machine: Machine, mended: Machine, place: str | None, folder: Path
) -> tuple[dict[str, Any], Joint | None, tuple[str, ...]]:
    """The machine file for another folder, with the joint of a place in ``joint.toml`` there.

    A bundle is made from its geometry and can hold no other joint, so it is written out as its rows. ``joint.toml``
    is then that of the first row; rows whose joint is another hold theirs themselves.
    """
    changed = {c.name for c, given in zip(mended.flexible, machine.flexible, strict=True) if c.joint is not given.joint}
    rows = [c for c in mended.flexible if place is not None and c.name in changed]
    joints = {c.name: c.joint for c in rows if c.joint is not None}
    tables = {name: joint_table(joint) for name, joint in joints.items()}
    first = next(iter(joints), "")

    def held(name: str, joint: Joint) -> Any:
        table = tables.get(name) or joint_table(joint)
        return JOINT if table == tables[first] else table

    def named(file: Path) -> str:
        return from_folder(folder, file.parent, file.name)

    document = machine_document(machine, {}, joints, named, held)
    said = (
        f"{MACHINE}: the bundle {place} is made from its geometry and cannot hold the mended joint; it is written out "
        f"as its {len(rows)} rows.",
    )
    return document, joints.get(first), said if any("bundle" in joint.provenance for joint in joints.values()) else ()
