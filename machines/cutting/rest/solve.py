"""Stability lobes from a receptance and a cutting operation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from jointlib.arrays import Array, ArrayLike
from jointlib.errors import CheckFailed, InputError, Outcome, nearest
from jointlib.frf import FRF

from ...components.interpolation import wide
from ...tool.plausible import refuse_undamped, sign_warnings
from ...tool.tool_model import ToolModel
from ...tool.tool_point import Receptance, ToolPoint, tool_point
from ..loops.crossing import Crossings, first_crossings
from ..loops.regeneration import Loops, Minimum, Trace, boundary, limiting_depth, lowest_depth, trace, wave_fraction
from ..process import turning, zero_order
from ..process.chart import METHODS, StabilityLobes
from ..process.cutting import Cutting
from . import periodic
from .beyond_record import within_record
from .cutter_charts import cutter_chart

_MOST_PHASE = 150.0
"""rad that the fastest mode turns in the cut of a tooth period, up to which collocation is the default."""
_NEEDS_MODES = "collocation: needs a tool with modes, found a receptance on lines or a function; use multi-frequency"
_SHAPED = ("depth", "chatter_frequency", "kind", "lobe", "known_below")
_POWER_LAW = (
    "The force grows with a power of the chip thickness other than 1: the depths hold for vanishing vibration at the "
    "nominal feed, and a knock can start chatter below them."
)


def stability_lobes(
    receptance: FRF | Receptance | ToolPoint | ToolModel,
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
        which is evaluated exactly where a root lies; a `ToolPoint`; or a `ToolModel`, which collocation needs.
    cutting
        The operation.
    speed
        Spindle speeds in rpm, any shape.
    method
        ``"turning"``; for milling ``"multi-frequency"``, ``"zero-order"`` (a preview) or ``"collocation"`` (of a
        `ToolModel`). Without it: turning, collocation of a `ToolModel` (multi-frequency where its cut is long against
        its oscillations and no more than 128 harmonics are needed), else multi-frequency.
    axes
        Directions that move, ``("x",)``, ``("y",)`` or ``("x", "y")``; see `tool_point`.
    frequency
        Lines in Hz where the search starts; needed for a function. The first and the last bound the search.
    """
    speeds = spindle_speeds(speed)
    name = default_method(receptance, cutting, speeds) if method is None else known_method(method, cutting)
    model = receptance if isinstance(receptance, ToolModel) else None
    if model is not None and axes is not None:
        raise InputError("lobes: a ToolModel already has its axes, leave them out")
    if model is not None:
        refuse_undamped(model)
        axes = model.axes
    if model is not None and frequency is None:
        receptance = _point_of(model)
    elif not isinstance(receptance, ToolPoint):
        receptance = tool_point(receptance, _assumed_axes(receptance, cutting, axes), frequency)
    elif axes is not None or frequency is not None:
        raise InputError("lobes: a ToolPoint already has its axes and frequencies, leave both out")
    return within_record(_charted(name, receptance, model, cutting, speeds, method), receptance, cutting)


def _charted(
    name: str, receptance: ToolPoint, model: ToolModel | None, cutting: Cutting, speeds: Array, method: str | None
) -> StabilityLobes:
    """The chart by a method, with the one that was asked for."""
    warnings = said_before(receptance, cutting, measured=model is None)
    if not cutting.plain:
        if name == "collocation" and model is None:
            raise InputError(_NEEDS_MODES)
        found = cutter_chart(name, receptance, model, cutting, speeds.ravel())
        shaped = {key: getattr(found, key).reshape(speeds.shape) for key in _SHAPED}
        return replace(found, speed=speeds, warnings=warnings + found.warnings, **shaped)
    if name in ("multi-frequency", "collocation"):
        chart = None
        if name == "multi-frequency":
            try:
                chart = periodic.by_harmonics(receptance, cutting, speeds.ravel())
            except CheckFailed:
                if method is not None or model is None:
                    raise
        if chart is not None:
            if receptance.sampled:
                traced = trace(Loops.of(receptance, zero_order.loop_stiffness(cutting, receptance.axes)))
                warnings += tuple(_wide_lines(receptance, traced))
        elif model is None:
            raise InputError(_NEEDS_MODES)
        else:
            chart = periodic.by_collocation(model, receptance, cutting, speeds.ravel())
        shaped = {key: getattr(chart, key).reshape(speeds.shape) for key in _SHAPED}
        return replace(chart, speed=speeds, warnings=warnings + chart.warnings, **shaped)
    if name == "turning":
        stiffness, point = turning.loop_stiffness(cutting), receptance.along(cutting.rotation[0])
    else:
        stiffness, point = zero_order.loop_stiffness(cutting, receptance.axes), receptance
        warnings += zero_order.warnings(cutting)

    cuts = cutting.cuts_per_revolution
    period = 60 / (cuts * speeds.ravel())
    loops = Loops.of(point, stiffness)
    traced = trace(loops)
    crossed = first_crossings(loops, traced, period[None])
    lowest = lowest_depth(loops, traced)
    outcome, doubts, sure = _judged(point, traced, period, crossed, lowest)
    return StabilityLobes(
        method=name,
        speed=speeds,
        depth=crossed.depth.reshape(speeds.shape),
        chatter_frequency=crossed.frequency.reshape(speeds.shape),
        kind=np.where(np.isfinite(crossed.depth), "hopf", "").reshape(speeds.shape),
        lobe=crossed.lobe.reshape(speeds.shape),
        known_below=np.full(speeds.shape, sure),
        minimum_depth=float(lowest.depth[0]),
        minimum_frequency=float(lowest.frequency[0]),
        minimum_phase=float(lowest.phase[0]),
        cuts_per_revolution=cuts,
        branches=boundary(traced, cuts),
        outcome=outcome,
        notes=turning.NOTES if name == "turning" else zero_order.NOTES,
        warnings=warnings + doubts,
    )


