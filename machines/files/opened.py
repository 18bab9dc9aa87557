"""A machine as a program hands it over: read, or the file of one."""

from __future__ import annotations

from pathlib import Path

from jointlib.answers.given import File
from jointlib.errors import InputError

from ..model.machine import Machine
from .machine_file import read_machine


def machine_of(machine: Machine | File, tool: str | None) -> Machine:
    """A machine, or that of a file, which may have several tools by name."""
    if isinstance(machine, Machine):
        if tool is not None:
            raise InputError(f"{machine.where}: tool {tool!r}, expected a machine file with it: this machine has one")
        return machine
    return read_machine(Path(machine), with_tool(tool))


def with_tool(tool: str | None) -> dict[str, str]:
    """The changes of a machine file that put a named tool into it."""
    return {} if tool is None else {"tool.use": tool}
