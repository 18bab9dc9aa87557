"""The border of any cutter where its pattern takes many oscillations of the tool: found by a march, settled by either
method.

The loop in harmonics of the pattern has thousands of rows then. The march over one pattern (`cutters.march`) takes
seconds a speed, and what it finds is settled by itself with more modes and nodes, which is collocation, or by the
harmonics, which are applied instead of formed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from jointlib.errors import CheckFailed

from ...tool.bounded_band import Shape
from ...tool.tool_model import ToolModel
from ..cutters.border import Change, zero_near
from ..cutters.march import Marcher
from ..cutters.marched_border import changes, settled
from ..cutters.pattern_map import FINER, MORE
from ..cutters.side_lines import SideLines
from ..cutters.wide_lines import WideLines
from ..loops.harmonic_crossing import GAIN, PAST, largest_line
from ..loops.loop_branches import Crossing
from ..process.cutter import Cutter
from .periodic import FAR, JOINED

_WITHIN, _RAISES = 0.02, 8
_AGREE = 2e-5
"""Of depths by so many harmonics and by half as many; they come closer with 1/P."""
_HIGHER, _BELOW = 1.4, 0.97


@dataclass(frozen=True, eq=False)
class SlowSearch:
    """One speed in rpm of one tool in one cut; ``stiffest`` is the largest stiffness of the cut in N/m², ``rubs`` that
    of what rubs, in N s/m².
    """

    modes: ToolModel
    cutter: Cutter
    resolved: Shape
    speed: float
    stiffest: float
    rubs: float
    lines: Callable[[int], SideLines]
    """The loop with so many harmonics."""
    by_modes: bool
    """Whether the modes settle it, or the harmonics."""

    @property
    def surely(self) -> float:
        """A depth in m up to which nothing grows: the gain round the loop is below 1 on every line."""
        moved = 2 * np.pi * self.resolved.lines * self.resolved.size
        return 0.9 / (2 * self.stiffest * self.resolved.largest + self.rubs * float(np.max(moved)))

    def first(self, guess: float, reach: float) -> list[Change]:
        """The lowest change up to a depth ``reach`` in m, settled; ``guess`` tells which modes take part at first."""
        highest = self._highest(guess)
        while True:
            marcher = Marcher(self.modes.up_to(highest), self.cutter, self.speed)
            every = changes(marcher, min(self.surely, 0.9 * reach), reach, first=True)
            found = [one for one in every if one.below == 0][:1]
            deeper = self._highest(found[0].crossing.depth if found else reach)
            if deeper <= highest * _HIGHER:
                return [replace(one, crossing=self.settled(one.crossing)) for one in found]
            highest = deeper

    def every(self, deepest: float, limit: float) -> list[Change]:
        """Every change up to a depth in m, settled; nothing grows below the ``limit`` in m."""
        marcher = Marcher(self.modes.up_to(self._highest(deepest)), self.cutter, self.speed)
        found = changes(marcher, min(max(self.surely, _BELOW * limit), 0.9 * deepest), deepest)
        return [replace(one, crossing=self.settled(one.crossing)) for one in found]

    def _highest(self, depth: float) -> float:
        """The highest frequency in Hz at which a vibration could feed itself at a depth in m."""
        strongest = float(self.resolved.lines[np.argmax(self.resolved.size)])
        return max(self.resolved.reaching(GAIN / (2 * self.stiffest * depth)), strongest)

    def settled(self, crossing: Crossing) -> Crossing:
        """The crossing by the method, proved by more modes and nodes or by more harmonics."""
        highest, before = self._highest(crossing.depth), crossing
        for raised in range(1, _RAISES + 1):
            if self.by_modes:
                few, within = self.modes.up_to(highest * FAR**raised), JOINED
                marcher = Marcher(few, self.cutter, self.speed, MORE + FINER * (raised - 1))
                after = settled(marcher, before, _WITHIN)
            else:
                after, within = self._by_harmonics(before, highest * FAR ** (raised - 1)), _AGREE
            if after.kind and abs(after.depth / before.depth - 1) <= within and (self.by_modes or raised > 1):
                return after
            before = after if after.kind else before
        raise CheckFailed(
            f"{'collocation' if self.by_modes else 'multi-frequency'}: at {self.speed:g} rpm the depth, about "
            f"{crossing.depth * 1e3:.3g} mm, still changes with the number of "
            f"{'modes' if self.by_modes else 'harmonics'}"
        )

    def _by_harmonics(self, crossing: Crossing, highest: float) -> Crossing:
        wide = self._wide(highest)
        return zero_near(wide.gap(wide.carried(crossing.fraction, crossing.depth)), crossing, _WITHIN)

    def _wide(self, highest: float) -> WideLines:
        """The loop up to a frequency in Hz."""
        return WideLines(self.lines(int(np.ceil(highest / self.cutter.frequency(self.speed))) + PAST))

    def line(self, crossing: Crossing) -> float:
        """The line, in frequencies of the pattern, at which the tool moves most."""
        wide = self._wide(self._highest(crossing.depth))
        lines, carried = wide.lines, wide.carried(crossing.fraction, crossing.depth)
        return largest_line(crossing.fraction + lines.orders, lines.motion(crossing.fraction, carried))
