"""The first crossing of the stability boundary at given spindle speeds, of one tool or of several at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray

from ...indices import Index, Mask
from ..process.chart import Integers
from .regeneration import Loops, Trace, limiting_depth, reaching, wave_fraction

_BLOCK = 4_000_000
_CACHED = 2**16
"""Entries worked on at once, so few that they stay in the processor's cache."""
_ITERATIONS = 80
_TOLERANCE = 1e-13
_KEYS = ("speed", "row", "branch", "lobe")


@dataclass(frozen=True, eq=False)
class Crossings:
    """Lowest depth (m), its chatter frequency (Hz) and lobe number per tool and speed; inf, nan and −1 where none is.

    ``unsettled`` counts, per tool, the roots that did not close on a solution, which a jump in the receptance causes.
    """

    depth: Array
    frequency: Array
    lobe: Integers
    unsettled: Index


@dataclass(frozen=True, eq=False)
class Brackets:
    """Intervals with a root: rows of the trace between which column ``branch`` gathers ``lobe`` waves.

    ``speed`` counts the periods of all tools, tool by tool.
    """

    speed: Index
    row: Index
    branch: Index
    lobe: Array

    def __getitem__(self, which: Mask) -> Brackets:
        return Brackets(*(getattr(self, key)[which] for key in _KEYS))


