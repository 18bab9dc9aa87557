"""Several tools of one machine by name, of which one is in it: the tables of the file for that one."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section

USE = "tool.use"
"""Path of the key that names the tool that is in the machine, for `machines.changes.change`."""


def choose_tool(documents: Sequence[Section]) -> None:
    """Make of a file with ``[tool.long]``, ``[tool.short]`` … that of one of them; one with a plain ``[tool]`` stays.

    ``use`` in ``[tool]`` names it, by default the first. The ``components`` that other tools list are taken out, with
    every connection, bundle and static force that they take part in, and the ``cutting`` of the tool goes over that of
    the machine.
    """
    document = documents[-1]
    table = document.raw().get("tool")
    if not isinstance(table, dict):
        return
    tools = {name: one for name, one in table.items() if isinstance(one, dict)}
    where = f"{document.where}: [tool]"
    if not tools:
        if "use" in table:
            raise InputError(
                f"{where}: use is {table['use']!r}, but no tool has a name, expected tables like [tool.long]"
            )
        return
    beside = [key for key in table if key not in tools and key != "use"]
    if beside:
        raise InputError(f"{where}: {beside[0]} stands beside named tools, expected it in [tool.{next(iter(tools))}]")
    use = Section(dict(table), where, document.folder).text("use", next(iter(tools)), tuple(tools))
    known = [str(part.get("name")) for each in documents for part in each.raw().get("component", [])]
    for name, one in tools.items():
        if not isinstance(one.get("cutting", {}), dict):
            raise InputError(f"{where}.{name}: cutting is {one['cutting']!r}, expected a table with keys of [cutting]")
    own = {name: _components(Section(one, f"{where}.{name}", document.folder), known) for name, one in tools.items()}
    gone = {part for name, parts in own.items() if name != use for part in parts} - set(own[use])
    for each in documents:
        _without(each.raw(), gone)
    kept = {key: value for key, value in tools[use].items() if key not in ("components", "cutting")}
    document.raw()["tool"] = {"name": use, **kept}
    if cutting := tools[use].get("cutting", {}):
        document.raw()["cutting"] = {**document.raw().get("cutting", {}), **cutting}


def _components(section: Section, known: Sequence[str]) -> tuple[str, ...]:
    names = section.words("components", ()) or ()
    for name in names:
        if name not in known:
            raise InputError(f"{section.where}: components names {name!r}, {nearest(name, known)}")
    return tuple(names)


def _without(tables: dict[str, Any], gone: Collection[str]) -> None:
    """Tables without these components and what they take part in."""
    if not gone:
        return
    if "component" in tables:
        tables["component"] = [one for one in tables["component"] if one.get("name") not in gone]
    lost: set[str] = set()
    for kind in ("connection", "bundle"):
        if kind in tables:
            kept = [one for one in tables[kind] if not _takes_part(one, gone)]
            lost |= {str(one.get("name")) for one in tables[kind] if one not in kept}
            tables[kind] = kept
    static = tables.get("static")
    if isinstance(static, dict):
        for key in ("force", "offset"):
            if isinstance(static.get(key), dict):
                static[key] = {
                    name: value
                    for name, value in static[key].items()
                    if name.partition(".")[0] not in (gone if key == "force" else lost)
                }


def _takes_part(table: dict[str, Any], gone: Collection[str]) -> bool:
    sides = table.get("between")
    return isinstance(sides, list) and any(str(side).partition(".")[0] in gone for side in sides)
