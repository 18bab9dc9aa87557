"""Machine files: ``schema = "jointlib/machine/1"``."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.io.joint_file import joint_from, read_joint
from jointlib.io.toml import Section, read_toml
from jointlib.joint import Joint
from jointlib.registry import plugin

from .axes import move, read_axes
from .bundles.bundle import placed
from .changes import change
from .component import Component
from .connection import Connection, Identify
from .flange import flange
from .lobes.cutting import Cutting
from .machine import Machine
from .named_tools import choose_tool
from .nodes import DIRECTIONS
from .outline import take_outlines
from .sound import check_sound
from .static_load import StaticLoad

CUTTING_UNITS = {
    "tangential": "N/m^2",
    "normal": "N/m^2",
    "specific": "N/m^2",
    "immersion": "1",
    "feed": "m",
    "diameter": "m",
    "exponent": "1",
    "feed_direction": "rad",
}
"""Keys of ``[cutting]`` that are numbers, and their units."""
_NOT_COVERED = {
    "helix": "teeth are taken as straight",
    "pitch": "teeth are taken as evenly spaced",
    "lead_angle": "the edge is taken as parallel to the tool axis",
    "runout": "all teeth are taken to cut on one circle",
}


def read_machine(path: Path | str, changes: Mapping[str, Any] | None = None) -> Machine:
    """The machine in a file; joint files it names are read, records to identify from are only noted.

    ``changes`` puts values in the place of those in the file, by path: ``{"cutting.immersion": 0.3}``, see
    `machines.changes.change`.
    """
    path = Path(path)
    all_of = documents(path, changes)
    document = all_of[-1]
    name = document.text("name", path.name.removesuffix(".toml").removesuffix(".machine"))
    outlines = take_outlines(all_of)
    axes = read_axes(all_of)
    move(all_of, axes)
    components = tuple(_component(section) for each in all_of for section in each.sections("component"))
    connections = tuple(c for each in all_of for section in each.sections("connection") for c in _connection(section))
    bundles = tuple(placed(section) for each in all_of for section in each.sections("bundle"))
    for part in all_of[:-1]:
        part.done()
    static = StaticLoad.from_section(document.section("static")) if document.has("static") else None
    tool_section = document.section("tool")
    tool = {axis: tool_section.text(axis) for axis in ("x", "y") if tool_section.has(axis)}
    tool_name = tool_section.text("name", None)
    tool_section.done()
    response = document.section("response")
    drive = response.text("drive", None)
    force = response.numbers("force", "N", ())
    frequency = response.numbers("frequency", "Hz", None, length=2)
    response.done()
    cutting = _cutting(document.section("cutting")) if document.has("cutting") else None
    compare = tuple(_laid_over(section) for section in document.sections("compare"))
    document.done()
    machine = Machine(
        components=components,
        connections=(*connections, *(c for bundle in bundles for c in bundle.connections)),
        name=name,
        tool=tool,
        tool_name=tool_name,
        drive=drive,
        force=force,
        frequency=None if frequency is None else (frequency[0], frequency[1]),
        cutting=cutting,
        static=static,
        axes=axes,
        bundles=bundles,
        compare=compare,
        outlines=outlines,
        source=path,
    )
    check_sound(machine)
    return machine


def documents(path: Path, changes: Mapping[str, Any] | None = None) -> list[Section]:
    """The tables of a machine file after those of its parts, opened but not read, with changes in them."""
    document = read_toml(path, "machine")
    own = dict(changes or {})
    change([document], {key: own.pop(key) for key in list(own) if key.startswith("parts")}, str(path))
    all_of = [*(_part(document, file) for file in document.words("parts", ())), document]
    change(all_of, own, str(path))
    choose_tool(all_of)
    return all_of


def cutting_table(path: Path | str) -> dict[str, Any]:
    """The ``[cutting]`` table of a machine file as it stands there, for `read_cutting`; empty where there is none."""
    return {key: table for key, table in read_toml(Path(path), "machine").raw().items() if key == "cutting"}


def read_cutting(path: Path | str, table: Mapping[str, Any], changes: Mapping[str, Any]) -> Cutting:
    """The cutting operation alone of a machine file, with changes in its ``[cutting]`` table; see `read_machine`."""
    document = Section(deepcopy(dict(table)), str(path), Path(path).parent)
    change([document], changes, str(path))
    return Cutting(**_cutting(document.section("cutting")))


def _part(document: Section, file: str) -> Section:
    """A file of components, connections and bundles that several machines share."""
    path = document.folder / file
    if not path.is_file():
        raise InputError(f"{document.where}: parts refers to {path}, which does not exist")
    return read_toml(path, "parts")


def _component(section: Section) -> Component:
    cls: type[Component] = plugin("jointlib.components", section.text("kind"), section.where)
    try:
        component = cls.from_section(section)
    except InputError as error:
        raise InputError(_placed(section, error)) from None
    section.done()
    return component


def _connection(section: Section) -> tuple[Connection, ...]:
    """One scalar connection, or those of a flange."""
    name = section.text("name")
    between = section.words("between")
    if len(between) != 2:
        raise InputError(f"{section.where}: between names {len(between)} sides, expected two")
    at, direction = (section.numbers(key, unit, None, length=3) for key, unit in (("at", "m"), ("direction", "1")))
    joint = _joint(section, name) if section.has("joint") else None
    identify = _identify(section.section("identify")) if section.has("identify") else None
    if joint is not None and identify is not None:
        raise InputError(f"{section.where}: both joint and identify, expected one of joint, identify or rigid")
    rigid = section.flag("rigid")
    holds = section.words("holds", None)
    section.done()
    sides = between[0], between[1]
    place = None if at is None else (at[0], at[1], at[2])
    along = None if direction is None else (direction[0], direction[1], direction[2])
    if holds is not None and not (rigid and place is not None and along is None):
        raise InputError(
            f"{section.where}: holds is given, expected rigid = true and at beside it, without a direction"
        )
    try:
        if rigid and place is not None and along is None:
            return flange(name, sides, place, DIRECTIONS if holds is None else holds)
        return (Connection(name, sides, joint, rigid, identify, place, along),)
    except InputError as error:
        raise InputError(_placed(section, error)) from None


def _joint(section: Section, name: str) -> Joint:
    value = section.take("joint")
    if isinstance(value, dict):
        inline = Section(value, f"{section.where}: joint", section.folder)
        return joint_from(inline, inline.text("name", name))
    if not isinstance(value, str):
        raise InputError(f"{section.where}: joint is {value!r}, expected a file name or a table {{ law = [...] }}")
    path = section.folder / value
    if not path.is_file():
        raise InputError(f"{section.where}: joint refers to {path}, which does not exist")
    return read_joint(path)


def _identify(section: Section) -> Identify:
    records = section.words("from")
    if not records:
        raise InputError(f"{section.where}: from is empty, expected at least one measurement file")
    start = section.path("start", None)
    section.done()
    return Identify(tuple(section.folder / record for record in records), start)


def _laid_over(section: Section) -> Path:
    """The measurement of one ``[[compare]]``."""
    path = section.path("measurement")
    section.done()
    return path


def _cutting(section: Section) -> dict[str, Any]:
    for key, reason in _NOT_COVERED.items():
        if section.has(key):
            raise InputError(
                f"{section.where}: {key} is not covered, {reason}; leave it out to get the lobes without it"
            )
    fields: dict[str, Any] = {"process": section.text("process")}
    if section.has("teeth"):
        fields["teeth"] = section.integer("teeth", lower=1)
    if section.has("mode"):
        fields["mode"] = section.text("mode")
    for key, unit in CUTTING_UNITS.items():
        if section.has(key):
            fields[key] = section.number(key, unit)
    if section.has("speed"):
        fields["speed"] = section.numbers("speed", "rpm", length=2)
    section.done()
    try:
        Cutting(**fields)
    except InputError as error:
        text = str(error).removeprefix("[cutting]: ")
        raise InputError(f"{section.where}: {text}") from None
    return fields


def _placed(section: Section, error: InputError) -> str:
    """The message with its place in the file, once."""
    text = str(error)
    return text if text.startswith(section.where) else f"{section.where}: {text.partition(': ')[2] or text}"
