"""Several tools of one machine by name, of which one is in it: the tables of the file for that one."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

from jointlib.errors import nearest
from jointlib.io.toml import Section

from ..model.machine import AXES
from .cutting_table import CUTTING_KEYS

USE = "tool.use"
"""Path of the key that names the tool that is in the machine, for `machines.files.changes.change`."""
_SIDE = re.compile(r"\s-\s")


def choose_tool(documents: Sequence[Section]) -> None:
    """Make of a file with ``[tool.long]``, ``[tool.short]`` … that of one of them; one with a plain ``[tool]`` stays.

    ``use`` in ``[tool]`` names it, by default the first. The ``components`` that other tools list are taken out, with
    every connection, bundle and static force that they take part in, and the ``cutting`` of the tool goes over that of
    the machine. What is wrong with the table of a tool, of whichever, is told and left out.
    """
    document = documents[-1]
    table = document.raw().get("tool")
    if not isinstance(table, dict):
        return
    tools = {name: one for name, one in table.items() if isinstance(one, dict)}
    asked = document.within(dict(table), "[tool]")
    if not tools:
        if "use" in table:
            asked.fault(f"use is {table['use']!r}, but no tool has a name, expected tables like [tool.long]")
            table.pop("use")
        return
    for key in [key for key in table if key not in tools and key != "use"]:
        asked.fault(f"{key} stands beside named tools, expected it in [tool.{next(iter(tools))}]", sure=True)
    use = asked.text("use", next(iter(tools)), tuple(tools))
    known = [str(part.get("name")) for part in _of_all(documents, "component")]
    sound = {name: dict(_sound(document.within(dict(one), f"[tool.{name}]"), known)) for name, one in tools.items()}
    gone = {part for name, one in sound.items() if name != use for part in one.get("components", ())}
    gone -= set(sound[use].get("components", ()))
    for each in documents:
        _without(each, gone)
    document.raw()["tool"] = {"name": use, **{axis: sound[use][axis] for axis in AXES if axis in sound[use]}}
    cutting, shared = sound[use].get("cutting", {}), document.raw().get("cutting", {})
    if cutting and isinstance(shared, dict):
        document.raw()["cutting"] = {**shared, **cutting}
    if document.mistakes is not None:
        here, there = f"{document.where}: [tool]", f"{document.where}: [tool.{use}]"
        document.mistakes.places |= {f"{here}: {axis}:": f"{there}: {axis}:" for axis in AXES}
        shared_at = f"{document.where}: [cutting]"
        document.mistakes.places |= {f"{shared_at}: {key}": f"{there}: [cutting]: {key}" for key in cutting}


def tools_of(document: Section) -> tuple[str, ...]:
    """Names of the tools of a machine file that was opened but not read; none where it has a plain ``[tool]``."""
    table = document.raw().get("tool")
    return tuple(name for name, one in table.items() if isinstance(one, dict)) if isinstance(table, dict) else ()


def _sound(section: Section, known: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Keys and values of one tool, those left out with which something is wrong, which is told."""
    for axis in AXES:
        dof = section.text(axis, None)
        if dof is not None and isinstance(section.table[axis], str):
            for name in (side.strip().partition(".")[0] for side in _SIDE.split(dof)):
                if name not in known:
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
        own = section.within(dict(cutting), "[cutting]")
        here = {key: own.take(key) for key in CUTTING_KEYS if own.has(key)}
        own.done()
        yield "cutting", here
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
