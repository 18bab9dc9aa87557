"""Machine files: ``schema = "jointlib/machine/1"``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

from jointlib.errors import InputError
from jointlib.io.joint_file import joint_from, read_joint
from jointlib.io.likeness import Doubtful
from jointlib.io.mistakes import Lost, Mistakes, all_at_once
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.registry import names, plugin

from ..bundles.bundle import placed
from ..components.component import Component
from ..components.connection import Connection, Identify, units_between
from ..components.flange import flange
from ..components.nodes import DIRECTIONS
from ..components.static_load import StaticLoad
from ..cutting.process.cutting import Cutting
from ..forced_response.consistency import check_sound
from ..model.axes import move, read_axes
from ..model.machine import Machine
from ..model.spindle_speed import at_speed
from ..shapes.outline import Outline, take_outlines
from .changes import change
from .component_file import names_a_file, names_files, of_file, of_files
from .conditions import conditions_of, under
from .cutting_table import cutting_of, laid_over, response_of, tool_of, with_flutes
from .named_tools import USE, choose_tool, in_use, name_tools, tools_of
from .tool_file import within_tool
from .unread import Unread

T = TypeVar("T")

_PART = ("component", "connection", "bundle", "axis")
_OWN = ("name", "author", "parts", "conditions", "static", "tool", "tools", "spindle", "response", "cutting")


def read_machine(path: Path | str, changes: Mapping[str, Any] | None = None, every_tool: bool = False) -> Machine:
    """The machine in a file; joint files it names are read, records to identify from are only noted.

    ``changes`` puts values in the place of those in the file, by path: ``{"cutting.immersion": 0.3}``, see
    `machines.files.changes.change`. With ``every_tool`` a file is refused for a fault in a tool that is not in use too.
    """
    path, given = Path(path), dict(changes or {})
    return all_at_once(
        lambda mistakes: _machine(path, changes, mistakes),
        changes,
        lambda: [partial(_machine, path, {**given, USE: name}) for name in _tools(path)],
        every_tool,
    )


def _tools(path: Path) -> tuple[str, ...]:
    """Names of the tools in a file that something may be wrong with."""
    mistakes = Mistakes(0)
    opened = mistakes.attempt(lambda: read_toml(path, "machine", mistakes))
    return () if opened is None else tools_of(opened)


def _machine(path: Path, changes: Mapping[str, Any] | None, mistakes: Mistakes) -> Machine:
    all_of = documents(path, changes, mistakes)
    outlines = _outlines(all_of, mistakes)
    axes, astray = read_axes(all_of), None
    try:
        if not mistakes.sentences:
            move(all_of, axes)
    except InputError as error:
        astray = error  # told if nothing else is wrong: it may come from what is refused below
        all_of = documents(path, changes, mistakes)
        _outlines(all_of, mistakes)
        read_axes(all_of)
    document = all_of[-1]
    name = document.text("name", path.name.removesuffix(".toml").removesuffix(".machine"))
    author = document.text("author", "")
    components, parts = _each(all_of, "component", component_of)
    connections, joins = _each(all_of, "connection", connection_of)
    bundles, groups = _each(all_of, "bundle", placed)
    for part in all_of[:-1]:
        part.done()
    # What was made with stand-ins is looked at too: other tables may refer to it rightly or wrongly.
    known = [each for each in parts if each.likeness is not None and _named(each.likeness, mistakes)]
    components += [each.likeness for each in known if each.likeness is not None]
    connections += [each.likeness for each in joins if each.likeness is not None]
    joined = [*(each.table for each in joins), *(each.table for each in groups)]
    unread = Unread([each.table for each in parts if each not in known], joined)
    static, _ = document.section("static").likeness(StaticLoad.from_section) if document.has("static") else (None, True)
    tool, _ = document.section("tool").likeness(tool_of)
    response, _ = document.section("response").likeness(response_of)
    cutting = document.section("cutting").read(cutting_of) if document.has("cutting") else None
    compare, _ = document.each("compare", laid_over)
    cuts, _ = document.each("cuts", laid_over)
    conditions = document.section("conditions").read(conditions_of) if document.has("conditions") else None
    document.done()
    if astray is not None:
        if not mistakes.sentences:
            raise astray
        raise Lost
    if mistakes.sentences:  # else records may come later
        for file in (file for c in chain(*connections) if c.identify is not None for file in c.identify.records):
            if not file.is_file():
                mistakes.note(f"{file}: no such file, expected a measurement file")
    if mistakes.unopened:
        raise Lost
    drive, force, frequency, speed = response or (None, (), None, 0.0)
    axes_of_tool, tool_name, tool_table = tool or ({}, None, "[tool]")
    if not components:
        raise Lost if parts else InputError(f"{path}: no component, expected at least one")
    every = [*chain(*connections), *chain(*(bundle.connections for bundle in bundles))]
    machine = Machine(
        components=tuple(components),
        connections=tuple(c for c in every if not unread.among(c.between)),
        name=name,
        tool={axis: dof for axis, dof in axes_of_tool.items() if not unread.among([dof])},
        tool_name=tool_name,
        tool_table=tool_table,
        drive=None if drive is None or unread.among([drive]) else drive,
        force=force,
        frequency=frequency,
        cutting=None if cutting is None else with_flutes(cutting, components, axes_of_tool.values()),
        static=None if static is None else unread.without(static),
        axes=axes,
        bundles=tuple(bundles),
        compare=tuple(compare),
        cuts=tuple(cuts),
        outlines=outlines,
        source=path,
        author=author,
    )
    machine = at_speed(under(machine, conditions or {}), speed)
    check_sound(machine, whole=not (parts or joins or groups), doubtful=[str(each.table.get("name")) for each in joins])
    return machine


def _outlines(all_of: Sequence[Section], mistakes: Mistakes) -> dict[str, Outline]:
    """The outlines of components, taken out of their tables, those too that something is wrong with."""
    while True:
        try:
            return take_outlines(all_of)
        except InputError as error:
            mistakes.note(*error.sentences)


def _named(component: Component, mistakes: Mistakes) -> bool:
    """Whether its name and those of its dofs are those of the file."""
    names = (component.name, *(dof.partition(".")[0] for dof in component.dofs))
    return not any(mistakes.made_up(name) for name in names)


def _each(all_of: Sequence[Section], key: str, build: Callable[[Section], T]) -> tuple[list[T], list[Doubtful[T]]]:
    """What is made of the tables ``[[key]]`` of all files, and the tables that something is wrong with."""
    found: list[T] = []
    lost: list[Doubtful[T]] = []
    for section in all_of:
        here, not_here = section.each(key, build)
        found += here
        lost += not_here
    return found, lost


def documents(path: Path, changes: Mapping[str, Any] | None = None, mistakes: Mistakes | None = None) -> list[Section]:
    """The tables of a machine file after those of its parts, opened but not read, with changes in them."""
    document = read_toml(path, "machine", mistakes)
    if mistakes is not None:
        document.expect(*_PART, *_OWN, "compare", "cuts")
    own = dict(changes or {})
    change([document], {key: own.pop(key) for key in list(own) if key.startswith("parts")}, str(path))
    parts = [_part(document, file) for file in document.words("parts", ())]
    all_of = [*(part for part in parts if part is not None), document]
    stands = name_tools(document)
    own, filed = in_use(document, own)
    late = [key for key in own if key.startswith("cutting.") or (filed and within_tool(key))]
    # What a tool brings is there when it is in; what it says of the cut goes over the machine's, a change over both.
    after = {key: own.pop(key) for key in late}
    change(all_of, own, str(path))
    held = choose_tool(all_of, stands)
    all_of[-1:-1] = [] if held is None else [held]
    change(all_of, after, str(path))
    return all_of


def cutting_table(path: Path | str, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The ``[cutting]`` table of a machine file, that of its tool over it, for `read_cutting`; empty without one."""
    return {key: table for key, table in documents(Path(path), changes)[-1].raw().items() if key == "cutting"}


