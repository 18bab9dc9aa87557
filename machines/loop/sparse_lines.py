"""Peaks of a measured frequency response on which too few lines stand to tell their damping."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..components.interpolation import wide

_LINES = 2.0
"""In a half-power bandwidth, below which they are few."""
_LARGE = 0.1
"""Of the largest |H|; peaks below it decide little."""


def sparse_lines(frequency: Array, H: ComplexArray) -> list[str]:
    """A sentence on the large peak in whose half-power bandwidth the fewest lines stand, where they are fewer than two.

    Near one mode 1/H is a straight line over frequency, which two lines tell, however far apart: it is zero at the pole
    f(1 + jζ), and the bandwidth is 2ζf. Of the intervals on both sides of the top the one that tells the wider counts,
    so that a jump of the response, as beside a fold, is not taken for a narrow peak.
    """
    if len(H) < 3:
        return []
    size, turns = np.abs(H), wide(H)
    inner = np.arange(1, len(H) - 1)
    tops = inner[
        (size[inner] >= np.maximum(size[inner - 1], size[inner + 1]))
        & (size[inner] > _LARGE * np.max(size))
        & (turns[inner - 1] | turns[inner])
    ]
    found = []
    for i in tops:
        step = float(frequency[i + 1] - frequency[i - 1]) / 2
        poles = [_pole(frequency[j : j + 2], H[j : j + 2]) for j in (i - 1, i)]
        width = max((2 * abs(p.imag) for p in poles if abs(p.real - frequency[i]) < step), default=0.0)
        if width:
            found.append((width / step, width, step, float(frequency[i])))
    count, width, step, at = min(found, default=(_LINES, 0.0, 0.0, 0.0))
    if count >= _LINES:
        return []
    return [
        f"at its peak at {at:.5g} Hz {count:.2g} lines stand in the half-power bandwidth of {width:.3g} Hz, being "
        f"{step:.3g} Hz apart: its damping rests on them alone, and noise told by neighbouring lines comes out too "
        f"large; measure it on lines {width / _LINES:.2g} Hz apart or closer."
    ]


def _pole(frequency: Array, H: ComplexArray) -> complex:
    """Where the straight line through 1/H at two frequencies is zero."""
    fell = complex(H[0] - H[1])
    return frequency[0] - complex(H[1]) * (frequency[1] - frequency[0]) / fell if fell else complex(np.inf)
