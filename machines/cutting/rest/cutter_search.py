"""The border of one tool in one cut that is not plain: what looks for it at a speed, and what settles it."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from jointlib.errors import CheckFailed
from jointlib.shown.progress import remark

from ...tool.bounded_band import Shape, shape, spectrum
from ...tool.tool_model import ToolModel
from ...tool.tool_point import ToolPoint
from ..cutters.border import Change, Closed, changes, settled, stable_below
from ..cutters.mean_cut import mean_crossings
from ..cutters.pattern_map import FINER, MORE, pattern_map, pattern_nodes
from ..cutters.side_lines import SideLines
from ..loops.harmonic_crossing import AGREE, GAIN, PAST, largest_line
from ..loops.loop_branches import Crossing, nearest_of
from ..loops.multi_frequency import stiffest_direction
from ..process.cutter import Cutter
from ..process.cutting import Cutting
from .periodic import FAR, JOINED, MANY_NODES, refuse_resonant_ends
from .slow_search import SlowSearch

_REACH, _ALONE = 2.5, 60.0
"""Times the depth of the mean cut up to which a first crossing is looked for; times the surely stable one without."""
_GAIN = 0.5
_MOST, _RAISES = 256, 5
_MANY = 16
"""Harmonics from which on the border is found by a march where modes are known."""
_MAPS, _LONG = 16, 60.0
"""Maps of a pattern that settle a crossing, and seconds from which on that is told before."""
_GUARD, _GUARD_BENT = 1e-6, 2e-5
"""Of depths by collocation; where delays change along the depth what is looked back at has kinks inside elements."""


@dataclass(frozen=True, eq=False)
class CutterSearch:
    """The border of one tool in one cut, speed by speed; ``model`` where collocation settles it.

    ``modes`` are those of the tool where they are known: a slow spindle is searched by them, whatever settles it.
    """

    cutting: Cutting
    cutter: Cutter
    point: ToolPoint
    resolved: Shape
    model: ToolModel | None
    modes: ToolModel | None

    @classmethod
    def of(
        cls, point: ToolPoint, cutting: Cutting, modes: ToolModel | None = None, method: str = "collocation"
    ) -> CutterSearch:
        """Of a tool point, with the modes that collocation needs."""
        model = modes if method == "collocation" else None
        return cls(cutting, Cutter.of(cutting), point, shape(point), model, modes)

    def loop(self, speed: float, depth: float = 0.0) -> SideLines:
        """The harmonics in which the border is looked for at a speed in rpm, up to a depth in m.

        The gain round the loop of a line past them is below `_GAIN`; past the lines known the tool acts as a mass.
        """
        P = self._harmonics(speed, depth)
        if P > _MOST:
            raise CheckFailed(
                f"multi-frequency: {P} harmonics of {self.cutter.frequency(speed):g} Hz, at which the flutes repeat, "
                f"would be needed at {speed:g} rpm, expected at most {_MOST} where no modes are known; take a faster "
                "spindle, or zero-order as a preview"
            )
        return self._lines(speed, P)

    def _harmonics(self, speed: float, depth: float) -> int:
        strong = 2 * depth * self._stiffest / _GAIN if self.cutting.process == "milling" else 0
        last, size = float(self.resolved.lines[-1]), float(self.resolved.size[-1])
        highest = self.resolved.reaching(1 / strong) if strong else 0.0
        if strong * size > 1:
            highest = last * np.sqrt(strong * size)
        return int(np.ceil(max(self.resolved.highest, highest) / self.cutter.frequency(speed))) + PAST

    def _lines(self, speed: float, harmonics: int) -> SideLines:
        highest = max(float(self.point.lines[-1]), (harmonics + PAST) * 2 * self.cutter.frequency(speed))
        receptance = spectrum(self.point, highest)
        refuse_resonant_ends(receptance, self.resolved)
        return SideLines(receptance, self.cutter, self._axes, speed, harmonics)

    @property
    def _axes(self) -> tuple[int, ...]:
        return tuple("xy".index(axis) for axis in self.point.axes)

    @property
    def _stiffest(self) -> float:
        return stiffest_direction(self.cutting, self._axes)

    def slow(self, speed: float, depth: float = 0.0, beyond: int = _MANY) -> SlowSearch | None:
        """The search of a speed in rpm that asks for more harmonics than so many, where modes are known."""
        if self.modes is None or self._harmonics(speed, depth) <= beyond:
            return None
        rubs = self.cutting.cuts_per_revolution * self.cutter.rubbing(speed)
        lines = partial(self._lines, speed)
        by_modes = self.model is not None
        return SlowSearch(self.modes, self.cutter, self.resolved, speed, self._stiffest, rubs, lines, by_modes)

    def found(self, speed: float, deepest: float | None = None, limit: float = 0.0) -> tuple[list[Change], float]:
        """Settled changes, the first alone or all up to ``deepest`` (m), and the depth in m up to which was looked.

        Nothing grows below the ``limit`` in m, which spares what is known.
        """
        slow = self.slow(speed, deepest or 0.0)
        if slow is not None:
            return self._found_slowly(slow, deepest, limit)
        loop = self.loop(speed, deepest or 0.0)
        nu = np.concatenate([[0.0], self.resolved.folded(loop.frequency)])
        if deepest is not None:
            low = min(stable_below(loop.closed, nu, deepest), 0.9 * deepest)
            every = changes(loop.closed, nu, low, deepest)
            return [replace(one, crossing=self.settle(loop, one.crossing)) for one in every], deepest
        mean = self._mean(speed)
        low = stable_below(loop.closed, nu, mean or 1.0)
        reach = self._reach(low, mean)
        if reach <= low:
            return [], reach
        first = [one for one in changes(loop.closed, nu, low, reach, first=True) if one.below == 0][:1]
        enough = self.loop(speed, first[0].crossing.depth if first else low)
        if enough.harmonics > loop.harmonics:
            loop = enough
            first = [one for one in changes(loop.closed, nu, low, reach, first=True) if one.below == 0][:1]
        return [replace(one, crossing=self.settle(loop, one.crossing)) for one in first], reach

    def _found_slowly(self, slow: SlowSearch, deepest: float | None, limit: float) -> tuple[list[Change], float]:
        if deepest is not None:
            return slow.every(deepest, limit), deepest
        mean = self._mean(slow.speed)
        reach = self._reach(slow.surely, mean)
        return slow.first(mean or reach, reach), reach

    def _mean(self, speed: float) -> float:
        """The limit in m of the mean cut without helix, 0 where it has none."""
        straight = replace(self.cutting, helix=None)
        mean = mean_crossings(along_cut(self.point, self.cutting), Cutter.of(straight), speed, 0.0, self.resolved)
        return mean[0][0] if mean else 0.0

    def _reach(self, low: float, mean: float) -> float:
        """How deep in m a first crossing is looked for, from a stable depth and the limit of the mean cut."""
        return min(max(_ALONE * low, _REACH * mean), 0.99 * self.cutter.deepest)

    def settle(self, loop: SideLines, crossing: Crossing) -> Crossing:
        """The crossing by the method, with a finer loop that proves it."""
        speed, before = loop.speed, crossing
        model = None if self.model is None else self._kept(self.model, loop, crossing)
        for raised in range(_RAISES):
            if model is None:
                finer = replace(loop, harmonics=loop.harmonics * 2 ** (raised + 1))
                after, within = settled(finer.closed, before), AGREE
            else:
                after = settled(self._map(model, before, speed, MORE + FINER * raised), before)
                within = _GUARD_BENT if any(flute.spread for flute in self.cutter.flutes) else _GUARD
            if after.kind and abs(after.depth / before.depth - 1) <= within:
                return after
            before = after if after.kind else before
        raise CheckFailed(
            f"{'multi-frequency' if self.model is None else 'collocation'}: at {speed:g} rpm the depth, about "
            f"{crossing.depth * 1e3:.3g} mm, still changes with the number of "
            f"{'harmonics' if self.model is None else 'nodes'}"
        )

    def _map(self, model: ToolModel, crossing: Crossing, speed: float, more: int) -> Closed:
        at = lru_cache(maxsize=2)(lambda depth: pattern_map(model, self.cutter, np.array([speed]), depth, more))
        begun = time.perf_counter()
        at(crossing.depth)
        needed = _MAPS * (time.perf_counter() - begun)
        if needed > _LONG and more == MORE:
            remark(
                f"collocation at {speed:g} rpm takes about {needed:.0f} s; multi-frequency, which has "
                f"{crossing.depth * 1e3:.5g} mm there, is faster"
            )
        return lambda nu, depth: at(depth).closed(nu)

    def joins(self, speed: float, depth: float) -> bool:
        """Whether the fastest modes ask for so many nodes at a speed (rpm) and depth (m) that they act together."""
        if self.model is None:
            return False
        return len(pattern_nodes(self.model.fastest, self.cutter, depth, speed).places) > MANY_NODES

    def _kept(self, model: ToolModel, loop: SideLines, crossing: Crossing) -> ToolModel:
        """The tool with its fastest modes joined, where they ask for too many nodes: as many are kept as the crossing,
        by harmonics of both, asks for.
        """
        if not self.joins(loop.speed, crossing.depth):
            return model
        tooth = self.cutting.cuts_per_revolution * loop.speed / 60
        weak = GAIN / (2 * stiffest_direction(self.cutting, loop.axes) * crossing.depth)
        highest = max(self.line(loop, crossing) * tooth, self.resolved.reaching(weak))
        for more in range(_RAISES):
            few = model.up_to(highest * FAR**more)
            beside = settled(replace(loop, receptance=few).closed, crossing)
            if beside.kind and abs(beside.depth / crossing.depth - 1) <= JOINED:
                return few
        raise CheckFailed(
            f"collocation: at {loop.speed:g} rpm the depth still changes with the modes that are kept; use "
            "multi-frequency"
        )

    def chatter_line(self, speed: float, crossing: Crossing) -> float:
        """The line, in tooth frequencies, at which the tool moves most at a speed in rpm."""
        slow = self.slow(speed)
        if slow is not None:
            return slow.line(crossing) * self.cutter.patterns / self.cutting.cuts_per_revolution
        return self.line(self.loop(speed), crossing)

    def line(self, loop: SideLines, crossing: Crossing) -> float:
        """`chatter_line` by a loop."""
        if not crossing.kind:
            return np.nan
        _, vector = nearest_of(loop.closed(np.array([crossing.fraction]), crossing.depth)[0], -1.0)
        line = largest_line(crossing.fraction + loop.orders, loop.motion(crossing.fraction, vector))
        return line * self.cutter.patterns / self.cutting.cuts_per_revolution


def along_cut(point: ToolPoint, cutting: Cutting) -> ToolPoint:
    """The tool along the chip thickness in turning, as it is in milling."""
    return point if cutting.process == "milling" else point.along(cutting.rotation[0])
