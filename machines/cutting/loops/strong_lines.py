"""The loop on the lines that can chatter: where the receptance is large.

A mode is felt on the harmonics near it, and in a slow cut hundreds of others lie between the modes and beyond them.
With rows and columns of

    A_pq(ω) = H_(p−q)·G(ω + qω_T)

kept where a force on the line along one axis moves the tool far, the strongest eigenvalues are nearly those of the
whole loop, for a share of the work: they tell where it is to be looked at. A mode moves the tool along few axes, and so
few lines are kept for more than one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ...indices import Index, Mask
from ...tool.bounded_band import Shape
from .loop_branches import regeneration
from .multi_frequency import HarmonicLoop

_ASKED = np.linspace(0, 1, 5)
"""Places on a line, in tooth frequencies above its lower end, where |G| is asked for beside those of the `Shape`."""


@dataclass(frozen=True)
class StrongLines:
    """A `HarmonicLoop` of the lines and directions of force that are ``kept``, shape (2P + 2, n)."""

    loop: HarmonicLoop
    kept: Mask

    @cached_property
    def rows(self) -> tuple[Array, Index]:
        """q of every row, and its direction."""
        line, axis = np.nonzero(self.kept)
        return self.loop.orders[line], axis

    @property
    def size(self) -> int:
        """Rows of its matrices."""
        return int(np.count_nonzero(self.kept))

    def moved(self, fraction: Array) -> ComplexArray:
        """What a force on each row moves, the columns of G(ω + qω_T), shape (g, m, n)."""
        q, axis = self.rows
        some, of_row = np.unique(q, return_inverse=True)
        lines = self.loop.receptance((fraction[:, None] + some) * self.loop.tooth_frequency)
        return np.asarray(lines[:, of_row, :, axis].swapaxes(0, 1))

    def __call__(self, fraction: Array) -> ComplexArray:
        """H_(p−q)·G(ω + qω_T), shape (g, m, m)."""
        return self.by_lines(fraction)

    def by_lines(self, fraction: Array) -> ComplexArray:
        """The same: it has no other form."""
        return _fed(self._among, self.moved(fraction))

    @cached_property
    def _among(self) -> ComplexArray:
        return coupling(self, self)


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
        among, into, back = self._across
        strong, weak = self.strong.moved(fraction), self.weak.moved(fraction)
        around = _fed(into, weak) @ _fed(back, strong)
        around *= -self.depth * regeneration(fraction)[:, None, None]
        return np.asarray(around + _fed(among, strong))

    @cached_property
    def _across(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H_(p−q) among the strong lines, from the weak ones to them, and back."""
        strong, weak = self.strong, self.weak
        return coupling(strong, strong), coupling(strong, weak), coupling(weak, strong)


def coupling(into: StrongLines, out_of: StrongLines) -> ComplexArray:
    """H_(p−q) from a motion in any direction on the lines of some rows to other rows, (rows, others, n)."""
    (p, axis), (q, _) = into.rows, out_of.rows
    apart = (p[:, None] - q).astype(int)
    reach = int(np.max(np.abs(apart), initial=0))
    return np.asarray(into.loop.of_cut(reach)[apart + reach, axis[:, None]])


def _fed(coupling: ComplexArray, moved: ComplexArray) -> ComplexArray:
    """Force that comes back for a force on each row, (g, m, k), of H (m, k, n) and G (g, k, n)."""
    total = coupling[..., 0] * moved[:, None, :, 0]
    for axis in range(1, moved.shape[2]):
        total += coupling[..., axis] * moved[:, None, :, axis]
    return np.asarray(total)


def strong_lines(loop: HarmonicLoop, resolved: Shape, level: float) -> StrongLines:
    """The lines of a loop on which a force along an axis somewhere moves the tool by ``level`` (m/N), the mate of each
    at ν = 1/2 with it.
    """
    tooth = loop.tooth_frequency
    lower = np.floor(np.abs(loop.orders + 0.5))
    of_line, places = np.floor(resolved.every / tooth), (lower[:, None] + _ASKED) * tooth
    kept = np.empty((len(lower), resolved.columns.shape[1]), dtype=bool)
    for axis, size in enumerate(resolved.columns.T):
        asked = np.interp(places, resolved.every, size, right=0.0)
        reached = np.unique(of_line[size >= level])
        kept[:, axis] = np.any(asked >= level, axis=1) | np.isin(lower, reached)
    return StrongLines(loop, kept)


def folded(lines: StrongLines, resolved: Shape, level: float, depth: float) -> FoldedLines:
    """Those of some strong lines that do not reach ``level`` (m/N), folded into the others."""
    strong = strong_lines(lines.loop, resolved, level)
    return FoldedLines(strong, StrongLines(lines.loop, lines.kept & ~strong.kept), depth)
