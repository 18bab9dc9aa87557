"""Stability lobes from a receptance and a cutting operation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import InputError, Outcome, nearest
from jointlib.frf import FRF

from . import turning, zero_order
from .chart import StabilityLobes
from .crossing import Crossings, first_crossings
from .cutting import Cutting
from .regeneration import Minimum, Trace, boundary, limiting_depth, lowest_depth, trace, wave_fraction
from .tool_point import Receptance, ToolPoint, sign_warnings, tool_point

METHODS = {"turning": "turning", "zero-order": "milling"}
"""The methods and the process each is for."""

_POWER_LAW = (
    "The force grows with a power of the chip thickness other than 1: the depths hold for vanishing vibration at the "
    "nominal feed, and a knock can start chatter below them."
)


def stability_lobes(
    receptance: FRF | Receptance | ToolPoint,
    cutting: Cutting,
    speed: ArrayLike,
    method: str | None = None,
    *,
    axes: Sequence[str] | None = None,
    frequency: ArrayLike | None = None,
) -> StabilityLobes:
    """Depth of cut at which chatter starts, its frequency and its lobe, at given spindle speeds.

    Parameters
    ----------
    receptance
        Tool-point receptance in m/N: an `FRF`, interpolated between its lines; a function G(f in Hz) → (nf, n, n),
        which is evaluated exactly where a root lies; or a `ToolPoint`.
    cutting
        The operation.
    speed
        Spindle speeds in rpm, any shape.
    method
        ``"turning"`` or ``"zero-order"``; without it, what suits the process.
    axes
        Directions that move, ``("x",)``, ``("y",)`` or ``("x", "y")``; see `tool_point`.
    frequency
        Lines in Hz where the search starts; needed for a function. The first and the last bound the search.
    """
    default = "turning" if cutting.process == "turning" else "zero-order"
    name = default if method is None else method
    if name not in METHODS:
        raise InputError(f"lobes: no method {method!r}, {nearest(str(method), METHODS)}")
    speeds = np.asarray(speed, dtype=float)
    if speeds.size == 0 or not np.all(np.isfinite(speeds) & (speeds > 0)):
        raise InputError("lobes: spindle speeds must be finite, positive and at least one, in rpm")
    if not isinstance(receptance, ToolPoint):
        receptance = tool_point(receptance, _assumed_axes(receptance, cutting, axes), frequency)
    elif axes is not None or frequency is not None:
        raise InputError("lobes: a ToolPoint already has its axes and frequencies, leave both out")

    if name == "turning":
        stiffness, point = turning.loop_stiffness(cutting), receptance.along("x")
        warnings = sign_warnings(point)
    else:
        stiffness, point = zero_order.loop_stiffness(cutting, receptance.axes), receptance
        warnings = sign_warnings(point) + zero_order.warnings(cutting)
    if cutting.exponent != 1:
        warnings += (_POWER_LAW,)

    cuts = cutting.cuts_per_revolution
    period = 60 / (cuts * speeds.ravel())
    traced = trace(point, stiffness)
    found = first_crossings(point, stiffness, traced, period)
    lowest = lowest_depth(point, stiffness, traced)
    outcome, doubts = _judged(point, traced, period, found, lowest)
    return StabilityLobes(
        method=name,
        speed=speeds,
        depth=found.depth.reshape(speeds.shape),
        chatter_frequency=found.frequency.reshape(speeds.shape),
        kind=np.where(np.isfinite(found.depth), "hopf", "").reshape(speeds.shape),
        lobe=found.lobe.reshape(speeds.shape),
        minimum_depth=lowest.depth,
        minimum_frequency=lowest.frequency,
        minimum_phase=lowest.phase,
        cuts_per_revolution=cuts,
        branches=boundary(traced, cuts),
        outcome=outcome,
        notes=turning.NOTES if name == "turning" else zero_order.NOTES,
        warnings=warnings + doubts,
    )


def _assumed_axes(receptance: FRF | Receptance, cutting: Cutting, axes: Sequence[str] | None) -> Sequence[str] | None:
    """In turning the one direction of a single FRF is x, whatever it is called."""
    single = isinstance(receptance, FRF) and len(receptance.outputs) == 1
    return ("x",) if axes is None and single and cutting.process == "turning" else axes


def _judged(
    point: ToolPoint, traced: Trace, period: Array, found: Crossings, lowest: Minimum
) -> tuple[Outcome, tuple[str, ...]]:
    """Whether the band and the lines can carry the result, and what to say where they cannot."""
    outcome, said = Outcome.CONVERGED, []
    if lowest.at_edge:
        outcome = Outcome.PEAK_AT_EDGE
        said.append(f"The minimum depth lies at the edge of the band, {lowest.frequency:g} Hz, and may fall beyond it.")
    for end, word in ((0, "starts"), (-1, "ends")):
        value, edge = traced.eigenvalue[end], traced.frequency[end]
        depth = limiting_depth(value)
        beyond = np.isfinite(depth) & (depth < found.depth[:, None])
        if end == 0:  # below the band only the waves already gathered at its edge can complete
            beyond &= period[:, None] * edge > wave_fraction(value)
        count = int(np.count_nonzero(beyond.any(axis=1)))
        if count:
            outcome = Outcome.FRF_TOO_SHORT
            said.append(
                f"The band {word} at {edge:g} Hz inside a lobe: at {count} of {len(period)} speeds a lower depth may "
                "belong to a frequency outside it."
            )
    if found.unsettled or not traced.resolved:
        said.append(
            "The receptance jumps between neighbouring frequencies, so some depths are only as good as its lines."
        )
    if point.sampled:
        said.extend(_wide_lines(point, traced))
    return outcome, tuple(said)


def _wide_lines(point: ToolPoint, traced: Trace) -> list[str]:
    """Fewer than about two lines per half-power bandwidth, where a phase of π/2 passes."""
    rows = np.searchsorted(traced.frequency, point.lines)
    value = traced.eigenvalue[rows]
    turned = np.abs(np.angle(value[1:] * value[:-1].conj()))
    used = (value.real[1:] < 0) | (value.real[:-1] < 0)
    strong = np.minimum(np.abs(value[1:]), np.abs(value[:-1])) > 1e-2 * np.max(np.abs(value))
    count = int(np.count_nonzero((turned > np.pi / 4) & used & strong))
    if count == 0:
        return []
    return [
        f"At {count} places the lines stand wider than half the half-power bandwidth of a mode; "
        "the depth near it is interpolated."
    ]