def spindle_speeds(speed: ArrayLike) -> Array:
    """Spindle speeds in rpm, checked."""
    speeds = np.asarray(speed, dtype=float)
    if speeds.size == 0:
        raise InputError("lobes: no spindle speed, expected at least one")
    wrong = speeds[~(np.isfinite(speeds) & (speeds > 0))]
    if wrong.size:
        raise InputError(f"lobes: a spindle speed of {wrong[0]:g} rpm, expected finite ones above 0")
    return speeds


def known_method(method: str, cutting: Cutting) -> str:
    """The name of a method, checked against the process."""
    if method not in METHODS:
        raise InputError(f"lobes: no method {method!r}, {nearest(str(method), METHODS)}")
    if cutting.process not in METHODS[method]:
        raise InputError(f"{method}: the process is {cutting.process}, expected {' or '.join(METHODS[method])}")
    return method


def default_method(receptance: FRF | Receptance | ToolPoint | ToolModel, cutting: Cutting, speed: Array) -> str:
    """Collocation for a tool with modes, unless the cut holds so many oscillations that harmonics are faster."""
    if cutting.process != "milling":
        return "turning"
    if isinstance(receptance, ToolModel):
        period = 60 / (cutting.cuts_per_revolution * float(np.min(speed)))
        arc = (cutting.exit_angle - cutting.entry_angle) * cutting.cuts_per_revolution / (2 * np.pi)
        if receptance.fastest * period * min(1.0, arc) <= _MOST_PHASE:
            return "collocation"
    return "multi-frequency"


@lru_cache(maxsize=8)
def _point_of(model: ToolModel) -> ToolPoint:
    """The tool point of a model, one for those who ask speed by speed."""
    return tool_point(model, model.axes, model.lines)


@lru_cache(maxsize=8)
def said_before(point: ToolPoint, cutting: Cutting, measured: bool = True) -> tuple[str, ...]:
    """What is doubtful whatever the method."""
    return sign_warnings(point, measured) + ((_POWER_LAW,) if cutting.exponent != 1 else ())


def _assumed_axes(receptance: FRF | Receptance, cutting: Cutting, axes: Sequence[str] | None) -> Sequence[str] | None:
    """In turning the one direction of a single FRF is x, whatever it is called."""
    single = isinstance(receptance, FRF) and len(receptance.outputs) == 1
    return ("x",) if axes is None and single and cutting.process != "milling" else axes


def _judged(
    point: ToolPoint, traced: Trace, period: Array, found: Crossings, lowest: Minimum
) -> tuple[Outcome, tuple[str, ...], float]:
    """Whether the band and the lines can carry the result, what to say where they cannot, and the depth (m) from which
    on frequencies outside may matter.
    """
    outcome, said, sure = Outcome.CONVERGED, list[str](), np.inf
    if lowest.at_edge[0]:
        outcome, sure = Outcome.PEAK_AT_EDGE, 0.0
        at = float(lowest.frequency[0])
        said.append(f"The minimum depth lies at the edge of the band, {at:g} Hz, and may fall beyond it.")
    for end, word in ((0, "starts"), (-1, "ends")):
        value, edge = traced.eigenvalue[end], traced.frequency[end]
        depth = limiting_depth(value)
        beyond = np.isfinite(depth) & (depth < found.depth[0, :, None])
        if end == 0:  # below the band only the waves already gathered at its edge can complete
            beyond &= period[:, None] * edge > wave_fraction(value)
        count = int(np.count_nonzero(beyond.any(axis=1)))
        if count:
            outcome = Outcome.FRF_TOO_SHORT
            sure = min(sure, float(np.min(depth[beyond.any(axis=0)])))
            said.append(
                f"The band {word} at {edge:g} Hz inside a lobe: at {count} of {len(period)} speeds a lower depth may "
                "belong to a frequency outside it."
            )
    if found.unsettled[0] or not traced.resolved[0]:
        said.append(
            "The receptance jumps between neighbouring frequencies, so some depths are only as good as its lines."
        )
    if point.sampled:
        said.extend(_wide_lines(point, traced))
    return outcome, tuple(said), sure


def _wide_lines(point: ToolPoint, traced: Trace) -> list[str]:
    """Fewer than about two lines per half-power bandwidth, where the loop could chatter."""
    rows = np.searchsorted(traced.frequency, point.lines)
    value = traced.eigenvalue[rows]
    used = (value.real[1:] < 0) | (value.real[:-1] < 0)
    count = int(np.count_nonzero(wide(value) & used))
    if count == 0:
        return []
    return [
        f"At {count} places the lines stand wider than half the half-power bandwidth of a mode; "
        "the depth near it is interpolated."
    ]
