"""What ``jointlib frf`` says: the peaks of the tool, on request those of the contacts, and both as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jointlib.cli.output import table

if TYPE_CHECKING:
    from pathlib import Path

    from machines import Machine
    from machines.compare.comparison import Comparison
    from machines.forced_response.response import Response


def tool_lines(results: Sequence[Response], axes: Mapping[str, str]) -> list[str]:
    """A table of the peaks of the tool, or why there is none."""
    from machines.forced_response.tool_peaks import tool_peaks
    from machines.report.tool_peak_table import HEADER, tool_peak_rows

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
            p.stability.value,
            p.outcome.name.lower(),
        )
        for r in results
        for p in r.peaks
    ]
    header = ("force on", "force [N]", "connection", "amplitude [µm]", "frequency [Hz]", "stability", "outcome")
    return table(header, rows)


def peak_rows(results: Sequence[Response]) -> dict[str, Any]:
    """``peaks`` of the first drive as the contract names them; ``tool_peaks`` of every drive."""
    from machines.forced_response.tool_peaks import tool_peaks

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


def over_measured(machine: Machine, files: Sequence[Path]) -> tuple[list[Comparison], dict[str, Any]]:
    """Measured frequency responses against the machine, and what is told of them as JSON: ``measured``, ``depth``."""
    if not files:
        return [], {}
    import numpy as np

    from machines.compare.comparison import compared, depths

    laid = [comparison for file in files for comparison in compared(machine, file)]
    data: dict[str, Any] = {
        "measured": [
            {
                "record": c.record.name,
                "drive": c.record.drive,
                "output": c.record.response,
                "force": c.record.force,
                "frac": c.frac,
                "resonances": [
                    {
                        "measured": None if pair.measured is None else vars(pair.measured),
                        "predicted": None if pair.predicted is None else vars(pair.predicted),
                        "differences": pair.differences(),
                    }
                    for pair in c.pairs
                ],
                "sentence": c.sentence(),
                "warnings": list(c.warnings),
            }
            for c in laid
        ]
    }
    if machine.cutting is not None and machine.cutting.get("speed") is not None:
        low, high = machine.cutting["speed"]
        found = depths(machine, [c.record for c in laid], np.linspace(low, high, _SPEEDS))
        data["depth"] = None if found is None else vars(found) | {"sentence": found.sentence()}
    return laid, data


_SPEEDS = 40


def measured_lines(laid: Sequence[Comparison], data: Mapping[str, Any]) -> list[str]:
    """A sentence for each record, what it does to the depth of cut, and the resonances as a table."""
    from machines.report.comparison_section import HEADER, comparison_rows

    if not laid:
        return []
    said = [c.sentence() for c in laid] + ([data["depth"]["sentence"]] if data.get("depth") else [])
    said += [f"warning: {warning}" for warning in dict.fromkeys(w for c in laid for w in c.warnings)]
    return [*table(HEADER, comparison_rows(laid)), *said]
