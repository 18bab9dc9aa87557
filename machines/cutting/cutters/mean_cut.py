"""Limits of any cutter whose force is taken as its mean: turning, exactly, and zero order in milling, as a preview.

    1 + b·λ(ω) = 0,   λ an eigenvalue of [D·(mean over flutes of 1 − e^(−jωτ_j)) + jω·(C/v)·N]·G,

D and N the means of Σ u·vᵀ and Σ v·vᵀ. For equal pitches and no rubbing it is the loop of `regeneration`; unequal ones
only change the mean of the delays (Altintas, Engin & Budak 1999). In turning with process damping c grows by C·b/v.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ...indices import Mask
from ...tool.bounded_band import Shape
from ...tool.tool_point import ToolPoint
from ..loops.regeneration import loop_eigenvalues
from ..process.cutter import Cutter

_A_WAVE = 48
"""Frequencies to a wave of the longest delay, on which crossings are looked for."""
_EXACT = 1e-14
_LEVEL = 1e-9
_WEAK = (0.5, 0.1, 0.02)
"""Shares of the largest receptance, up to the last line of which the lowest depth is looked for first."""
_BETWEEN = 1.5
"""Times the larger receptance of two lines of a `Shape` up to which that between them goes."""
_TURNS, _BISECTED = 100, 6
"""Steps towards a crossing at most, and at every how many the interval is halved instead."""


def mean_crossings(
    point: ToolPoint, cutter: Cutter, speed: float, deepest: float, seen: Shape
) -> list[tuple[float, float, bool]]:
    """Every depth in m at which a vibration keeps itself alive at a speed in rpm, ascending, with its frequency in Hz
    and whether it grows above; up to a ``deepest``, of which 0 asks for the lowest alone.

    The tool and the cut move along ``point.axes``; in turning x is along the chip thickness. By the lines on which the
    tool is ``seen`` no frequency is asked above those at which |λ| ≤ (2·|D| + ω·(C/v)·|N|)·|G| may bring the depth down
    to those asked for: a machine has modes far above all that chatters.
    """
    loop, stiffest = _loop(point, cutter, speed)
    low, high = float(point.lines[0]), float(point.lines[-1])
    longest = max(flute.behind for flute in cutter.flutes) / (2 * np.pi * speed / 60)
    count = int(np.ceil((high - low) * longest * _A_WAVE)) + 2
    strong = _BETWEEN * stiffest(seen.lines) * seen.size
    strong = np.maximum(strong, np.append(strong[1:], 0))  # up to the next line

    def lines(wanted: Mask) -> Array:
        """Those up to the last one that is wanted."""
        last = np.flatnonzero(wanted)
        ends = seen.lines[min(last[-1] + 1, len(seen.lines) - 1)] if len(last) else low
        step = (high - low) / (count - 1)
        even = low + step * np.arange(min(count, int((ends - low) / step) + 3))
        every = np.union1d(point.lines, np.minimum(even, high))
        return every[: int(np.searchsorted(every, ends, side="right")) + 1]

    if deepest:
        return _crossings(loop, lines(strong * deepest >= 1), deepest)
    # The lowest where the tool is flexible tells up to where a lower one may lie.
    for share in _WEAK:
        first = _crossings(loop, lines(seen.size >= share * np.max(seen.size)), 0.0)
        if first:
            return _crossings(loop, lines(strong * first[0][0] >= 1), 0.0)
    return _crossings(loop, np.union1d(point.lines, np.linspace(low, high, count)), 0.0)


def _crossings(loop: Callable[[Array], ComplexArray], lines: Array, deepest: float) -> list[tuple[float, float, bool]]:
    """`mean_crossings` on some lines in Hz."""
    value = loop(lines)
    if value.shape[1] == 2:  # columns exchanged so that each runs on
        straight = np.abs(np.diff(value, axis=0)).sum(axis=1)
        crossed = np.abs(value[1:, ::-1] - value[:-1]).sum(axis=1)
        swapped = np.concatenate([[False], np.cumsum(crossed < straight) % 2 == 1])
        value = np.where(swapped[:, None], value[:, ::-1], value)
    before, after = value[:-1], value[1:]
    crosses = (before.imag * after.imag <= 0) & (np.minimum(before.real, after.real) < 0) & (before != after)
    i, branch = np.nonzero(crosses)
    start, end, a, b = before[i, branch], after[i, branch], lines[i], lines[i + 1]
    # A crossing lies between the ends of its piece, or beyond by no more than they are apart.
    surely, perhaps = np.minimum(-start.real, -end.real), np.maximum(-start.real, -end.real) + np.abs(end - start)
    level = 1 / deepest if deepest else np.max(surely, initial=0.0)
    worth = perhaps >= level
    start, end, a, b = start[worth], end[worth], a[worth], b[worth]

    def on_branch(f: Array, some: Mask) -> ComplexArray:
        expected = start[some] + (end - start)[some] * (f - a[some]) / (b - a)[some]
        values = loop(f)
        nearest = np.argmin(np.abs(values - expected[:, None]), axis=1)
        return np.asarray(np.take_along_axis(values, nearest[:, None], axis=1)[:, 0])

    f, at, kept = _closed(on_branch, a, b)
    kept &= (at.real < 0) & (np.abs(at.imag) < 1e-6 * np.abs(at))
    rising = end.imag > start.imag
    every = zip(at[kept], f[kept], rising[kept], strict=True)
    found = sorted({(-1 / float(value.real), float(hertz), bool(up)) for value, hertz, up in every})
    if deepest:
        return [one for one in found if one[0] <= deepest]
    if level and not (found and found[0][0] * level <= 1 + _LEVEL):  # what bounded it was no crossing
        return _crossings(loop, lines, np.inf)[:1]
    return found[:1]


def _closed(
    on_branch: Callable[[Array, Mask], ComplexArray], low: Array, high: Array
) -> tuple[Array, ComplexArray, Mask]:
    """Where Im λ is zero between frequencies, λ there, and whether it changes sign between them at all.

    All at once, by false position with the weight of an end that stays halved (Illinois), bisected where that is slow.
    """
    every = np.ones(len(low), dtype=bool)
    left, right = low.copy(), high.copy()
    at = on_branch(right, every)
    below, above = on_branch(left, every).imag, at.imag.copy()
    kept = np.sign(below) != np.sign(above)
    f, open_ = right.copy(), kept & (above != 0)
    for turn in range(_TURNS):
        if not open_.any():
            break
        l, r, fl, fr = left[open_], right[open_], below[open_], above[open_]
        new = (l + r) / 2 if turn % _BISECTED == _BISECTED - 1 else r - fr * (r - l) / (fr - fl)
        new = np.clip(np.where(np.isfinite(new), new, (l + r) / 2), np.minimum(l, r), np.maximum(l, r))
        value = on_branch(new, open_)
        passed = np.sign(value.imag) != np.sign(fr)
        left[open_], below[open_] = np.where(passed, r, l), np.where(passed, fr, fl / 2)
        f[open_], right[open_], above[open_], at[open_] = new, new, value.imag, value
        done = (value.imag == 0) | (np.abs(left[open_] - new) <= _EXACT * np.abs(new))
        done |= np.abs(value.imag) <= _EXACT * np.abs(value)
        open_[np.flatnonzero(open_)[done]] = False
    return f, at, kept


def _loop(
    point: ToolPoint, cutter: Cutter, speed: float
) -> tuple[Callable[[Array], ComplexArray], Callable[[Array], Array]]:
    """λ in 1/m over frequency in Hz, (nf,) → (nf, n); how many times |G| it is at most, N/m², (nf,)."""
    if any(flute.spread for flute in cutter.flutes):
        raise InputError(
            "zero-order: the flutes have different helices, so the delays change along the depth, expected one helix; "
            "take multi-frequency or collocation"
        )
    turning, rubbing = 2 * np.pi * speed / 60, cutter.rubbing(speed)
    late = np.array([flute.behind for flute in cutter.flutes]) / turning
    if cutter.cutting.process == "milling":
        rows = np.ix_(*(["xy".index(axis) for axis in point.axes],) * 2)
        D, N = (np.real(part[0][rows]) / cutter.pattern * len(late) for part in cutter.harmonics(np.zeros(1)))
    else:
        D, N = cutter.cutting.mean_stiffness, np.ones((1, 1))

    def loop(f: Array) -> ComplexArray:
        omega = 2 * np.pi * f
        delayed = np.mean(1 - np.exp(-1j * omega[:, None] * late), axis=1)
        K = D * delayed[:, None, None] + 1j * omega[:, None, None] * rubbing * N
        return loop_eigenvalues(K, point(f))

    stiff, rubs = float(np.linalg.norm(D)), float(rubbing * np.linalg.norm(N))
    return loop, lambda f: 2 * stiff + 2 * np.pi * f * rubs
