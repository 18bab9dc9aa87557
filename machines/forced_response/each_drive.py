"""The response along each direction of the tool, and its peaks for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from jointlib.shown.progress import Named, Progress, Silent

from ..tool.chatter_band import chatter_band, frequency_range
from .methods import Newton
from .response import Response, response
from .tool_peaks import tool_peaks


def responses(
    machine: Any,
    drive: str | None,
    force: Any = None,
    band: Any = None,
    progress: Progress | None = None,
    **keywords: Any,
) -> Iterator[Any]:
    """The response to a force on ``drive`` or, where neither that nor the file names one, along each tool axis.

    They come one after the other, so that the first is kept where the second takes too long.
    """
    drives = drives_of(machine, drive)
    axes, told = {dof: axis for axis, dof in machine.tool.items()}, progress or Silent()
    for k, name in enumerate(drives, start=1):
        own = Named(told, f"{axes.get(name, name)}, {k} of {len(drives)}") if len(drives) > 1 else told
        yield response(machine, force, band, name, progress=own, **keywords)


def on_lines(machine: Any, drive: str | None) -> Any:
    """The response where the search for peaks and jumps takes too long: on lines that every mode of the tool leaves a
    trace on, each from rest."""
    low, high = frequency_range(machine)
    lines = chatter_band(machine).lines
    inside = lines[(lines > low) & (lines < high)]
    return response(machine, None, np.concatenate([[low], inside, [high]]), drive, Newton())


def drives_of(machine: Any, drive: str | None) -> list[Any]:
    """What is driven: ``drive`` or that of the file, which may be None for the tool, else every axis of the tool."""
    free = drive is None and machine.drive is None
    return list(dict.fromkeys(machine.tool.values())) if free and machine.tool else [drive]


def peak_rows(results: Sequence[Response]) -> dict[str, Any]:
    """``peaks`` of the first drive as the contract names them; ``tool_peaks`` of every drive."""
    peaks = [
        {
            "force": p.force,
            "connection": p.connection,
            "amplitude": p.amplitude,
            "frequency": p.frequency,
            "harmonics": p.harmonics,
            "stability": p.stability.value,
            "outcome": p.outcome.name.lower(),
        }
        for p in results[0].peaks
    ]
    return {"peaks": peaks, "tool_peaks": [vars(peak) for result in results for peak in tool_peaks(result)]}
