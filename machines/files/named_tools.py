"""Several tools of one machine by name, of which one is in it: the tables of the file for that one."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

from jointlib.errors import nearest
from jointlib.io.toml import Section

from ..model.machine import AXES
from .cutting_table import cutting_keys
from .tool_file import CUTTER, FILE_KEYS, HELD, put_in

USE = "tool.use"
"""Path of the key that names the tool that is in the machine, for `machines.files.changes.change`."""
_SIDE = re.compile(r"\s-\s")


def name_tools(document: Section) -> dict[str, str]:
    """Make ``[tool.short]`` … of ``[[tools]]``, and ``[tool] file`` of ``tool = "…"``; where each tool stands by name.

    The empty name is that of a tool without one.
    """
    raw = document.raw()
    stands: dict[str, str] = {}
    if isinstance(raw.get("tool"), str):
        raw["tool"] = {"file": raw["tool"]}
        if document.mistakes is not None:
            document.mistakes.places[f"{document.where}: [tool]: file"] = f"{document.where}: tool"
    if "tools" not in raw:
        return stands
    rows = list(document.sections("tools"))
    table = raw.setdefault("tool", {})
    for section in (row for row in rows if not row.lost):
        name = section.text("name")
        if not isinstance(table, dict):
            break  # refused where it is read
        if name in table or "." in name or not name:
            section.fault(f"name is {name!r}, expected one of its own, without a dot")
            continue
        table[name], stands[name] = section.raw(), section.where
    return stands


def in_use(document: Section, changes: Mapping[str, Any]) -> tuple[dict[str, Any], bool]:
    """The changes with ``tool.stick_out`` as that of the tool in use, and whether a tool file tells that tool."""
    table = document.raw().get("tool")
    if not isinstance(table, dict):
        return dict(changes), False
    names = [name for name, one in table.items() if isinstance(one, dict)]
    if not names:
        return dict(changes), "file" in table or "tool.file" in changes
    use = changes.get(USE, table.get("use", names[0]))
    if use not in names:
        return dict(changes), False
    own = {f"tool.{key}": f"tool.{use}.{key}" for key in FILE_KEYS}
    told = {own.get(path, path): value for path, value in changes.items()}
    return told, "file" in table[use] or f"tool.{use}.file" in told


def choose_tool(documents: Sequence[Section], stands: Mapping[str, str]) -> Section | None:
    """Make of a file with ``[tool.long]``, ``[tool.short]`` … that of one of them; one with a plain ``[tool]`` stays.

    ``use`` in ``[tool]`` names it, by default the first. The ``components`` that other tools list are taken out, with
    every connection, bundle and static force that they take part in, and the ``cutting`` of the tool goes over that of
    the machine. What is wrong with the table of a tool, of whichever, is told and left out. ``stands`` is of
    `name_tools`. The parts of the tool file that the tool names, if it does.
    """
    document = documents[-1]
    table = document.raw().get("tool")
    if not isinstance(table, dict):
        return None
    tools = {name: one for name, one in table.items() if isinstance(one, dict)}
    asked = document.within(dict(table), "[tool]")
    if not tools:
        if "use" in table:
            asked.fault(f"use is {table['use']!r}, but no tool has a name, expected tables like [tool.long]")
            table.pop("use")
        return put_in(documents, asked.where)
    for key in [key for key in table if key not in tools and key != "use"]:
        asked.fault(f"{key} stands beside named tools, expected it in [tool.{next(iter(tools))}]", sure=True)
    use = asked.text("use", next(iter(tools)), tuple(tools))
    where = {name: stands.get(name, f"{document.where}: [tool.{name}]") for name in tools}
    sound = {name: dict(_sound(_table(document, one, where[name]), documents)) for name, one in tools.items()}
    gone = {part for name, one in sound.items() if name != use for part in one.get("components", ())}
    gone -= set(sound[use].get("components", ()))
    for each in documents:
        _without(each, gone)
    mine, there = sound[use], where[use]
    document.raw()["tool"] = {"name": use, **{key: mine[key] for key in (*AXES, *FILE_KEYS) if key in mine}}
    parts = put_in(documents, there)
    if parts is None and "spindle" in document.raw() and any("file" in one for one in sound.values()):
        document.take("spindle")
    cutting, shared = mine.get("cutting", {}), document.raw().get("cutting", {})
    if cutting and isinstance(shared, dict):
        document.raw()["cutting"] = {**shared, **cutting}
    if document.mistakes is not None:
        here, shared_at = f"{document.where}: [tool]", f"{document.where}: [cutting]"
        document.mistakes.places |= {f"{here}: {axis}:": f"{there}: {axis}:" for axis in AXES}
        document.mistakes.places |= {f"{shared_at}: {key}": f"{there}: [cutting]: {key}" for key in cutting}
        if "process" in cutting and isinstance(shared, dict):  # by which keys of [cutting] are those of another
            its = f"{there}: its process is {cutting['process']!r}, and"
            document.mistakes.places |= {
                f"{shared_at}: {k!r} belongs": f"{its} {k!r} in [cutting] belongs" for k in shared
            }
    return parts


def tools_of(document: Section) -> tuple[str, ...]:
    """Names of the tools of a machine file that was opened but not read; none where it has a plain ``[tool]``."""
    name_tools(document)
    table = document.raw().get("tool")
    return tuple(name for name, one in table.items() if isinstance(one, dict)) if isinstance(table, dict) else ()


def _table(document: Section, table: dict[str, Any], where: str) -> Section:
    """The table of a tool, with the place where it stands."""
    return Section(dict(table), where, document.folder, document.mistakes)


def _sound(section: Section, documents: Sequence[Section]) -> Iterator[tuple[str, Any]]:
    """Keys and values of one tool, those left out with which something is wrong, which is told."""
    known = [str(part.get("name")) for part in _of_all(documents, "component")]
    of_file = [CUTTER, HELD] if section.has("file") else []
    for axis in AXES:
        dof = section.text(axis, None)
        if dof is not None and isinstance(section.table[axis], str):
            for name in (side.strip().partition(".")[0] for side in _SIDE.split(dof)):
                if name not in (*known, *of_file):
                    section.fault(f"{axis} is {dof!r}, but there is no component {name!r}, {nearest(name, known)}")
                    break
            else:
                yield axis, dof
    given = section.table.get("components", [])
    names = section.words("components", ())
    if isinstance(given, list) and list(names) == given:  # else something stands in for it
        for name in names:
            if name not in known:
                section.fault(f"components names {name!r}, {nearest(name, known)}")
        yield "components", [name for name in names if name in known]
    cutting = section.take("cutting", {})
    if not isinstance(cutting, dict):
        section.fault(f"cutting is {cutting!r}, expected a table with keys of [cutting]")
    else:
        yield "cutting", cutting_keys(section.within(dict(cutting), "[cutting]"))
    yield from ((key, section.take(key)) for key in FILE_KEYS if section.has(key))
    section.done()


def _of_all(documents: Sequence[Section], key: str) -> Iterator[dict[str, Any]]:
    """The tables ``[[key]]`` of all files; what is none is refused when the file is read."""
    for document in documents:
        tables = document.raw().get(key, [])
        yield from (one for one in tables if isinstance(one, dict)) if isinstance(tables, list) else ()


def _without(document: Section, gone: Collection[str]) -> None:
    """Take out these components and what they take part in."""
    tables = document.raw()

    def taken_out(key: str, stays: Callable[[dict[str, Any]], bool]) -> Iterator[str]:
        """Names of the tables that do not stay; the others keep the numbers that they have in the file."""
        rows = tables.get(key)
        if not gone or not isinstance(rows, list):
            return
        kept = [i for i, one in enumerate(rows) if not isinstance(one, dict) or stays(one)]
        tables[key], document.counted[key] = [rows[i] for i in kept], [i + 1 for i in kept]
        yield from (str(rows[i].get("name")) for i in range(len(rows)) if i not in kept)

    parts = set(taken_out("component", lambda one: one.get("name") not in gone))
    joins = {name for kind in ("connection", "bundle") for name in taken_out(kind, lambda one: not _holds(one, gone))}
    static = tables.get("static")
    for key, names in (("force", parts), ("offset", joins)):
        if isinstance(static, dict) and isinstance(static.get(key), dict):
            static[key] = {name: value for name, value in static[key].items() if name.partition(".")[0] not in names}


def _holds(table: dict[str, Any], components: Collection[str]) -> bool:
    sides = table.get("between")
    return isinstance(sides, list) and any(str(side).partition(".")[0] in components for side in sides)
