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
        return coupled(self._coupled, self.lines(fraction))

    @cached_property
    def _coupled(self) -> ComplexArray:
        return self.loop.coupling(self.orders)


def strong_lines(loop: HarmonicLoop, resolved: Shape, level: float) -> StrongLines:
    """The lines of a loop that somewhere reach ``level`` (m/N), the mate of each at ν = 1/2 with it."""
    tooth = loop.tooth_frequency
    lower = np.floor(np.abs(loop.orders + 0.5))
    asked = np.interp((lower[:, None] + _ASKED) * tooth, resolved.lines, resolved.size, right=0.0)
    of_line = np.floor(resolved.lines / tooth)
    reached = np.unique(of_line[resolved.size >= level])
    return StrongLines(loop, np.asarray(np.any(asked >= level, axis=1) | np.isin(lower, reached)))
