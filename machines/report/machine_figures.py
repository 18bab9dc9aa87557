"""Pictures of a machine: the linear check, forced responses with all branches, stability lobes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..branches import Stability
from ..lobes import StabilityLobes
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


def lobes_figure(charts: Sequence[tuple[float, StabilityLobes]]) -> Figure:
    """Limiting depth in mm over speed in rpm, one curve per tool-point amplitude (m), over the chatter frequency."""
    import matplotlib.ticker

    with sheet(1, 2, width=9.5, height=5.6, sharex=True, height_ratios=[2, 1]) as paper:
        depth, chatter = paper.axes
        widths = np.linspace(4.0, 1.2, len(charts))
        for (amplitude, chart), colour, width in zip(charts, shades(len(charts)), widths, strict=True):
            label = f"{amplitude * 1e6:g} µm" if amplitude else "vanishing"
            limit = np.where(np.isfinite(chart.depth), chart.depth * 1e3, np.nan)
            depth.plot(chart.speed, limit, color=colour, linewidth=width, label=label)
            chatter.plot(chart.speed, chart.chatter_frequency, ".", color=colour, markersize=width + 1)
        finite = np.concatenate([c.depth[np.isfinite(c.depth)] for _, c in charts]) * 1e3
        if len(finite):
            depth.set_ylim(0, min(float(finite.max()), 6 * float(np.median(finite))) * 1.05)
        depth.set(ylabel="limiting depth of cut [mm]", title="Stable below the curve")
        depth.legend(title="tool-point amplitude")
        chatter.set(xlabel="spindle speed [rpm]", ylabel="chatter frequency [Hz]")
        chatter.xaxis.set_major_formatter(matplotlib.ticker.StrMethodFormatter("{x:,.0f}"))
    return Figure(
        paper.svg,
        "Stability lobes: the limiting depth of cut where vibration of the stated tool-point amplitude "
        "neither grows nor dies, and the frequency it has.",
    )
