"""What ``jointlib frf`` says: the peaks of the tool, on request those of the contacts, and both as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from jointlib.shown.text import table

if TYPE_CHECKING:
    from ...compare.comparison import Comparison
    from ...forced_response.response import Response


def tool_lines(results: Sequence[Response], axes: Mapping[str, str]) -> list[str]:
    """A table of the peaks of the tool, or why there is none."""
    from ...forced_response.tool_peaks import tool_peaks
    from ...report.tool_peak_table import HEADER, tool_peak_rows

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
            f"{p.amplitude * 1e6:.5g}" + (" µrad" if p.connection in r.turned else ""),
            f"{p.frequency:.6g}",
            p.stability.value,
            p.outcome.name.lower(),
        )
        for r in results
        for p in r.peaks
    ]
    header = ("force on", "force [N]", "connection", "amplitude [µm]", "frequency [Hz]", "stability", "outcome")
    return table(header, rows)


def measured_lines(laid: Sequence[Comparison], data: Mapping[str, Any]) -> list[str]:
    """A sentence for each record, what it does to the depth of cut, and the resonances as a table."""
    if not laid:
        return []
    from ...report.comparison_section import HEADER, comparison_rows

    said = [c.sentence() for c in laid] + ([data["depth"]["sentence"]] if data.get("depth") else [])
    said += [f"warning: {warning}" for warning in dict.fromkeys(w for c in laid for w in c.warnings)]
    return [*table(HEADER, comparison_rows(laid)), *said]
