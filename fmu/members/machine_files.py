"""A joint or a machine as a program hands it over: read, or its file."""

from __future__ import annotations

import os
from pathlib import Path

from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.io.toml_file import schema_of
from jointlib.joint import Joint
from machines.files.opened import machine_of
from machines.model.machine import Machine
from machines.road.open_joints import with_joints

from ..system.system import System


def model_of(
    model: Joint | Machine | System | Path | str, tool: str | None
) -> tuple[Joint | Machine | System, tuple[str, ...]]:
    """What the schema of a file says it is, and what is to be said of it.

    A machine has its joints identified; anything that is no machine is read as a joint, and refused as one.
    """
    if isinstance(model, Machine) or (isinstance(model, str | os.PathLike) and _schema(Path(model)) == _MACHINE):
        return whole_machine(model if isinstance(model, Machine) else Path(model), tool)
    if tool is not None:
        raise InputError(f"--tool: {model} is no machine, expected a machine with several tools")
    return (read_joint(Path(model)) if isinstance(model, str | os.PathLike) else model), ()


def whole_machine(machine: Machine | Path | str, tool: str | None) -> tuple[Machine, tuple[str, ...]]:
    """A machine as it is, or that of a file with its joints identified, and what is to be said of them."""
    if isinstance(machine, Machine):
        return machine_of(machine, tool), ()
    return with_joints(machine_of(machine, tool))


_MACHINE = "jointlib/machine/1"


def _schema(path: Path) -> object:
    return schema_of(path)
