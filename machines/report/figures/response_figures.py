"""Pictures of a forced response: the tool at each force with all branches, and the joints that move most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.shown.pictures import literal, shades

from ...forced_response.response import Response, styled
from ...operating.peaks import Peak
from ..drawing import sheet
from ..page import Figure
from .receptance_figure import Curve, receptance_figure

_JOINTS = 3


def tool_figure(
    results: Sequence[Response],
    plot: str = "mag-phase",
    measured: Sequence[tuple[str, str, Curve]] = (),
    *,
    png: bool = False,
) -> Figure:
    """The receptance at each drive for every force; ``measured`` holds (drive, output, curve) to be laid over.

    A drive that is no output is shown at all outputs.
    """
    panels = []
    for result in results:
        for o, output in enumerate(result.outputs):
            if result.drive in result.outputs and output != result.drive:
                continue
            curves = [
                Curve(branch.frequency, branch.output[:, o] / force, f"{force:g} N" if k == 0 else "", colour, style)
                for force, branches, colour in zip(
                    result.force, result.branches, shades(len(result.force)), strict=True
                )
                for k, (branch, style) in enumerate(styled(branches))
            ]
            curves += [curve for drive, at, curve in measured if (drive, at) == (result.drive, output)]
            panels.append((f"{output}\nper force on {result.drive}", curves))
    broken = any(style == "--" for r in results for branches in r.branches for _, style in styled(branches))
    caption = "Steady response to harmonic forces, each joint replaced by its describing function at its own amplitude"
    caption += "; broken lines are branches that no slowly swept test would stay on." if broken else "."
    return receptance_figure(panels, plot, caption, png=png)


def joints_figure(result: Response) -> Figure | None:
    """Relative motion in the joints that move most, round their main peak; None where no joint has a peak."""
    top: dict[str, float] = {}
    for peak in result.deflected:
        top[peak.connection] = max(top.get(peak.connection, 0.0), peak.amplitude)
    chosen = sorted(top, key=lambda name: -top[name])[:_JOINTS]
    if not chosen:
        return None
    with sheet(len(chosen), width=max(4.2 * len(chosen), 6.0), height=3.4, squeeze=False) as paper:
        for axes, connection in zip(paper.axes[0], chosen, strict=True):
            c = result.connections.index(connection)
            for force, branches, colour in zip(result.force, result.branches, shades(len(result.force)), strict=True):
                for i, (branch, style) in enumerate(styled(branches)):
                    label = f"{force:g} N" if i == 0 else None
                    size = np.abs(branch.joint[:, c]) * 1e6
                    axes.plot(branch.frequency, size, style, color=colour, label=label)
            peaks = [p for p in result.peaks if p.connection == connection and np.isfinite(p.amplitude)]
            for peak in peaks:
                axes.plot(peak.frequency, peak.amplitude * 1e6, "o", color="#1b1f24", markersize=3)
            axes.set_xlim(*_window(peaks))
            axes.set(
                xlabel="frequency [Hz]",
                ylabel=f"amplitude [{'µrad' if connection in result.turned else 'µm'}]",
                title=literal(f"Relative motion in {connection}"),
            )
        paper.axes[0][0].legend(title="peak force")
    most = "" if len(top) <= _JOINTS else f" The {_JOINTS} that move most, of {len(top)}; the others are in frf.npz."
    return Figure(paper.svg, f"Relative motion round the main peak; dots are the refined peaks.{most}")


def _window(peaks: Sequence[Peak]) -> tuple[float, float]:
    """Frequencies in Hz round the largest peak of each force."""
    largest = [max((p for p in peaks if p.force == f), key=lambda p: p.amplitude) for f in {p.force for p in peaks}]
    low, high = min(p.frequency for p in largest), max(p.frequency for p in largest)
    margin = max(10 * max(p.width for p in largest), 0.3 * (high - low), 0.02 * high)
    return low - margin, high + margin
