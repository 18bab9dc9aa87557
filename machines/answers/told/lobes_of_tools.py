"""What ``jointlib lobes`` says of every tool of a machine file, row by row as they are there."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from jointlib.arrays import Array
from jointlib.shown.progress import Progress

from ...cutting.amplitude.charts_by_amplitude import charts_by_amplitude
from ...cutting.process.chart import StabilityLobes
from ...cutting.rest.chart_file import default_speeds
from ...model.machine import Machine
from ...road.each_tool import ToolLobes, each_tool, header_of, remarks_of, row_of


@dataclass(frozen=True, eq=False)
class Asked:
    """What was asked of a machine whose file has several tools; ``used`` is the one in use."""

    used: Machine
    path: Path | None
    names: Sequence[str]
    method: str | None
    speeds: Array | None
    """rpm; none are those over the range of each tool."""
    ends: float
    """When the charts over a range must be there, by `time.monotonic`."""

    def chart(self, machine: Machine, amplitude: float, left: int) -> StabilityLobes:
        """Of a tool that is not in use at an amplitude (m), where so many charts share the time that is left."""
        share = None if self.speeds is not None else max(0.0, self.ends - time.monotonic()) / left
        speeds = default_speeds(machine) if self.speeds is None else self.speeds
        return charts_by_amplitude(machine, speeds, (amplitude,), self.method, share)[0]


def charts_of_tools(
    asked: Asked,
    charts: Sequence[tuple[float, StabilityLobes]],
    during: Progress,
    lines: list[str],
    tell: Callable[[Sequence[str]], None],
) -> list[tuple[ToolLobes, ...]]:
    """All tools of a file with several, by amplitude (m), the one in use first, whose ``charts`` are known.

    Rows of a table for each amplitude are put to the ``lines`` and told when they are there. Nothing where the file has
    one tool or one was asked for.
    """
    if asked.path is None or not asked.names:
        return [()] * len(charts)
    used = asked.used.tool_name
    names = sorted(asked.names, key=lambda name: name != used)
    wanted = [(A, name) for A, _ in charts for name in names if name != used]
    found = []
    for A, known in charts:

        def chart_of(machine: Machine, A: float = A) -> StabilityLobes:
            left = len(wanted) - wanted.index((A, machine.tool_name or ""))
            return asked.chart(machine, A, left)

        def told(tool: ToolLobes) -> None:
            lines.append(row_of(tool, names, asked.speeds))
            tell(lines)

        lines.extend([f"at a tool-point amplitude of {A * 1e6:g} um:"] if A else [])
        lines.append(header_of(names, asked.speeds))
        over_range = asked.speeds is None
        found.append(each_tool(asked.used, asked.path, names, chart_of, known, over_range, during, told, A))
        lines.extend(remarks_of(found[-1], used))
    tell(lines)
    return found
