"""A machine as a program hands it over: read, or the file of one."""

from __future__ import annotations

from pathlib import Path

from jointlib.answers.given import File
from jointlib.errors import InputError
from jointlib.io.toml_file import read_toml

from ..model.machine import Machine
from .machine_file import read_machine
from .named_tools import tools_of


def machine_of(machine: Machine | File, tool: str | None) -> Machine:
    """A machine, or that of a file, which may have several tools by name."""
    if isinstance(machine, Machine):
        if tool is not None:
            raise InputError(f"{machine.where}: tool {tool!r}, expected a machine file with it: this machine has one")
        return machine
    return read_machine(Path(machine), with_tool(tool))


def tool_names(machine: Machine | File, tool: str | None) -> tuple[str, ...]:
    """The tools of a machine file that has several, where none of them is asked for; else none."""
    if isinstance(machine, Machine) or tool is not None:
        return ()
    found = tools_of(read_toml(Path(machine), "machine"))
    return found if len(found) > 1 else ()


def with_tool(tool: str | None) -> dict[str, str]:
    """The changes of a machine file that put a named tool into it."""
    return {} if tool is None else {"tool.use": tool}
