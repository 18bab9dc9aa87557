"""All depths at which one spindle speed chatters: lenses of instability with stable stretches above them.

The limiting depth is the first crossing from zero depth. Flip lenses close again, and a stable stretch may follow. Here
every crossing up to a depth is found, and the multipliers outside the unit circle are counted from the stable cut
without depth upwards.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from jointlib.arrays import ArrayLike
from jointlib.errors import CheckFailed, InputError
from jointlib.system.processes import on_every_core

from ...deadline import OutOfTime, in_time
from ...model.machine import Machine
from ...model.spindle_speed import at_speed, depends_on_speed
from ...tool.at_rest import tip_at_rest
from ...tool.bounded_band import shape, spectrum
from ...tool.chatter_band import chatter_band
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint, tool_point
from ..loops.collocation import FINER, MORE, ArcMap, arc_map
from ..loops.critical_depth import near
from ..loops.edges import Edge, edges_of_loop, edges_of_trace, outside
from ..loops.harmonic_crossing import GAIN, MOST_SEARCHED, PAST, left_out
from ..loops.loop_branches import NONE, Crossing, Loop
from ..loops.multi_frequency import HarmonicLoop, stiffest_direction
from ..loops.regeneration import Loops, trace
from ..process import turning, zero_order
from ..process.chart import BY_SPEED, StabilityLobes
from ..process.cutting import Cutting
from ..rest.cutter_charts import cutter_edges
from ..rest.cutter_search import CutterSearch
from .frozen_lobes import lobes_at_amplitude

REACH = 6.0
"""Times the limiting depth up to which crossings are looked for, where nothing else is said."""
DEEPER = 1.1
"""Times the deepest depth that is spoken of up to which stable cuts above a limit are looked for."""
_SETTLED = {"multi-frequency": 1e-3, "collocation": 1e-2}
_SHARE = 0.6
_BESIDE = 1e-3
_WITHIN = 0.98
"""Share of the reach up to which a limit leaves room for anything above it."""
_RAISES = 4
_CLOSER = 8
_SLOW = 64
"""Harmonics of the tooth frequency from which on the march of any cutter finds the crossings of an even one."""
_PIECE = 20


@dataclass(frozen=True)
class Interval:
    """Depths in m, ``low`` to ``high``, at which the cut chatters; ``high`` is inf where no end was met."""

    low: float
    high: float
    kind: str
    """Of the chatter at the lower edge, ``"hopf"`` or ``"flip"``."""
    end: str
    """Kind at the upper edge; empty where there is none."""


@dataclass(frozen=True)
class UnstableDepths:
    """The unstable intervals of depth at one speed in rpm, looked for up to ``deepest`` in m."""

    speed: float
    deepest: float
    intervals: tuple[Interval, ...]

    @property
    def lenses(self) -> tuple[Interval, ...]:
        """Those with an upper edge: above it the cut is stable again."""
        return tuple(one for one in self.intervals if np.isfinite(one.high))

    def unstable(self, depth: float) -> bool:
        """Whether the cut chatters at a depth in m; above ``deepest`` as at it."""
        return any(one.low < depth < one.high for one in self.intervals)


def unstable_depths(
    machine: Machine, chart: StabilityLobes, deepest: ArrayLike | None = None
) -> tuple[UnstableDepths, ...]:
    """Every unstable interval of depth at the speeds of a chart of the machine at rest, by the chart's method.

    Parameters
    ----------
    machine
        As for `lobes_at_amplitude`.
    chart
        Its lobes at vanishing vibration.
    deepest
        m; default: `REACH` times the limiting depth of each speed.
    """
    if machine.cutting is None:
        raise InputError(f"{machine.where}: no [cutting], lobes need a cutting operation")
    if not depends_on_speed(machine):
        return _of_one(machine, chart, deepest)
    reach = np.broadcast_to(REACH * chart.depth if deepest is None else np.asarray(deepest, float), chart.depth.shape)
    found: list[UnstableDepths] = []
    for i, rpm in np.ndenumerate(chart.speed):
        one = replace(chart, **{key: getattr(chart, key)[i].reshape(1) for key in BY_SPEED})
        found += _of_one(at_speed(machine, float(rpm)), one, reach[i])
    return tuple(found)


def _of_one(machine: Machine, chart: StabilityLobes, deepest: ArrayLike | None) -> tuple[UnstableDepths, ...]:
    """`unstable_depths` of a machine that is one at the speeds of the chart."""
    cutting = Cutting(**dict(machine.cutting or {}))
    band = chatter_band(machine)
    if band.model is not None:
        return unstable_depths_of(band.model, cutting, chart, deepest)
    if chart.method == "collocation":
        raise InputError(f"{machine.where}: the joints at rest are no springs and dampers; use multi-frequency")
    return unstable_depths_of(tip_at_rest(machine, band.lines), cutting, chart, deepest)


def unstable_depths_of(
    receptance: ToolPoint | ToolModel, cutting: Cutting, chart: StabilityLobes, deepest: ArrayLike | None = None
) -> tuple[UnstableDepths, ...]:
    """`unstable_depths` of a tool point or a `ToolModel`, which collocation needs, whose ``chart`` is given."""
    if isinstance(receptance, ToolModel):
        point = tool_point(receptance, receptance.axes, receptance.lines)
        modes = receptance
    else:
        point, modes = receptance, None
    model = modes if chart.method == "collocation" else None
    speed, depth = chart.speed.ravel(), chart.depth.ravel()
    reach = (
        REACH * depth if deepest is None else np.array(np.broadcast_to(np.asarray(deepest, dtype=float), depth.shape))
    )
    chatters = np.isfinite(depth) & (depth < _WITHIN * reach)
    if not cutting.plain:
        edges = [
            cutter_edges(chart.method, point, modes, cutting, rpm, deep, limit) if looked else []
            for looked, rpm, deep, limit in zip(chatters, speed.tolist(), reach.tolist(), depth.tolist(), strict=True)
        ]
    elif chart.method in ("turning", "zero-order"):
        turned = chart.method == "turning"
        seen = point.along(cutting.rotation[0]) if turned else point
        stiffness = turning.loop_stiffness(cutting) if turned else zero_order.loop_stiffness(cutting, point.axes)
        period = 60 / (cutting.cuts_per_revolution * speed)
        loops = Loops.of(seen, stiffness)
        edges = edges_of_trace(loops, trace(loops), period, np.where(chatters, reach, 0.0))
    else:
        search = _Search(chart.method, point, model, cutting)
        march = CutterSearch.of(point, cutting, modes, chart.method)
        edges = list[list[Edge]]()
        for looked, rpm, limit, deep in zip(chatters, speed.tolist(), depth.tolist(), reach.tolist(), strict=True):
            if looked and march.slow(rpm, deep, _SLOW) is not None:
                edges.append(cutter_edges(chart.method, point, modes, cutting, rpm, deep, limit))
            else:
                edges.append(search.edges(rpm, limit, deep) if looked else [])
    found = []
    for i, one in enumerate(edges):
        zones = _intervals(one)
        if not chatters[i] and depth[i] < reach[i]:
            zones = (Interval(float(depth[i]), np.inf, str(chart.kind.ravel()[i]), ""),)
        found.append(UnstableDepths(float(speed[i]), float(reach[i]), zones))
    return tuple(found)


def closer_at_lenses(machine: Machine, chart: StabilityLobes, deepest: float) -> tuple[UnstableDepths, ...]:
    """`unstable_depths` by ascending speed, with further speeds between those where lenses begin or end.

    Where the time ends (`deadline.within`), those that are known.
    """
    found = sorted(_in_pieces(machine, chart, deepest), key=lambda one: one.speed)
    between = [
        np.linspace(one.speed, other.speed, _CLOSER + 1)[1:-1]
        for one, other in pairwise(found)
        if (one.lenses or other.lenses) and one.speed < other.speed
    ]
    if not between or len(found) < chart.speed.size:
        return tuple(found)
    try:
        more = lobes_at_amplitude(machine, np.concatenate(between), 0.0, chart.method)
    except OutOfTime:
        return tuple(found)
    return tuple(sorted([*found, *_in_pieces(machine, more, deepest)], key=lambda one: one.speed))


def _in_pieces(machine: Machine, chart: StabilityLobes, deepest: float) -> list[UnstableDepths]:
    """`unstable_depths` at as many speeds as there is time for, some at once."""

    def piece(first: int) -> list[UnstableDepths]:
        some = {key: getattr(chart, key)[first : first + _PIECE] for key in BY_SPEED}
        return list(unstable_depths(machine, replace(chart, **some), deepest))

    pieces, found = range(0, chart.speed.size, _PIECE), list[UnstableDepths]()
    with suppress(OutOfTime):
        for some in on_every_core(piece, pieces, len(pieces)):
            found += some
    return found


def _intervals(edges: list[Edge]) -> tuple[Interval, ...]:
    found: list[Interval] = []
    below = 0
    for edge, above in zip(edges, outside(edges), strict=True):
        if not below and above:
            found.append(Interval(edge.depth, np.inf, edge.kind, ""))
        elif below and not above:
            found[-1] = replace(found[-1], high=edge.depth, end=edge.kind)
        below = above
    return tuple(found)


class _Search:
    """The crossings of one tool by one method, speed by speed."""

    def __init__(self, method: str, point: ToolPoint, model: ToolModel | None, cutting: Cutting) -> None:
        self.method, self.model, self.cutting = method, model, cutting
        self.point, self.shape = point, shape(point)

    def edges(self, speed: float, first: float, deepest: float) -> list[Edge]:
        """Up to ``deepest`` in m, settled; the lowest is ``first``."""
        tooth = self.cutting.cuts_per_revolution * speed / 60
        fraction = self.shape.folded(tooth)
        for extra in range(_RAISES):
            in_time()
            loop, finer = self._loops(speed, tooth, deepest, extra)
            found = _settled(edges_of_loop(loop, fraction, deepest), finer, _SETTLED[self.method])
            whole = found and abs(found[0].depth / first - 1) < _BESIDE and min(_counts(found)) >= 0
            if whole and (not isinstance(finer, ArcMap) or _confirmed(finer, found, deepest)):
                return found
        raise CheckFailed(
            f"{self.method}: at {speed:g} rpm the crossings up to a depth of {deepest * 1e3:.3g} mm are not resolved"
        )

    def _loops(self, speed: float, tooth: float, deepest: float, extra: int) -> tuple[Loop, Loop]:
        """A loop that resolves the depth and a finer one that settles it."""
        axes = tuple("xy".index(axis) for axis in self.point.axes)
        stiffest = stiffest_direction(self.cutting, axes)
        if self.model is not None:
            model = self.model.up_to(self.shape.reaching(GAIN / (2 * stiffest * deepest)))
            coarse = arc_map(model, self.cutting, speed, MORE // 2 + FINER * extra, _SHARE)
            return coarse, arc_map(model, self.cutting, speed, MORE + FINER * (extra + 1))
        P = (int(np.ceil(self.shape.highest / tooth)) + PAST) * 2**extra
        highest = max(float(self.point.lines[-1]), (self.shape.highest + PAST * tooth) * 2)
        loop = HarmonicLoop(spectrum(self.point, highest), self.cutting, axes, tooth, P)
        while left_out(self.shape, loop, stiffest * deepest) >= GAIN:
            loop = replace(loop, harmonics=2 * loop.harmonics)
        if loop.harmonics > MOST_SEARCHED:
            raise CheckFailed(
                f"{self.method}: at {speed:g} rpm more than {MOST_SEARCHED} harmonics would be needed to find the "
                f"crossings up to a depth of {deepest * 1e3:.3g} mm"
            )
        return loop, replace(loop, harmonics=2 * loop.harmonics)


def _settled(edges: list[Edge], finer: Loop, within: float) -> list[Edge]:
    """The crossings of the finer loop; none at all where one of them is not there."""
    found = []
    for edge in edges:
        crossing: Crossing = near(finer, edge.crossing)
        if crossing is NONE or abs(crossing.depth / edge.depth - 1) > within:
            return []
        found.append(replace(edge, depth=crossing.depth, fraction=crossing.fraction, eigenvalue=crossing.eigenvalue))
    return sorted(found, key=lambda one: one.depth)


def _counts(edges: list[Edge]) -> list[int]:
    return list(np.cumsum([edge.moved for edge in edges], dtype=int).tolist())


def _confirmed(arc: ArcMap, edges: list[Edge], deepest: float) -> bool:
    """Whether the multipliers, halfway between the crossings, are as many outside the unit circle as were counted."""
    ends = np.array([0.0, *(edge.depth for edge in edges), deepest])
    size = np.abs(np.linalg.eigvals(arc.maps((ends[1:] + ends[:-1]) / 2)))
    return bool(np.all(np.count_nonzero(size > 1, axis=1) == [0, *_counts(edges)]))
