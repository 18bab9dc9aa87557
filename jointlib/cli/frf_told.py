"""What ``jointlib frf`` says: the peaks of the tool, on request those of the contacts, and both as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jointlib.cli.output import table

if TYPE_CHECKING:
    from machines.response import Response


def tool_lines(results: Sequence[Response], axes: Mapping[str, str]) -> list[str]:
    """A table of the peaks of the tool, or why there is none."""
    from machines.report.tool_peak_table import HEADER, tool_peak_rows
    from machines.tool_peaks import tool_peaks

    rows, left = tool_peak_rows([peak for result in results for peak in tool_peaks(result)], axes)
    if not rows:
        low, high = results[0].frfs[0].frequency[[0, -1]]
        return [f"no peak of the tool between {low:g} and {high:g} Hz"]
    lines = table(HEADER, rows)
    return [*lines, f"and {left} below 1 % of the largest of their direction"] if left else lines


def contact_lines(results: Sequence[Response]) -> list[str]:
    """A table of the refined peaks of every contact, by drive."""
    rows = [
        (
            r.drive,
            f"{p.force:g}",
            p.connection,
            f"{p.amplitude * 1e6:.5g}",
            f"{p.frequency:.6g}",
            p.outcome.name.lower(),
        )
        for r in results
        for p in r.peaks
    ]
    return table(("force on", "force [N]", "connection", "amplitude [µm]", "frequency [Hz]", "outcome"), rows)


def peak_rows(results: Sequence[Response]) -> dict[str, Any]:
    """``peaks`` of the first drive as the contract names them; ``tool_peaks`` of every drive."""
    from machines.tool_peaks import tool_peaks

    peaks = [
        {
            "force": p.force,
            "connection": p.connection,
            "amplitude": p.amplitude,
            "frequency": p.frequency,
            "harmonics": p.harmonics,
            "outcome": p.outcome.name.lower(),
        }
        for p in results[0].peaks
    ]
    return {"peaks": peaks, "tool_peaks": [vars(peak) for result in results for peak in tool_peaks(result)]}
