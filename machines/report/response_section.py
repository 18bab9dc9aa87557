"""The section on the forced response: the peaks of the tool first, the contacts for those who look for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..forced_response.response import Response
from ..forced_response.tool_peaks import tool_peaks
from .figures.response_figures import joints_figure, tool_figure
from .page import Section, Table
from .tool_peak_table import HEADER, tool_peak_rows


def response_section(results: Sequence[Response], axes: Mapping[str, str]) -> Section:
    """Forced response per force level, for one drive or for each direction of the tool."""
    rows, left = tool_peak_rows([peak for result in results for peak in tool_peaks(result)], axes)
    told = "Peaks at the tool; damping from the half-power width, where there is one that tells it"
    told += f"; {left} more are below 1 % of the largest of their direction" if left else ""
    tables = [Table(HEADER, rows, f"{told}.")] if rows else []
    contacts = [
        (f"{p.force:g}", p.connection, f"{p.amplitude * 1e6:.4g}", f"{p.frequency:.5g}", p.outcome.name.lower())
        for p in results[0].peaks
    ]
    if contacts:
        header = ("force [N]", "joint", "amplitude [µm]", "frequency [Hz]", "outcome")
        caption = f"Peaks of the relative motion for a force on {results[0].drive}, refined between the lines"
        count = len(results[0].connections)
        fold = f"Peaks of the {count} joints" if count > 1 else "Peaks of the joint"
        tables.append(Table(header, contacts, caption, fold))
    said = [f"{f:g} N: {o.value}" for r in results for f, o in zip(r.force, r.outcomes, strict=True) if o.value]
    said += [warning for result in results for warning in result.warnings]
    joints = joints_figure(results[0])
    figures = [tool_figure(results), *([] if joints is None else [joints])]
    return Section("Forced response", list(dict.fromkeys(said)), figures, tables)
