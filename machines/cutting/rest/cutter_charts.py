"""Charts of cutters with unequal pitches, helix or process damping, by every method."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from jointlib.arrays import Array
from jointlib.system.processes import each_on_every_core

from ...deadline import in_time
from ...tool.bounded_band import shape
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint
from ..cutters.border import STEP
from ..cutters.mean_cut import mean_crossings
from ..loops.edges import Edge
from ..loops.harmonic_crossing import Found
from ..loops.loop_branches import NONE, Crossing
from ..process.chart import StabilityLobes
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from ..process.flank import linear_down_to
from .cutter_search import CutterSearch, along_cut
from .periodic import AT_SPEEDS, JOINED, charted, joined_words

NOTES = ("Not covered: runout, axial and torsional motion, loss of contact.", AT_SPEEDS)
_MEAN = "Zero-order approximation: tooth forces are replaced by their mean, in which a helix takes no part."
_ISLANDS = f"Depths were looked at in steps of {100 * (STEP - 1):.0f} %: a narrower island may be missed."
_RUBBING = (
    "Process damping is linear in the vibration and in 1/v: it holds for waves that are short and low against the "
    "wear land; far below the speeds at which it lifts the limit the flank bottoms out and the depths are too high."
)
_FEWER = 0.1


def cutter_edges(
    method: str,
    point: ToolPoint,
    model: ToolModel | None,
    cutting: Cutting,
    speed: float,
    deepest: float,
    limit: float = 0.0,
) -> list[Edge]:
    """Every crossing of the border of a cut that is not `Cutting.plain`, up to a depth in m, at a speed in rpm.

    Nothing grows below the ``limit`` in m.
    """
    in_time()
    if method in ("turning", "zero-order") or cutting.process != "milling":
        every = mean_crossings(along_cut(point, cutting), Cutter.of(cutting), speed, deepest, shape(point))
        return [Edge(depth, f, "hopf", outwards) for depth, f, outwards in every]
    found, _ = CutterSearch.of(point, cutting, model, method).found(speed, deepest, limit)
    return [Edge(one.crossing.depth, one.crossing.fraction, one.crossing.kind, one.above > one.below) for one in found]


def cutter_chart(
    name: str, point: ToolPoint, model: ToolModel | None, cutting: Cutting, speed: Array
) -> StabilityLobes:
    """The chart of a cutter that is not `Cutting.plain`, by a method of `stability_lobes`, at speeds in rpm."""
    said = [_RUBBING] if cutting.process_damping else []
    if name in ("turning", "zero-order") or cutting.process != "milling":
        found = each_on_every_core("speeds", partial(_of_mean, point, cutting), speed.tolist())
        notes = NOTES if name != "zero-order" else (_MEAN, *NOTES)
    else:
        search = CutterSearch.of(point, cutting, model, name)

        def searched(rpm: float) -> tuple[Found, float]:
            first, reach = search.found(rpm)
            if not first:
                return Found(NONE), reach
            crossing = first[0].crossing
            return Found(crossing, search.chatter_line(rpm, crossing)), reach

        looked = each_on_every_core("speeds", searched, speed.tolist())
        found = [one for one, _ in looked]
        none = [reach for one, reach in looked if not one.crossing.kind]
        notes = (*NOTES, _ISLANDS)
        border = [
            (rpm, one.crossing.depth) for rpm, one in zip(speed.tolist(), found, strict=True) if one.crossing.kind
        ]
        said += [joined_words(JOINED)] if any(search.joins(*one) for one in border) else []
        if none:
            said.append(
                f"At {len(none)} of {len(found)} speeds nothing chatters up to the depths that were looked at, "
                f"{min(none) * 1e3:.3g} mm at least."
            )
    chart = charted(name, found, cutting, speed, tuple(said))
    return replace(chart, notes=notes, warnings=chart.warnings + _flank_words(cutting, chart))


def _flank_words(cutting: Cutting, chart: StabilityLobes) -> tuple[str, ...]:
    """Down to which speed the linear form of a flank of known shape holds for the chatter that was found."""
    hertz = np.ravel(chart.chatter_frequency)
    ends = np.array([linear_down_to(cutting, float(f), _FEWER) for f in hertz])
    below = np.ravel(chart.speed) < ends
    if not np.any(below):
        return ()
    return (
        f"Below {float(np.max(ends[below])):.0f} rpm the waves are so short against the wear land that the flank damps "
        f"them by {100 * _FEWER:g} % less than its linear form and more: the depths at {np.count_nonzero(below)} of "
        f"{len(hertz)} speeds are too high; --amplitude takes the flank by its shape.",
    )


def _of_mean(point: ToolPoint, cutting: Cutting, speed: float) -> Found:
    """The lowest depth of a cut that is taken as its mean."""
    every = mean_crossings(along_cut(point, cutting), Cutter.of(cutting), speed, 0.0, shape(point))
    if not every:
        return Found(NONE)
    depth, f, _ = every[0]
    waves = f * 60 / (cutting.cuts_per_revolution * speed)
    fraction = min(waves % 1, 1 - waves % 1)
    return Found(Crossing(depth, max(fraction, 1e-12), complex(-1 / depth)), waves)
