"""Pictures of a machine: the linear check, forced responses with all branches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..branches import Stability
from ..peaks import Peak
from ..response import Response
from .drawing import AFTER, BEFORE, shades, sheet
from .page import Figure


def response_figure(result: Response, output: str) -> Figure:
    """Receptance at an output and relative motion of each joint for every force, all branches."""
    columns = 1 + len(result.connections)
    with sheet(columns, width=5.2 * columns, height=3.8, squeeze=False) as paper:
        tip, *joints = paper.axes[0]
        o = result.outputs.index(output)
        for force, branches, colour in zip(result.force, result.branches, shades(len(result.force)), strict=True):
            for i, branch in enumerate(branches):
                style = "--" if branch.stability is Stability.UNSTABLE else "-"
                label = f"{force:g} N" if i == 0 else None
                size = np.abs(branch.output[:, o]) / force
                tip.semilogy(branch.frequency, size * 1e6, style, color=colour, label=label)
                for axes, c in zip(joints, range(len(result.connections)), strict=True):
                    axes.plot(branch.frequency, np.abs(branch.joint[:, c]) * 1e6, style, color=colour)
        tip.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title=f"{output} per force on {result.drive}")
        for axes, connection in zip(joints, result.connections, strict=True):
            axes.set(
                xlabel="frequency [Hz]", ylabel="amplitude [µm]", title=f"Relative motion in {connection}, main peak"
            )
        for axes, connection in zip(joints, result.connections, strict=True):
            peaks = [p for p in result.peaks if p.connection == connection and np.isfinite(p.amplitude)]
            for peak in peaks:
                axes.plot(peak.frequency, peak.amplitude * 1e6, "o", color="#1b1f24", markersize=3)
            axes.set_xlim(*_window(peaks, result))
        tip.legend(title="peak force")
    return Figure(
        paper.svg,
        "Steady response to harmonic forces. Each joint is replaced by its describing function at its own "
        "amplitude; broken lines are branches that no slowly swept test would stay on; dots are the refined "
        "peaks.",
    )


def _window(peaks: Sequence[Peak], result: Response) -> tuple[float, float]:
    """Frequencies in Hz round the largest peak of each force."""
    lines = [(b.frequency[0], b.frequency[-1]) for branches in result.branches for b in branches]
    if not peaks:
        return min(low for low, _ in lines), max(high for _, high in lines)
    largest = [max((p for p in peaks if p.force == f), key=lambda p: p.amplitude) for f in {p.force for p in peaks}]
    low, high = min(p.frequency for p in largest), max(p.frequency for p in largest)
    margin = max(10 * max(p.width for p in largest), 0.3 * (high - low), 0.02 * high)
    return low - margin, high + margin


def check_figure(frequency: Array, ours: ComplexArray, theirs: ComplexArray) -> Figure:
    """Receptance by coupling and by the state-space model, and their relative difference."""
    with sheet(2, width=10.0, height=3.2) as paper:
        left, right = paper.axes
        left.semilogy(frequency, np.abs(ours) * 1e6, color=AFTER, label="receptance coupling")
        left.semilogy(frequency, np.abs(theirs) * 1e6, ":", color=BEFORE, linewidth=2.2, label="python-control")
        left.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title="Joints linearised")
        left.legend()
        difference = np.abs(ours - theirs) / np.max(np.abs(theirs))
        right.semilogy(frequency, np.maximum(difference, 1e-18), color=AFTER)
        right.axhline(1e-8, color=BEFORE, linestyle="--")
        right.set(xlabel="frequency [Hz]", ylabel="difference / largest", title="Difference (limit broken)")
    return Figure(
        paper.svg, "The coupled machine against a state-space model that was built from feedback interconnections."
    )
