"""The first crossing of the stability boundary at a given spindle speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray

from .chart import Integers
from .regeneration import Trace, deepest, limiting_depth, loop_eigenvalues, wave_fraction
from .tool_point import ToolPoint

_BLOCK = 4_000_000
_ITERATIONS = 80
_TOLERANCE = 1e-13


@dataclass(frozen=True)
class Crossings:
    """Lowest depth (m), its chatter frequency (Hz) and lobe number per speed; inf, nan and −1 where there is none.

    ``unsettled`` counts the roots that did not close on a solution, which a jump in the receptance causes.
    """

    depth: Array
    frequency: Array
    lobe: Integers
    unsettled: int


@dataclass(frozen=True)
class _Brackets:
    """Intervals with a root: rows of the trace between which column ``branch`` gathers ``lobe`` waves."""

    speed: Integers
    row: Integers
    branch: Integers
    lobe: Array


def first_crossings(point: ToolPoint, stiffness: Array, traced: Trace, period: Array) -> Crossings:
    """Solve f·τ = k + ψ(f) for every period τ (s) and take the root of lowest depth.

    The trace only brackets the roots; each is then closed by false position on the receptance itself. Brackets that
    cannot hold the lowest root of their speed are left out beforehand.
    """
    block = max(1, _BLOCK // len(traced.frequency))
    parts = [_solve(point, stiffness, traced, period[start : start + block]) for start in range(0, len(period), block)]
    return Crossings(
        np.concatenate([part.depth for part in parts]),
        np.concatenate([part.frequency for part in parts]),
        np.concatenate([part.lobe for part in parts]),
        sum(part.unsettled for part in parts),
    )


def _solve(point: ToolPoint, stiffness: Array, traced: Trace, period: Array) -> Crossings:
    brackets = _promising(traced, _bracketed(traced, period), len(period))
    frequency, value, settled = _closed(point, stiffness, traced, brackets, period[brackets.speed])
    depth = limiting_depth(value)
    order = np.lexsort((depth, brackets.speed))
    order = order[np.isfinite(depth[order])]
    speeds, first = np.unique(brackets.speed[order], return_index=True)
    root = order[first]
    out = Crossings(
        np.full(len(period), np.inf),
        np.full(len(period), np.nan),
        np.full(len(period), -1, dtype=np.int64),
        int(np.count_nonzero(~settled[root])),
    )
    out.depth[speeds], out.frequency[speeds] = depth[root], frequency[root]
    out.lobe[speeds] = np.rint(frequency[root] * period[speeds] - wave_fraction(value[root])).astype(np.int64)
    return out


def _bracketed(traced: Trace, period: Array) -> _Brackets:
    """Every interval of the trace in which f·τ − ψ(f) passes a whole number, for every period."""
    found = []
    for branch in range(traced.eigenvalue.shape[1]):
        row = np.flatnonzero(deepest(traced.eigenvalue)[:, branch] > 0)
        before, after = traced.eigenvalue[row, branch], traced.eigenvalue[row + 1, branch]
        start = wave_fraction(before)
        end = start + np.angle(after * before.conj()) / np.pi
        low = np.floor(period[:, None] * traced.frequency[row] - start)
        high = np.floor(period[:, None] * traced.frequency[row + 1] - end)
        passed = np.abs(high - low).astype(np.int64)
        speed, column = np.nonzero(passed)
        count = passed[speed, column]
        again = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        lobe = np.repeat(np.minimum(low, high)[speed, column] + 1, count) + again
        speed, column = np.repeat(speed, count), np.repeat(column, count)
        found.append(_Brackets(speed, row[column], np.full(len(speed), branch), lobe))
    return _Brackets(
        np.concatenate([part.speed for part in found]),
        np.concatenate([part.row for part in found]),
        np.concatenate([part.branch for part in found]),
        np.concatenate([part.lobe for part in found]),
    )


def _promising(traced: Trace, brackets: _Brackets, speeds: int) -> _Brackets:
    """Brackets whose lowest conceivable depth is under the highest conceivable one of some other root."""
    before = traced.eigenvalue[brackets.row, brackets.branch]
    after = traced.eigenvalue[brackets.row + 1, brackets.branch]
    step = np.abs(after - before)
    strongest = np.maximum(-before.real, -after.real) + step
    surest = np.minimum(-before.real, -after.real) - step
    threshold = np.full(speeds, -np.inf)
    np.maximum.at(threshold, brackets.speed, np.maximum(surest, 0))
    keep = strongest >= threshold[brackets.speed]
    return _Brackets(brackets.speed[keep], brackets.row[keep], brackets.branch[keep], brackets.lobe[keep])


def _closed(
    point: ToolPoint, stiffness: Array, traced: Trace, brackets: _Brackets, period: Array
) -> tuple[Array, ComplexArray, NDArray[np.bool_]]:
    """Frequency (Hz), eigenvalue (1/m) and success of every root, by the Illinois variant of false position."""
    left, right = traced.frequency[brackets.row].copy(), traced.frequency[brackets.row + 1].copy()
    at_left = traced.eigenvalue[brackets.row, brackets.branch]
    at_right = traced.eigenvalue[brackets.row + 1, brackets.branch]
    chord = (at_right - at_left) / (right - left)
    origin, start = left.copy(), wave_fraction(at_left) + brackets.lobe

    def excess(which: Integers, frequency: Array) -> tuple[Array, ComplexArray]:
        """f·τ − ψ − k and the eigenvalue of the branch, chosen as the one nearest to the chord."""
        values = loop_eigenvalues(stiffness, point(frequency))
        expected = at_left[which] + chord[which] * (frequency - origin[which])
        nearest = np.argmin(np.abs(values - expected[:, None]), axis=1)
        value = values[np.arange(len(which)), nearest]
        turned = np.angle(value * at_left[which].conj()) / np.pi
        return frequency * period[which] - start[which] - turned, value

    everything = np.arange(len(left))
    below = left * period - start
    above = right * period - start - np.angle(at_right * at_left.conj()) / np.pi
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
        scale = np.maximum(1.0, guess * period[active])
        done = np.abs(residual) <= _TOLERANCE * scale
        settled[active] = done
        narrow = np.abs(right[active] - left[active]) <= 4e-16 * guess
        active = active[~(done | narrow)]
    return frequency, value, settled
