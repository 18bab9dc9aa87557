"""What a file holds, in plain words, with units, and as what it is to programs."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.answers.given import File
from jointlib.cutting_force.cutting_file import read_cutting_file
from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, foreign
from jointlib.io.atomic import given_target
from jointlib.io.joint_file import read_joint
from jointlib.io.measurement_file import read_measurement
from jointlib.io.readers import read_columns
from jointlib.io.toml_file import parsed
from jointlib.shown.pictures import axes_of, literal, name_curves
from jointlib.shown.result import Columns, Shown

from ..files.component_file import read_component
from ..files.machine_file import read_machine
from ..files.opened import tool_names, with_tool
from ..files.tool_alone import read_tool
from ..mistakes import in_file
from ..model.machine import Machine
from ..study.study_file import read_study
from .told.file_lines import (
    WRONG,
    coefficient_lines,
    component_lines,
    finite,
    fmu_lines,
    joint_lines,
    measurement_lines,
    record_lines,
    tool_lines,
)
from .told.machine_told import told
from .told.picture import draw
from .told.study_told import asked_lines

_LONGEST = 50_000_000
"""Bytes of a model description; that of an FMU with ten thousand variables has a tenth."""


@dataclass(frozen=True, eq=False, repr=False)
class Contents(Shown):
    """What a file holds."""

    file: Path
    holds: Any
    """A joint, measurement, component, machine, study, cutting file, columns of a record, an FMU as FMPy reads it."""
    lines: tuple[str, ...]
    """What ``jointlib inspect`` prints."""
    warnings: tuple[str, ...]
    """Of a machine, test cuts and cutting forces: what looks wrong in it."""
    picture: Path | None

    def finding(self) -> str:
        """The first line that is no warning, and what looks wrong."""
        first = next(line for line in self.lines if not line.startswith(WRONG))
        more = f" (and {len(self.warnings) - 1} more)" if len(self.warnings) > 1 else ""
        return f"{first}; looks wrong: {self.warnings[0]}{more}" if self.warnings else first

    def columns(self) -> Columns:
        """The table of what it holds, a row per column of a record, else the lines that are told."""
        if isinstance(self.holds, Shown):
            return self.holds.columns()
        if isinstance(self.holds, dict):
            columns = self.holds
            return {
                "column": (list(columns), ""),
                "samples": ([len(values) for values in columns.values()], ""),
                "lowest": ([np.min(finite(values), initial=np.inf) for values in columns.values()], ""),
                "highest": ([np.max(finite(values), initial=-np.inf) for values in columns.values()], ""),
            }
        return {"line": (self.lines, "")}

    def plot(self, ax: Any = None) -> Any:
        """What it holds, as that draws itself; the columns of a record over their samples."""
        if isinstance(self.holds, Shown):
            return self.holds.plot(ax)
        if not isinstance(self.holds, dict):
            raise InputError(f"{self.file}: has no picture, expected a machine, a joint, a measurement or a record")
        axes = axes_of(ax)
        for name, values in self.holds.items():
            axes.plot(values, label=literal(name))
        axes.set(xlabel="sample", ylabel="value as it stands in the file")
        name_curves(axes)
        return axes

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib inspect --json`` prints."""
        drawn = {} if self.picture is None else {"picture": str(self.picture)}
        return {"file": str(self.file), **drawn, "lines": self.lines, "warnings": self.warnings}


def inspect(
    file: File, *, output: File | None = None, mode: int | None = None, contacts: bool = False, tool: str | None = None
) -> Contents:
    """Say what a file holds: ``jointlib inspect``.

    Parameters
    ----------
    file
        A measurement, joint, component, tool, holder, machine, study, a record (text, npz, uff, tdms …), or an FMU.
    output
        Of a machine: the drawing to write, .svg, or .html in which it turns and its modes move.
    mode
        Of a machine: draw this mode, from 1 on in ascending frequency.
    contacts
        Of a machine: tell every connection on a line of its own.
    tool
        Of a machine: which of several named tools is in it.
    """
    file, target = Path(file), given_target(output, ".svg", ".html")
    if not file.is_file():
        raise InputError(f"{file}: a folder, expected a file" if file.is_dir() else f"{file}: no such file")
    if mode is not None and target is None:
        raise InputError("--mode: expected -o FILE.svg or FILE.html as well, the picture that shows it")
    holds, lines, warnings = _opened(file, contacts, tool)
    if target is not None:
        lines = [*lines, *draw(file, target, mode, with_tool(tool))]
    return Contents(file, holds, tuple(lines), tuple(warnings), target)


def _opened(file: Path, contacts: bool, tool: str | None) -> tuple[Any, list[str], Sequence[str]]:
    """What a file holds, in words, and of a machine the sentences on what looks wrong in it."""
    schema = _schema(file) if file.suffix == ".toml" else file.suffix
    if schema == "jointlib/machine/1":
        machine = read_machine(file, with_tool(tool), every_tool=tool is None)
        return machine, *told(machine, contacts, [] if tool is not None else _of_other_tools(file, machine))
    if tool is not None:
        raise InputError(f"--tool: {file} is no machine, expected a machine with several tools")
    if schema == "jointlib/joint/1":
        joint = read_joint(file)
        return joint, joint_lines(joint), ()
    if schema == "jointlib/measurement/1":
        measurement = read_measurement(file)
        lines = measurement_lines(measurement)
        return measurement, lines, [line.removeprefix(WRONG) for line in lines if line.startswith(WRONG)]
    if schema == "jointlib/cutting/1":
        coefficients = read_cutting_file(file)
        return coefficients, coefficient_lines(coefficients), ()
    if schema == "jointlib/component/1":
        component = read_component(file, "component")
        return component, component_lines(component), ()
    if schema in ("jointlib/tool/1", "jointlib/holder/1"):
        parts, joins = read_tool(file, schema.split("/")[1])
        return parts, tool_lines(parts, joins), ()
    if schema == "jointlib/study/1":
        study = read_study(file)
        return study, asked_lines(study), ()
    if schema == ".fmu":
        description = _description(file)
        return description, fmu_lines(file, description), ()
    columns = read_columns(file)
    return columns, record_lines(columns), ()


def _of_other_tools(file: Path, machine: Machine) -> list[str]:
    """What looks wrong with the machine where one of the tools is in it that are not in use."""
    said = set(in_file(machine))
    further = []
    for name in tool_names(file, None):
        new = [] if name == machine.tool_name else in_file(read_machine(file, with_tool(name)))
        further += [f"with tool {name!r}: {sentence}" for sentence in new if sentence not in said]
        said |= set(new)
    return further


def _schema(file: Path) -> str:
    schema = parsed(file, "a file of this program")[1].get("schema")
    known = [
        f"jointlib/{kind}/1"
        for kind in ("joint", "measurement", "component", "machine", "study", "cutting", "tool", "holder")
    ]
    if not isinstance(schema, str) or schema not in known:
        raise InputError(f"{file}: schema is {schema!r}, expected one of {', '.join(known)}")
    return schema


def _description(file: Path) -> Any:
    from fmpy import read_model_description

    data = bytes_of(file, "an FMU")

    def read() -> Any:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            about = archive.getinfo("modelDescription.xml")
            if about.file_size > _LONGEST or b"<!DOCTYPE" in archive.read(about).replace(b"\0", b""):
                raise ValueError("its description is too long, or defines a document type of its own")
        return read_model_description(str(file))

    return foreign(file, "an FMU", read)
