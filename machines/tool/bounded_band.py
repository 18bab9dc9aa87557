"""A receptance at any frequency: what is assumed where its band ends, and what that may cost."""

from __future__ import annotations

from bisect import bisect
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import FrequencyMismatch

from .tool_point import ToolPoint

_ROUNDS = 8
_STEP = 0.3
_WEAK = 0.02
"""Share of the largest receptance below which a line does not decide how many harmonics are needed."""
_FAINT = 1e-3
_CLOSE = 0.5
"""Share of the spacing of two lines within which a ν that another line asks for serves them too."""


@dataclass(frozen=True)
class Spectrum:
    """G(f) for f of either sign. Past the last known line it goes on as a mass, below the first one as one mode does.

    ``known`` is (lowest, highest) frequency in Hz at which it is known. With ``carried_on`` false the receptance is
    zero above and constant below, which tells what the assumption is worth.
    """

    point: ToolPoint
    known: tuple[float, float]
    carried_on: bool = True

    def __call__(self, frequency: Array) -> ComplexArray:
        f = np.abs(frequency).ravel()
        low, high = self.known
        G = self.point(np.clip(f, low, high))
        above, below = f > high, f < low
        if self.carried_on:
            for outside, edge, inward in ((above, high, 1 / 1.1), (below, low, 1.1)):
                if outside.any():
                    last, before = self._at_ends[edge]
                    G[outside] = carried(last, before, f[outside] / edge, inward)
        else:
            G[above] = 0.0
            G[below] = G[below].real
        G = np.where((frequency.ravel() < 0)[:, None, None], G.conj(), G)
        return np.asarray(G.reshape(*frequency.shape, *G.shape[1:]))

    @cached_property
    def _at_ends(self) -> dict[float, Array]:
        """Re G at either end of what is known, and a tenth inward."""
        low, high = self.known
        ends = ((low, 1.1), (high, 1 / 1.1))
        return {edge: self.point(np.array([edge, edge * inward])).real for edge, inward in ends}


def carried(last: Array, before: Array, ratio: Array, inward: float) -> Array:
    """1/G of every entry straight in f², as a spring with a mass has it, from the last tenth of the band on.

    ``last`` is Re G at the edge of the band and ``before`` at ``inward`` times that, (…, n, n); ``ratio`` (…) are the
    frequencies over the edge. Where that would put a resonance outside the band, or the entry changes sign, it is a
    mass above the band and a spring below it.
    """
    steady = (last * before > 0) & (np.abs(last) <= np.abs(before))
    start = 1 / np.where(steady, last, 1.0)
    slope = (1 / np.where(steady, before, 1.0) - start) / (inward**2 - 1)
    square = (ratio**2)[..., None, None]
    inverse = np.where(steady, start + slope * (square - 1), 1.0)
    return np.where(steady, 1 / inverse, last / np.maximum(square, 1.0))


def spectrum(point: ToolPoint, highest: float) -> Spectrum:
    """The receptance of a tool point up to ``highest`` Hz: a function is asked there, samples are carried on."""
    if not point.sampled:
        try:
            point(np.array([1e-3 * point.lines[0], highest]))
        except FrequencyMismatch:
            pass
        else:
            return Spectrum(point, (0.0, np.inf))
    return Spectrum(point, (float(point.lines[0]), float(point.lines[-1])))


@dataclass(frozen=True)
class Shape:
    """Lines in Hz between which G turns by less than a third, and its norm in m/N there."""

    lines: Array
    size: Array
    every: Array
    """Lines in Hz that hold these and more, on which every resonance is seen."""
    columns: Array
    """Norm of G there under a force along each axis, (lines, n)."""

    @property
    def highest(self) -> float:
        """The highest frequency in Hz at which the receptance is more than a fiftieth of its largest."""
        return self.reaching(_WEAK * self.largest)

    @property
    def largest(self) -> float:
        """The largest receptance in m/N."""
        return float(np.max(self.size))

    def reaching(self, level: float) -> float:
        """The highest frequency in Hz at which the receptance is at least ``level`` (m/N); 0 where it never is."""
        return float(np.max(self.lines[self.size >= level], initial=0.0))

    def folded(self, tooth_frequency: float, level: float | None = None) -> Array:
        """ν = ω/ω_T in (0, 1/2], ascending, between which G turns on no line by more than about a third.

        Lines count from a receptance of ``level`` (m/N) on, by default a thousandth of the largest. The last ν is 1/2.
        """
        worth = self.size >= (_FAINT * self.largest if level is None else level)
        order = np.mod(self.lines[worth] / tooth_frequency, 1.0)
        order = np.minimum(order, 1 - order)
        gap = np.diff(self.lines, prepend=-np.inf, append=np.inf)
        step = np.minimum(gap[:-1], gap[1:])[worth] / tooth_frequency
        chosen: list[float] = []  # ascending
        close = np.argsort(step)  # those that stand close first; others only where none of these is near
        for one, apart in zip(order[close].tolist(), (_CLOSE * step[close]).tolist(), strict=True):
            at = bisect(chosen, one)
            if all(abs(one - other) >= apart for other in chosen[max(at - 1, 0) : at + 1]):
                chosen.insert(at, one)
        nu = np.concatenate([chosen, np.linspace(0.04, 0.46, 12), [1e-3, 0.01, 0.49, 0.499]])
        nu = np.unique(np.round(nu, 7))
        nu = nu[(nu >= 1e-4) & (nu < 0.5 - 1e-6)]
        return np.append(nu, 0.5)


@lru_cache(maxsize=8)
def shape(point: ToolPoint) -> Shape:
    """Halve the lines of a tool point until the receptance turns by less than a third of itself between them."""
    f = point.lines
    G = point(f)
    for _ in range(_ROUNDS):
        size = np.linalg.norm(G, axis=(1, 2))
        step = np.linalg.norm(np.diff(G, axis=0), axis=(1, 2))
        floor = _FAINT * np.max(size)
        coarse = (step > _STEP * np.minimum(size[1:], size[:-1])) & (np.maximum(size[1:], size[:-1]) > floor)
        if not coarse.any():
            break
        middle = (f[:-1][coarse] + f[1:][coarse]) / 2
        order = np.argsort(np.concatenate([f, middle]), kind="stable")
        G = np.concatenate([G, point(middle)])[order]
        f = np.concatenate([f, middle])[order]
    size = np.linalg.norm(G, axis=(1, 2))
    return _thinned(f, G, size)


def _thinned(f: Array, G: ComplexArray, size: Array) -> Shape:
    """Leave out lines from which the receptance has hardly turned."""
    kept = [0]
    for i in range(1, len(f)):
        if np.linalg.norm(G[i] - G[kept[-1]]) > _STEP * min(size[i], size[kept[-1]]) or i == len(f) - 1:
            kept.append(i)
    return Shape(f[kept], size[kept], f, np.linalg.norm(G, axis=1))