def first_crossings(loops: Loops, traced: Trace, period: Array) -> Crossings:
    """Solve f·τ = k + ψ(f) for every period τ in s, (tools, speeds), and take the root of lowest depth.

    The trace only brackets the roots; each is then closed by false position on the receptance itself. Brackets that
    cannot hold the lowest root of their speed are left out beforehand.
    """
    together = max(1, _BLOCK // len(traced.frequency))
    starts = range(0, period.shape[1], together)
    parts = [_lowest(loops, traced, period[:, start : start + together]) for start in starts]
    return Crossings(
        np.concatenate([part.depth for part in parts], axis=1),
        np.concatenate([part.frequency for part in parts], axis=1),
        np.concatenate([part.lobe for part in parts], axis=1),
        np.sum([part.unsettled for part in parts], axis=0),
    )


def _lowest(loops: Loops, traced: Trace, period: Array) -> Crossings:
    found = brackets(traced, period, lambda passed: _promising(traced, passed, period.size))
    frequency, value, settled = closed(loops, traced, found, period)
    depth = limiting_depth(value)
    order = np.lexsort((depth, found.speed))
    order = order[np.isfinite(depth[order])]
    speeds, first = np.unique(found.speed[order], return_index=True)
    root = order[first]
    out = Crossings(
        np.full(period.shape, np.inf),
        np.full(period.shape, np.nan),
        np.full(period.shape, -1, dtype=np.int64),
        np.bincount(speeds[~settled[root]] // period.shape[1], minlength=len(period)),
    )
    out.depth.flat[speeds], out.frequency.flat[speeds] = depth[root], frequency[root]
    waves = frequency[root] * period.flat[speeds] - wave_fraction(value[root])
    out.lobe.flat[speeds] = np.rint(waves).astype(np.int64)
    return out


def brackets(traced: Trace, period: Array, matter: Callable[[Brackets], Mask]) -> Brackets:
    """Every interval of the trace in which f·τ − ψ(f) passes a whole number, for every period, (tools, speeds).

    ``matter`` says which intervals are of interest, asked with the lowest whole number of each: where the modes lie far
    above the teeth an interval may hold thousands.
    """
    speeds, f, found, counts = period.shape[1], traced.frequency, list[Brackets](), list[Index]()
    for branch, reached in enumerate(reaching(traced).T):
        every = np.flatnonzero(reached)
        before, after = traced.eigenvalue[every, branch], traced.eigenvalue[every + 1, branch]
        start = wave_fraction(before)
        end = start + np.angle(after * before.conj()) / np.pi
        together = max(1, _CACHED // speeds)
        for part in range(0, len(every), together):
            rows = slice(part, part + together)
            row = every[rows]
            tau = period[traced.tool[row]]
            low = np.floor(tau * f[row][:, None] - start[rows, None])
            high = np.floor(tau * f[row + 1][:, None] - end[rows, None])
            at, speed = np.nonzero(low != high)
            low, high = low[at, speed], high[at, speed]
            speed = traced.tool[row[at]] * speeds + speed
            found.append(Brackets(speed, row[at], np.full(len(at), branch), np.minimum(low, high) + 1))
            counts.append(np.abs(high - low).astype(np.intp))
    if not found:
        none = np.zeros(0, dtype=np.intp)
        return Brackets(none, none, none, np.zeros(0))
    passed = Brackets(*(np.concatenate([getattr(one, key) for one in found]) for key in _KEYS))
    kept = matter(passed)
    count = np.concatenate(counts)[kept]
    again = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    first = passed[kept]
    one = Brackets(*(np.repeat(getattr(first, key), count) for key in _KEYS))
    return replace(one, lobe=one.lobe + again)


def _promising(traced: Trace, found: Brackets, speeds: int) -> Mask:
    """Whether the lowest conceivable depth of a bracket is under the highest conceivable one of some other root."""
    before = traced.eigenvalue[found.row, found.branch]
    after = traced.eigenvalue[found.row + 1, found.branch]
    step = np.abs(after - before)
    strongest = np.maximum(-before.real, -after.real) + step
    surest = np.minimum(-before.real, -after.real) - step
    threshold = np.full(speeds, -np.inf)
    np.maximum.at(threshold, found.speed, np.maximum(surest, 0))
    return np.asarray(strongest >= threshold[found.speed])


def closed(
    loops: Loops, traced: Trace, brackets: Brackets, period: Array
) -> tuple[Array, ComplexArray, NDArray[np.bool_]]:
    """Frequency (Hz), eigenvalue (1/m) and success of every root, by the Illinois variant of false position."""
    left, right = traced.frequency[brackets.row], traced.frequency[brackets.row + 1]
    tool, tau = traced.tool[brackets.row], period.ravel()[brackets.speed]
    at_left = traced.eigenvalue[brackets.row, brackets.branch]
    at_right = traced.eigenvalue[brackets.row + 1, brackets.branch]
    chord = (at_right - at_left) / (right - left)
    origin, start = left.copy(), wave_fraction(at_left) + brackets.lobe

    def excess(which: Index, frequency: Array) -> tuple[Array, ComplexArray]:
        """f·τ − ψ − k and the eigenvalue of the branch, chosen as the one nearest to the chord."""
        values = loops(frequency, tool[which])
        expected = at_left[which] + chord[which] * (frequency - origin[which])
        nearest = np.argmin(np.abs(values - expected[:, None]), axis=1)
        value = values[np.arange(len(which)), nearest]
        turned = np.angle(value * at_left[which].conj()) / np.pi
        return frequency * tau[which] - start[which] - turned, value

    everything = np.arange(len(left))
    below = left * tau - start
    above = right * tau - start - np.angle(at_right * at_left.conj()) / np.pi
    take_right = above == 0
    frequency, value = np.where(take_right, right, left), np.where(take_right, at_right, at_left)
    settled = take_right | (below == 0)
    active = everything[~settled]
    for _ in range(_ITERATIONS):
        if active.size == 0:
            break
        a, b, fa, fb = left[active], right[active], below[active], above[active]
        guess = np.clip(b - fb * (b - a) / (fb - fa), np.minimum(a, b), np.maximum(a, b))
        residual, new = excess(active, guess)
        frequency[active], value[active] = guess, new
        same_side = np.sign(residual) == np.sign(fb)
        left[active], below[active] = np.where(same_side, a, b), np.where(same_side, fa / 2, fb)
        right[active], above[active] = guess, residual
        scale = np.maximum(1.0, guess * tau[active])
        done = np.abs(residual) <= _TOLERANCE * scale
        settled[active] = done
        narrow = np.abs(right[active] - left[active]) <= 4e-16 * guess
        active = active[~(done | narrow)]
    return frequency, value, settled
