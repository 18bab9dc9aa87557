"""The loop on the lines that can chatter: where the receptance is large.

A mode is felt on the harmonics near it, and in a slow cut hundreds of others lie between the modes and beyond them.
With rows and columns of

    A_pq(ω) = H_(p−q)·G(ω + qω_T)

kept where |G| is large somewhere on the line, the strongest eigenvalues are nearly those of the whole loop, for a share
of the work: they tell where it is to be looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Mask
from ...tool.bounded_band import Shape
from .loop_branches import regeneration
from .multi_frequency import HarmonicLoop, coupled

_ASKED = np.linspace(0, 1, 5)
"""Places on a line, in tooth frequencies above its lower end, where |G| is asked for beside those of the `Shape`."""


@dataclass(frozen=True)
class StrongLines:
    """A `HarmonicLoop` of the lines that are ``kept``, shape (2P + 2,) as its `HarmonicLoop.orders`."""

    loop: HarmonicLoop
    kept: Mask

    @property
    def axes(self) -> tuple[int, ...]:
        """The directions that move, 0 for x and 1 for y."""
        return self.loop.axes

    @cached_property
    def orders(self) -> Array:
        """q of the lines kept."""
        return self.loop.orders[self.kept]

    @property
    def size(self) -> int:
        """Rows of its matrices."""
        return len(self.orders) * len(self.axes)

    def lines(self, fraction: Array) -> ComplexArray:
        """G(ω + qω_T) of the lines kept, shape (g, lines, n, n)."""
        return self.loop.receptance((fraction[:, None] + self.orders) * self.loop.tooth_frequency)

    def __call__(self, fraction: Array) -> ComplexArray:
        """H_(p−q)·G(ω + qω_T), shape (g, m, m)."""
        return self.by_lines(fraction)

    def by_lines(self, fraction: Array) -> ComplexArray:
        """The same: it has no other form."""
        return coupled(self.coupling, self.lines(fraction))

    @cached_property
    def coupling(self) -> ComplexArray:
        """H_(p−q) between them."""
        return self.loop.coupling(self.orders)


@dataclass(frozen=True)
class FoldedLines:
    """Strong lines with weaker ones folded in, as they follow at a ``depth`` in m:

    A_ss − depth·(1 − e^(−2πjν))·A_sw·A_ws.

    What the weak lines do to each other is left out.
    """

    strong: StrongLines
    weak: StrongLines
    depth: float

    @property
    def size(self) -> int:
        """Rows of its matrices."""
        return self.strong.size

    def __call__(self, fraction: Array) -> ComplexArray:
        """The loop, shape (g, m, m)."""
        into, back = self._across
        strong, weak = self.strong.lines(fraction), self.weak.lines(fraction)
        around = coupled(into, weak) @ coupled(back, strong)
        followed = self.depth * regeneration(fraction)[:, None, None] * around
        return np.asarray(coupled(self.strong.coupling, strong) - followed)

    @cached_property
    def _across(self) -> tuple[ComplexArray, ComplexArray]:
        """H_(p−q) from the weak lines to the strong ones, and back."""
        loop, strong, weak = self.strong.loop, self.strong.orders, self.weak.orders
        return loop.coupling(strong, weak), loop.coupling(weak, strong)


def strong_lines(loop: HarmonicLoop, resolved: Shape, level: float) -> StrongLines:
    """The lines of a loop that somewhere reach ``level`` (m/N), the mate of each at ν = 1/2 with it."""
    tooth = loop.tooth_frequency
    lower = np.floor(np.abs(loop.orders + 0.5))
    asked = np.interp((lower[:, None] + _ASKED) * tooth, resolved.lines, resolved.size, right=0.0)
    of_line = np.floor(resolved.lines / tooth)
    reached = np.unique(of_line[resolved.size >= level])
    return StrongLines(loop, np.asarray(np.any(asked >= level, axis=1) | np.isin(lower, reached)))


def folded(lines: StrongLines, resolved: Shape, level: float, depth: float) -> FoldedLines:
    """Those of some strong lines that do not reach ``level`` (m/N), folded into the others."""
    strong = strong_lines(lines.loop, resolved, level)
    return FoldedLines(strong, StrongLines(lines.loop, lines.kept & ~strong.kept), depth)