def read_cutting(path: Path | str, table: Mapping[str, Any], changes: Mapping[str, Any]) -> Cutting:
    """The cutting operation alone of a machine file, with changes in its ``[cutting]`` table; see `read_machine`."""
    document = Section(deepcopy(dict(table)), str(path), Path(path).parent)
    change([document], changes, str(path))
    return Cutting(**cutting_of(document.section("cutting")))


def _part(document: Section, file: str) -> Section | None:
    """A file of components, connections and bundles that several machines share."""
    path = document.folder / file
    if not path.is_file():
        document.fault(f"parts refers to {path}, which does not exist")
    mistakes = document.mistakes
    if mistakes is None:
        return read_toml(path, "parts")
    part = mistakes.attempt(lambda: read_toml(path, "parts", mistakes)) if path.is_file() else None
    mistakes.unopened |= part is None
    if part is not None:
        part.expect(*_PART)
    return part


def component_of(section: Section) -> Component:
    """What a ``[[component]]`` says."""
    if names_a_file(section):
        return component_of(of_file(section))
    if names_files(section):
        return of_files(section, component_of)
    cls: type[Component] = section.kind(
        lambda word, where: plugin("jointlib.components", word, where), names("jointlib.components")
    )
    try:
        component = cls.from_section(section)
    except InputError as error:
        raise InputError(*(_placed(section, said) for said in error.sentences)) from None
    section.done()
    return component


