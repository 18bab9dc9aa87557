"""The tools of a machine file beside each other: what each of them cuts, by the same function as the one in use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import Progress
from jointlib.shown.text import table

from ..cutting.amplitude.pocket import Pocket, limit_of, pocket, told_depth
from ..cutting.process.chart import StabilityLobes
from ..cutting.process.cutting import Cutting
from ..files.machine_file import read_machine
from ..files.named_tools import USE
from ..model.machine import Machine
from .open_joints import with_joints

_NONE = "–"


@dataclass(frozen=True, eq=False)
class ToolLobes:
    """What one of several tools cuts: its chart for small vibrations, or why there is none."""

    name: str
    chart: StabilityLobes | None
    pocket: Pocket | None = None
    """Speed and depth that are recommended, where the chart is over a range."""
    failed: str = ""

    @classmethod
    def of(cls, name: str, machine: Machine, chart: StabilityLobes, amplitude: float, over_range: bool) -> ToolLobes:
        """A chart at an amplitude (m) with the pocket that it holds."""
        cutting = Cutting(**(machine.cutting or {}))
        found = None
        if over_range:
            found = pocket([chart], cutting, limit_of(machine, [amplitude], chart.method))
        return cls(name, chart, found)

    def as_json(self) -> dict[str, Any]:
        """``tool``, ``minimum_depth`` (m), ``minimum_frequency`` (Hz), ``pocket``, ``speed``, ``depth`` …"""
        found, best = self.chart, self.pocket
        return {
            "tool": self.name,
            "minimum_depth": None if found is None else found.minimum_depth,
            "minimum_frequency": None if found is None else found.minimum_frequency,
            "pocket": None if best is None else {"speed": best.speed, "depth": best.depth, "margin": best.margin},
            "speed": None if found is None else found.speed,
            "depth": None if found is None else found.depth,
            "warnings": [] if found is None else list(found.warnings),
            "failed": self.failed or None,
        }


def each_tool(
    used: Machine,
    path: Path,
    names: Sequence[str],
    chart_of: Callable[[Machine], StabilityLobes],
    known: StabilityLobes,
    over_range: bool,
    during: Progress,
    told: Callable[[ToolLobes], None] = lambda tool: None,
    amplitude: float = 0.0,
) -> tuple[ToolLobes, ...]:
    """Every tool of a machine file, ``told`` when it is there; that in use, whose machine and chart are ``known``, is
    not computed again. The charts are at an ``amplitude`` of the tool in m.
    """
    found = list[ToolLobes]()
    for name in names:
        if name == used.tool_name:
            found.append(ToolLobes.of(name, used, known, amplitude, over_range))
        else:
            with during.step(f"stability lobes of the tool {name}"):
                found.append(_other(name, used, path, chart_of, amplitude, over_range))
        told(found[-1])
    return tuple(found)


def _other(
    name: str,
    used: Machine,
    path: Path,
    chart_of: Callable[[Machine], StabilityLobes],
    amplitude: float,
    over_range: bool,
) -> ToolLobes:
    """A tool that is not in use."""
    try:
        machine = _with_joints_of(used, read_machine(path, {USE: name}))
        return ToolLobes.of(name, machine, chart_of(machine), amplitude, over_range)
    except (CheckFailed, InputError) as refused:
        return ToolLobes(name, None, failed=str(refused))


def _with_joints_of(used: Machine, machine: Machine) -> Machine:
    """Joints that records tell are those of the machine in use; what belongs to this tool alone is identified."""
    joints = {c.name: c.joint for c in used.connections}
    for connection in machine.connections:
        joint = joints.get(connection.name)
        if connection.identify is not None and joint is not None:
            machine = machine.with_joint(connection.name, joint)
    return with_joints(machine)[0]


HEADER = ("tool", "stable below [mm]", "chatter [Hz]")
RECOMMENDED = ("recommended [rpm]", "depth [mm]")


def rows_of(found: Sequence[ToolLobes], speeds: Array | None = None) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of a table: what is recommended with each tool, or its depths at given speeds (rpm)."""
    more = RECOMMENDED if speeds is None else tuple(f"at {n:g} rpm [mm]" for n in speeds)
    return (*HEADER, *more), [_cells(tool, speeds) for tool in found]


def _cells(tool: ToolLobes, speeds: Array | None) -> tuple[str, ...]:
    """A row of the table."""
    if tool.chart is None:
        return (tool.name, *[_NONE] * (2 + (2 if speeds is None else len(speeds))))
    best, least = tool.pocket, tool.chart.minimum_depth
    here = (tool.name, _mm(least), f"{tool.chart.minimum_frequency:.5g}" if np.isfinite(least) else _NONE)
    if speeds is not None:
        return (*here, *(_mm(depth) for depth in tool.chart.depth))
    return (*here, *((_NONE, _NONE) if best is None else (f"{best.speed:.0f}", told_depth(best.depth).split()[0])))


def header_of(names: Sequence[str], speeds: Array | None = None) -> str:
    """The first line of a table of tools whose rows come one by one, as wide as their ``names`` ask for."""
    header, _ = rows_of([], speeds)
    return table(header, [(name, *[""] * (len(header) - 1)) for name in names])[0]


def row_of(tool: ToolLobes, names: Sequence[str], speeds: Array | None = None) -> str:
    """A row under `header_of`."""
    header, rows = rows_of([tool], speeds)
    return table(header, [*((name, *[""] * (len(header) - 1)) for name in names), rows[0]])[-1]


def words_of(found: Sequence[ToolLobes], used: str | None, speeds: Array | None = None) -> list[str]:
    """The table of the tools, and what is to be said of those that are not in use."""
    return [*table(*rows_of(found, speeds)), *remarks_of(found, used)]


def remarks_of(found: Sequence[ToolLobes], used: str | None) -> list[str]:
    """Why a tool could not be computed, and what bears on its chart and not on that of the tool in use."""
    said = [f"The tool {tool.name} is not computed: {tool.failed}." for tool in found if tool.failed]
    charts = {tool.name: tool.chart for tool in found if tool.chart is not None}
    known = set(charts[used].warnings) if used in charts else set()
    more = ((name, text) for name, chart in charts.items() for text in chart.warnings if text not in known)
    return [*said, *(f"{name}: {text}" for name, text in more)]


def _mm(depth: float) -> str:
    return f"{depth * 1e3:.5g}" if np.isfinite(depth) else "any depth"
