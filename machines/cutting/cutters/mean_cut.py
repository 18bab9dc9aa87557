"""Limits of any cutter whose force is taken as its mean: turning, exactly, and zero order in milling, as a preview.

    1 + b·λ(ω) = 0,   λ an eigenvalue of [D·(mean over flutes of 1 − e^(−jωτ_j)) + jω·(C/v)·N]·G,

D and N the means of Σ u·vᵀ and Σ v·vᵀ. For equal pitches and no rubbing it is the loop of `regeneration`; unequal ones
only change the mean of the delays (Altintas, Engin & Budak 1999). In turning with process damping c grows by C·b/v.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError

from ...tool.tool_point import ToolPoint
from ..loops.regeneration import loop_eigenvalues
from ..process.cutter import Cutter

_A_WAVE = 48
"""Frequencies to a wave of the longest delay, on which crossings are looked for."""
_EXACT = 1e-14


def mean_crossings(point: ToolPoint, cutter: Cutter, speed: float) -> list[tuple[float, float, bool]]:
    """Every depth in m at which a vibration keeps itself alive at a speed in rpm, ascending, with its frequency in Hz
    and whether it grows above.

    The tool and the cut move along ``point.axes``; in turning x is along the chip thickness.
    """
    loop = _loop(point, cutter, speed)
    low, high = float(point.lines[0]), float(point.lines[-1])
    longest = max(flute.behind for flute in cutter.flutes) / (2 * np.pi * speed / 60)
    count = int(np.ceil((high - low) * longest * _A_WAVE)) + 2
    lines = np.union1d(point.lines, np.linspace(low, high, count))
    value = loop(lines)
    if value.shape[1] == 2:  # columns exchanged so that each runs on
        straight = np.abs(np.diff(value, axis=0)).sum(axis=1)
        crossed = np.abs(value[1:, ::-1] - value[:-1]).sum(axis=1)
        swapped = np.concatenate([[False], np.cumsum(crossed < straight) % 2 == 1])
        value = np.where(swapped[:, None], value[:, ::-1], value)
    before, after = value[:-1], value[1:]
    crosses = (before.imag * after.imag <= 0) & (np.minimum(before.real, after.real) < 0) & (before != after)
    found = list[tuple[float, float, bool]]()
    for i, branch in zip(*np.nonzero(crosses), strict=True):
        start, end, a, b = before[i, branch], after[i, branch], lines[i], lines[i + 1]

        def on_branch(f: float, start: complex = start, end: complex = end, a: float = a, b: float = b) -> complex:
            expected = start + (end - start) * (f - a) / (b - a)
            values = loop(np.array([f]))[0]
            return complex(values[np.argmin(np.abs(values - expected))])

        if np.sign(on_branch(a).imag) == np.sign(on_branch(b).imag):
            continue
        f = float(scipy.optimize.brentq(lambda f, one=on_branch: one(f).imag, a, b, xtol=_EXACT * b))
        at = on_branch(f)
        if at.real < 0 and abs(at.imag) < 1e-6 * abs(at):
            found.append((-1 / at.real, f, bool(end.imag > start.imag)))
    return sorted(set(found))


def _loop(point: ToolPoint, cutter: Cutter, speed: float) -> Callable[[Array], ComplexArray]:
    """λ in 1/m over frequency in Hz, (nf,) → (nf, n)."""
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

    return loop
