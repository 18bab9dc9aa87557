"""The peaks of the tool as rows of text, with units, and beside each what makes it doubtful."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..forced_response.tool_peaks import ToolPeak
from ..stability.labels import MUCH, percent

HEADER = ("direction", "force [N]", "frequency [Hz]", "compliance [µm/N]", "damping [%]", "moves most", "note")
_SMALL = 0.01
"""Share of the largest compliance of a direction below which a peak is not listed."""
_ERROR = 1e-3
"""Estimated error of the harmonics solved for above which it is told."""


def tool_peak_rows(peaks: Sequence[ToolPeak], axes: Mapping[str, str]) -> tuple[list[tuple[str, ...]], int]:
    """The rows under `HEADER`, and how many peaks are too small to be listed; ``axes`` names directions by dofs."""
    rows: list[tuple[str, ...]] = []
    left = 0
    for peak in peaks:
        alike = [p.compliance for p in peaks if (p.drive, p.output, p.force) == (peak.drive, peak.output, peak.force)]
        if peak.compliance < _SMALL * max(alike):
            left += 1
            continue
        damping = f"{100 * peak.damping_ratio:.3g}" if np.isfinite(peak.damping_ratio) else "–"
        notes = [f"harmonics left out: off by {_estimated(peak.error)}"] if peak.error > _ERROR else []
        notes += [f"a force that sliders hold: up to {percent(peak.held)}"] if peak.held > MUCH else []
        rows.append(
            (
                direction(peak, axes),
                f"{peak.force:g}",
                f"{peak.frequency:.5g}",
                f"{peak.compliance * 1e6:.4g}",
                damping,
                peak.connection or "–",
                "; ".join(notes),
            )
        )
    return rows, left


def _estimated(error: float) -> str:
    """Next to a fold the estimate has no bound."""
    return f"an estimated {percent(error)}" if error < 1 else "as much as it is, next to a fold"


def direction(peak: ToolPeak, axes: Mapping[str, str]) -> str:
    """``x``, or ``y for a force along x``."""
    output, drive = axes.get(peak.output, peak.output), axes.get(peak.drive, peak.drive)
    return output if output == drive else f"{output} for a force along {drive}"
