"""Peaks of the tool: where a force on it moves it most, by direction, with the contact that moves most there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..indices import Index
from ..operating.branches import Branch, Stability
from ..operating.peaks import local_maxima
from .response import Response

_LOPSIDED = 2.0
"""Ratio of the two halves of a half-power width above which it is no measure of damping."""
_ALIKE = 1e-6
"""Of the largest motion: contacts that move alike, of which the first is named."""
_FEWEST = 4
"""Lines inside a half-power width below which it is not resolved."""


@dataclass(frozen=True)
class ToolPeak:
    """A maximum of |x/F| over frequency, on what a force at rest or swept slowly can reach."""

    force: float
    """N, peak."""
    drive: str
    output: str
    frequency: float
    """Hz."""
    compliance: float
    """|x/F| in m/N."""
    damping_ratio: float
    """From the half-power width; nan where the peak has none that tells it: it overlaps another, leans, or jumps."""
    connection: str
    """The one whose relative displacement is largest there, angles beside none; empty where none is flexible."""
    error: float
    """Estimated relative error there because of the harmonics that were left out; nan where it cannot be told."""
    held: float = 0.0
    """Relative change there that a force held by sliders can make at most; nan where it cannot be told."""


def tool_peaks(result: Response, outputs: Sequence[str] | None = None) -> tuple[ToolPeak, ...]:
    """Peaks at ``outputs`` (default: where the force acts if that is one of them, else all), by force and frequency.

    They are those of the largest solution on each line that is not known to be unstable; between lines the frequency
    is that of the parabola through 1/|x/F|² at three of them.
    """
    chosen = outputs or ([result.drive] if result.drive in result.outputs else list(result.outputs))
    return tuple(
        peak
        for force, branches in zip(result.force, result.branches, strict=True)
        for output in chosen
        for peak in _peaks(result, force, branches, output)
    )


def _peaks(result: Response, force: float, branches: Sequence[Branch], output: str) -> Iterator[ToolPeak]:
    o = result.outputs.index(output)
    lines = np.unique(np.concatenate([branch.frequency for branch in branches])) if branches else np.empty(0)
    size = np.full(len(lines), np.nan)
    straight = np.array([name not in result.turned for name in result.connections], dtype=bool)
    counts = straight if np.any(straight) else ~straight
    mover, error, held = np.full(len(lines), -1), np.full(len(lines), np.nan), np.zeros(len(lines))
    owner, place = np.full(len(lines), -1), np.full(len(lines), -1)
    for n, branch in enumerate(branches):
        # Branches side by side have points of their own: each counts between them as well.
        at = np.flatnonzero((lines >= branch.frequency[0]) & (lines <= branch.frequency[-1]))
        value = np.interp(lines[at], branch.frequency, np.abs(branch.output[:, o]) / force)
        row = _nearest(branch.frequency, lines[at])
        better = _reached(branch)[row] & ~(value <= np.nan_to_num(size[at], nan=-1.0))
        at, value, row = at[better], value[better], row[better]
        size[at], owner[at], place[at] = value, n, row
        error[at] = branch.error[row] if branch.error.size else np.nan
        held[at] = branch.held[row] if branch.held.size else 0.0
        if branch.joint.shape[1]:
            moved = np.where(counts, np.abs(branch.joint[row]), 0.0)
            mover[at] = np.argmax(moved >= (1 - _ALIKE) * np.max(moved, axis=1, keepdims=True), axis=1)
    known = np.isfinite(size) & (size > 0)
    lines, size, mover, error, held = (part[known] for part in (lines, size, mover, error, held))
    owner, place = owner[known], place[known]
    for k in local_maxima(size):
        own = branches[owner[k]]
        frequency, compliance = _top(own.frequency, np.abs(own.output[:, o]) / force, int(place[k]))
        name = result.connections[mover[k]] if mover[k] >= 0 else ""
        damping = half_power_damping(lines, size, int(k), frequency, compliance)
        yield ToolPeak(
            force, result.drive, output, frequency, compliance, damping, name, *map(float, (error[k], held[k]))
        )


def _nearest(frequency: Array, lines: Array) -> Index:
    """The point that lies nearest to each line."""
    after = np.clip(np.searchsorted(frequency, lines), 1, max(len(frequency) - 1, 1))
    after = np.minimum(after, len(frequency) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(lines - frequency[before] < frequency[after] - lines, before, after)


def _reached(branch: Branch) -> Array:
    """Points that are not known to be unstable."""
    labels = branch.labels or (branch.stability,) * len(branch.frequency)
    return np.array([label is not Stability.UNSTABLE for label in labels])


def _top(lines: Array, size: Array, k: int) -> tuple[float, float]:
    """Minimum of the parabola through 1/|x/F|² at three points of a branch; the point itself where there is none
    between them, or the branch ends."""
    if not 0 < k < len(lines) - 1 or not lines[k - 1] < lines[k] < lines[k + 1]:
        return float(lines[k]), float(size[k])
    f, y = lines[k - 1 : k + 2], size[k - 1 : k + 2] ** -2.0
    curve = np.polyfit(f - f[1], y, 2)
    shift = -curve[1] / (2 * curve[0]) if curve[0] > 0 else np.inf
    lowest = float(np.polyval(curve, shift)) if f[0] <= f[1] + shift <= f[2] else 0.0
    if not lowest > 0:  # lines so wide apart that the parabola dips below nothing say no more than they do
        return float(f[1]), float(size[k])
    return float(f[1] + shift), lowest**-0.5


def half_power_damping(lines: Array, size: Array, k: int, frequency: float, compliance: float) -> float:
    """ζ of one mode with its top at the line k, nan where nothing tells it.

    Its half-power points r² = 1 − 2ζ² ± 2ζ√(1 − ζ²) give tan 2θ with ζ = sin θ.
    """
    ends = []
    for step in (-1, 1):
        i = k
        while 0 <= i + step < len(size) and size[i] > compliance / np.sqrt(2):
            if size[i + step] > size[i]:
                return np.nan
            i += step
        if size[i] > compliance / np.sqrt(2):
            return np.nan
        a, b = size[i - step] ** -2.0, size[i] ** -2.0
        # 1/|x/F|² of one mode is a parabola about its top, so a straight line over the square of the distance from it.
        near, far = (lines[i - step] - frequency) ** 2, (lines[i] - frequency) ** 2
        ends.append((i, frequency + step * np.sqrt(near + (2 * compliance**-2.0 - a) / (b - a) * (far - near))))
    (i, low), (j, high) = ends
    halves = sorted((frequency - low, high - frequency))
    if j - i - 1 < _FEWEST or halves[0] * _LOPSIDED < halves[1]:
        return np.nan
    return float(np.sin(np.arctan((high**2 - low**2) / (high**2 + low**2)) / 2))
