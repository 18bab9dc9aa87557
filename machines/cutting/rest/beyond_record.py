"""What a chart of a tool that is known on some frequencies only may claim."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome

from ...tool.bounded_band import spectrum
from ...tool.tool_point import ToolPoint
from ...tool.unseen_modes import unseen_flexibility
from ..process import turning, zero_order
from ..process.chart import UNSEEN, StabilityLobes
from ..process.cutting import Cutting
from .cutter_search import along_cut

_DAMPING = 0.01
"""Damping ratio that a mode beyond the lines is taken to have."""


def within_record(chart: StabilityLobes, point: ToolPoint, cutting: Cutting) -> StabilityLobes:
    """The chart with the depth from which on a mode beyond the lines may chatter, and that said.

    Where the chatter that was found lies outside of the lines itself, its depth is no more known: see `refuse_beyond`.
    """
    low, high = spectrum(point, 2 * float(point.lines[-1])).known
    if not np.isfinite(high):
        return replace(chart, known_below=np.full(chart.depth.shape, np.inf))
    outside = (chart.chatter_frequency > high) | (chart.chatter_frequency < low)
    if np.any(outside):
        said = (
            f"At some speeds chatter would lie outside of {low:g} to {high:g} Hz, where the receptance is known: the "
            "depth there is not known."
        )
        below = np.where(outside, np.minimum(chart.known_below, (1 - _DAMPING) * chart.depth), chart.known_below)
        chart = replace(chart, warnings=(*chart.warnings, said), outcome=Outcome.FRF_TOO_SHORT, known_below=below)
    flexibility, stiffness = _unseen(point, cutting)
    if not flexibility * stiffness > 0:
        return chart
    # A mode of flexibility g and damping ratio ζ has a real part from −g/(4ζ(1 + ζ)) to g/(4ζ(1 − ζ)).
    may = 2 * _DAMPING * (1 - _DAMPING) / (stiffness * flexibility)
    chart = replace(chart, known_below=np.minimum(may, chart.known_below))
    if not np.any(chart.depth > may):
        return chart
    said = (
        f"{UNSEEN} {high:g} Hz, {1e6 * flexibility:.2g} um/N of flexibility: with {100 * _DAMPING:g} % of damping they "
        f"may chatter from {1e3 * may:.3g} mm on, so larger depths hold up to {high:g} Hz only; records to a higher "
        "frequency tell more."
    )
    return replace(
        chart,
        warnings=(*chart.warnings, said),
        outcome=Outcome.FRF_TOO_SHORT if chart.outcome is Outcome.CONVERGED else chart.outcome,
    )


def refuse_beyond(method: str, speed: Array, chatter: Array, low: float, high: float) -> None:
    """Raise where every chatter frequency in Hz lies outside those at which the tool is known."""
    speeds, lines = np.ravel(speed), np.ravel(chatter)
    outside = (lines > high) | (lines < low)
    if not np.any(outside) or np.any((lines <= high) & (lines >= low)):
        return
    worst = int(np.argmax(np.where(outside, np.maximum(lines / high, low / lines), 0.0)))
    known = f"from {low:g} to {high:g} Hz" if low else f"up to {high:g} Hz"
    raise InputError(
        f"{method}: the receptance is known {known} and chatter would lie outside of that at "
        f"{np.count_nonzero(outside)} of {len(lines)} speeds, at {speeds[worst]:g} rpm at {lines[worst]:.5g} Hz; "
        "expected a wider band"
    )


def refuse_unknown(chart: StabilityLobes) -> None:
    """Raise where all chatter of a chart lies above what is known of the tool."""
    if chart.known_to is not None:
        refuse_beyond(chart.method, chart.speed, chart.chatter_frequency, 0.0, chart.known_to)


def _unseen(point: ToolPoint, cutting: Cutting) -> tuple[float, float]:
    """Flexibility in m/N of modes above the lines, and the stiffness in N/m² with which a cut drives them at most."""
    if cutting.process == "milling":
        D = zero_order.loop_stiffness(cutting, point.axes)
        return unseen_flexibility(point), float(np.max(np.abs(np.linalg.eigvalsh((D + D.T) / 2))))
    return unseen_flexibility(along_cut(point, cutting)), abs(float(turning.loop_stiffness(cutting)[0, 0]))
