"""Controls that choose: which of several tools is in the machine, and the holder behind its shank."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from jointlib.io.toml_file import parsed, read_toml

from ..files.named_tools import USE, tools_of
from ..model.machine import Machine
from .controls import Control

HOLDER = "tool.holder"
_FILE = ".holder.toml"


def tool_controls(machine: Machine, changes: Mapping[str, Any]) -> Iterator[Control]:
    """The tools of the file by name, unless one was asked for, and the holder files beside that of the tool."""
    assert machine.source is not None
    document = read_toml(machine.source, "machine")
    names = tools_of(document)
    if len(names) > 1 and USE not in changes and machine.tool_name in names:
        yield _choice(USE, "cutter", tuple((name, name) for name in names), machine.tool_name)
    table = document.raw().get("tool")
    own = table.get(machine.tool_name, table) if isinstance(table, dict) else None
    holder = _holder_of(own, machine.source.parent) if isinstance(own, dict) else None
    if holder is None:
        return
    beside = sorted(holder.parent.glob(f"*{_FILE}"))
    if len(beside) > 1 and holder in beside:
        found = tuple((file.name.removesuffix(_FILE), _seen(file, machine.source.parent)) for file in beside)
        yield _choice(HOLDER, "holder", found, _seen(holder, machine.source.parent))


def _choice(key: str, label: str, choices: tuple[tuple[str, str], ...], value: str | None) -> Control:
    number = 1.0 + [stands for _, stands in choices].index(str(value))
    return Control(key, label, "tool", "", number, 1.0, float(len(choices)), whole=True, choices=choices)


def _holder_of(table: Mapping[str, Any], folder: Path) -> Path | None:
    """The holder file of a tool by its table in the machine, or by its own file."""
    told, file = table.get("holder"), table.get("file")
    if isinstance(told, str):
        return folder / told
    if not isinstance(file, str):
        return None
    tool = folder / file
    holder: Any = parsed(tool)[1].get("holder")
    return tool.parent / holder if isinstance(holder, str) else None


def _seen(file: Path, folder: Path) -> str:
    """A file as a machine file there names it."""
    return Path(os.path.relpath(file, folder)).as_posix()
