"""Machine files written by the program: those of a machine that was read, with changes in them and other joints.

A written file stands for itself: what it shared with others as `parts` is part of it.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from typing import IO, Any

import tomli_w

from jointlib.errors import InputError
from jointlib.io.atomic import write, write_text
from jointlib.io.joint_file import joint_table, write_joint
from jointlib.io.toml import Section
from jointlib.io.toml_file import write_toml
from jointlib.joint import Joint
from jointlib.units import quantity

from ..bundles import expand
from ..components.connection import Connection
from ..model.axes import move, read_axes
from ..model.joint_places import changed_joints, joint_units
from ..model.machine import Machine
from ..model.named_files import documents_and_data, named_files, read, renamed
from .machine_file import documents, read_machine

_JOINTS, _JOINT = "joints", ".joint.toml"


def write_machine(
    source: Path, changes: Mapping[str, Any], target: Path, joints: Mapping[str, Joint] | None = None
) -> tuple[Path, ...]:
    """Write the machine of a file, with changes and other joints, as a file that stands for itself.

    Joint files, matrices and records that it names come into the folder beside it, ``best/`` for ``best.toml``; the
    file itself appears last, when all of them are there. Read back it is the same machine: numbers are written so
    that they read back exactly, joints and files bit for bit. A bundle with another joint is written out as its rows.

    Parameters
    ----------
    changes
        Values by path as in `read_machine`, and ``connection.guide.joint.hertz_guide.preload`` for a parameter of
        whatever joint the connection or bundle has.
    joints
        Joints in place of those in the file, by connection; identified ones, for example.

    Returns
    -------
    Every file written, the machine file first.
    """
    source, target = Path(source), Path(target)
    within = {path: value for path, value in changes.items() if ".joint." in path and ".joint.law[" not in path}
    outside = {path: _plain(value) for path, value in changes.items() if path not in within}
    machine = read_machine(source, outside)
    for name, joint in (joints or {}).items():
        machine = machine.with_joint(name, joint)
    new = {**(joints or {}), **_moved_joints(machine, within)}
    folder = target.with_suffix("")
    beside = _Beside(folder, source.parent)
    document = machine_document(machine, outside, new, beside.named, beside.held)
    made = (target, *beside.copies.values(), *beside.joints)
    clash = documents_and_data(source) & {Path(os.path.abspath(path)) for path in made}
    if clash:
        raise InputError(f"{min(clash)}: belongs to the machine {source}, expected another name for the new file")
    beside.write()
    write_toml(target, "machine", document)
    return made


def machine_document(
    machine: Machine,
    changes: Mapping[str, Any],
    joints: Mapping[str, Joint],
    named: Callable[[Path], str],
    held: Callable[[str, Joint], Any],
) -> dict[str, Any]:
    """The tables of the file that a machine was read from with changes, with other joints, for `write_toml`.

    ``named`` tells what a file that it needs is called from where the document is to lie, ``held`` what stands for a
    joint of a connection there: the name of a file, or an inline table.
    """
    if machine.source is None:
        raise InputError(f"{machine.where}: was not read from a file, expected one that the new one follows")
    whole: dict[str, Any] = {"name": machine.name}
    rows: list[Connection] = []
    for section in _drawn(machine, documents(machine.source, changes), joints):
        table = dict(section.raw())
        table["connection"] = [_open(one, joints) for one in table.get("connection", [])]
        made = [expand(bundle) for bundle in section.sections("bundle")]
        spread = [any(row.name in joints for row in bundle) for bundle in made]
        table["bundle"] = [one for one, gone in zip(table.get("bundle", []), spread, strict=True) if not gone]
        rows += [row for bundle, gone in zip(made, spread, strict=True) if gone for row in bundle]
        for key, value in renamed(table, section.folder, named).items():
            whole[key] = [*whole.get(key, []), *value] if isinstance(value, list) else value
    whole["connection"] += [_row_table(row) for row in rows]
    now = {row.name: row.joint for row in rows if row.joint is not None} | dict(joints)
    for one in whole["connection"]:
        if one["name"] in now:
            one["joint"] = held(one["name"], now[one["name"]])
    return {key: value for key, value in whole.items() if value != []}


def _drawn(machine: Machine, sections: list[Section], joints: Mapping[str, Joint]) -> list[Section]:
    """The tables as they are; drawn where the axes stand, if a bundle is to be written out as its rows.

    Rows would travel otherwise than their bundle does: a screw's bearing stays where it is.
    """
    given = {one.get("name") for section in sections for one in section.raw().get("connection", [])}
    if given >= set(joints) or not any(axis.position for axis in machine.axes):
        return sections
    tables = [section.raw().get("axis", []) for section in sections]
    move(sections, read_axes(sections))
    for section, held in zip(sections, tables, strict=True):
        section.raw()["axis"] = [_from_here(table, machine) for table in held]
    return sections


def _from_here(table: dict[str, Any], machine: Machine) -> dict[str, Any]:
    """An ``[[axis]]`` of a machine that is drawn where it stands."""
    axis = next(axis for axis in machine.axes if axis.name == table["name"])
    kept = {key: value for key, value in table.items() if key != "position"}
    return kept if axis.travel is None else {**kept, "travel": [end - axis.position for end in axis.travel]}


def _open(connection: dict[str, Any], joints: Mapping[str, Joint]) -> dict[str, Any]:
    """A ``[[connection]]`` without what its own joint was, where it gets another."""
    gone = ("joint", "identify", "rigid") if connection.get("name") in joints else ()
    return {key: value for key, value in connection.items() if key not in gone}


def _row_table(row: Connection) -> dict[str, Any]:
    """A row of a bundle as a ``[[connection]]``, without its joint."""
    out: dict[str, Any] = {"name": row.name, "between": list(row.between)}
    if row.at is not None and row.direction is not None:
        out |= {"at": list(row.at), "direction": list(row.direction)}
    return out


def _moved_joints(machine: Machine, changes: Mapping[str, Any]) -> dict[str, Joint]:
    """The joints that changes of their parameters make another of, by connection."""
    units = joint_units(machine, changes)
    values = tuple((path, quantity(changes[path], unit, f"{machine.where}: {path}")) for path, unit in units.items())
    known = [c for c in machine.flexible if c.joint is not None]
    found = zip(known, changed_joints(machine, values), strict=True)
    return {c.name: joint for c, joint in found if joint is not c.joint}


def _plain(value: Any) -> Any:
    """What TOML holds: lists for tuples, Python's numbers for numpy's."""
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    return value.item() if hasattr(value, "item") else value


class _Beside:
    """What goes into the folder beside a machine file: copies, by the folder they come from, and joints."""

    def __init__(self, folder: Path, home: Path) -> None:
        self.copies: dict[Path, Path] = {}
        self.joints: dict[Path, Joint] = {}
        self._folder = folder
        self._places = {Path(os.path.abspath(home)): ""}
        self._held: dict[str, str] = {}

    def named(self, file: Path) -> str:
        """What a file is called from the machine file, once it is copied with what it names itself."""
        if file.parent not in self._places:
            self._places[file.parent] = _free(file.parent.name or "files", {*self._places.values(), _JOINTS})
        place = self._folder / self._places[file.parent]
        if file not in self.copies:
            self.copies[file] = place / file.name
            rows = file.with_suffix(".dof")
            if rows.is_file():  # CalculiX keeps the nodes of a matrix beside it
                self.copies[rows] = place / rows.name
            for other in _needed(file):
                self.named(other)
        return self._seen_from(self._folder.parent, file)

    def held(self, name: str, joint: Joint) -> str:
        """The file of a joint; rows with the same joint have one together."""
        text = repr(joint_table(joint))
        if text not in self._held:
            stem = _free(joint.name or name, {path.name.removesuffix(_JOINT) for path in self.joints})
            path = self._folder / _JOINTS / f"{stem}{_JOINT}"
            self.joints[path] = joint
            self._held[text] = path.relative_to(self._folder.parent).as_posix()
        return self._held[text]

    def write(self) -> None:
        """Everything; a document whose files lie elsewhere now is written anew with their names."""
        for original, copy in self.copies.items():
            seen = partial(self._seen_from, copy.parent)
            if all(other == Path(os.path.abspath(original.parent / seen(other))) for other in _needed(original)):
                write(copy, _content(original))
            else:
                write_text(copy, tomli_w.dumps(renamed(read(original), original.parent, seen)))
        for file, joint in self.joints.items():
            write_joint(file, joint)

    def _seen_from(self, folder: Path, file: Path) -> str:
        return Path(os.path.relpath(self.copies[file], folder)).as_posix()


def _needed(file: Path) -> list[Path]:
    """What a document names; a joint does not need what it was identified from."""
    if file.suffix != ".toml":
        return []
    table = read(file)
    return [] if table.get("schema") == "jointlib/joint/1" else named_files(table, file.parent)


def _content(file: Path) -> Callable[[IO[bytes]], object]:
    def fill(target: IO[bytes]) -> None:
        with file.open("rb") as source:
            shutil.copyfileobj(source, target)

    return fill


def _free(name: str, taken: Collection[str]) -> str:
    return next(n for n in (name, *(f"{name}_{k}" for k in range(2, len(taken) + 3))) if n not in taken)