def connection_of(section: Section) -> tuple[Connection, ...]:
    """One scalar connection, or those of a flange."""
    name = section.text("name")
    between = section.words("between")
    if len(between) != 2:
        section.fault(f"between names {len(between)} sides, expected two")
    at, direction = (section.numbers(key, unit, None, length=3) for key, unit in (("at", "m"), ("direction", "1")))
    held = section.take("joint", None)
    table = section.section("identify") if section.has("identify") else None
    if held is not None and table is not None:
        section.fault("both joint and identify, expected one of joint, identify or rigid")
    rigid = section.flag("rigid")
    holds = section.words("holds", None)
    section.done()
    joint = None if held is None else _joint_or_like(section, held, name, units_between(between))
    identify = None if table is None else table.read(_identify) or Identify(())
    if len(between) != 2:
        raise Lost
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
        raise InputError(*(_placed(section, said) for said in error.sentences)) from None


def _joint_or_like(section: Section, value: Any, name: str, units: Mapping[str, str]) -> Joint:
    """The joint; one that stands in for it where something is wrong with it."""
    mistakes = section.mistakes
    if mistakes is None:
        return _joint(section, value, name, units)
    joint = mistakes.attempt(lambda: _joint(section, value, name, units))
    return joint or Joint((Linear(mistakes.stand_in((1.0, 2.0))),), name)


def _joint(section: Section, value: Any, name: str, units: Mapping[str, str]) -> Joint:
    if isinstance(value, dict):
        inline = section.within(value, "joint")
        return joint_from(inline, inline.text("name", name), units)
    if not isinstance(value, str):
        raise InputError(f"{section.where}: joint is {value!r}, expected a file name or a table {{ law = [...] }}")
    path = section.folder / value
    if not path.is_file():
        raise InputError(f"{section.where}: joint refers to {path}, which does not exist")
    return read_joint(path)


def _identify(section: Section) -> Identify:
    records = section.words("from")
    if not records:
        section.fault("from is empty, expected at least one measurement file")
    start = section.path("start", None)
    section.done()
    return Identify(tuple(section.folder / record for record in records), start)


def _placed(section: Section, text: str) -> str:
    """The message with its place in the file, once."""
    return text if text.startswith(section.where) else f"{section.where}: {text.partition(': ')[2] or text}"
