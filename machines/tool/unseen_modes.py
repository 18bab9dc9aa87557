"""Modes of a tool beyond the lines on which it is known, told by what these lines hold of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from jointlib.arrays import Array

from .bounded_band import shape
from .tool_point import ToolPoint

_FINER = 8
"""Parts into which the steps of `shape` are cut."""
_LINES = 1200
_WINDOW = (0.4, 0.7)
"""Shares of the highest line between which the rest is read: lower ones hold what lies below, higher ones its edge."""
_INWARD = 1.2
_PLACES = 41


@lru_cache(maxsize=8)
def unseen_flexibility(point: ToolPoint) -> float:
    """Static flexibility in m/N, at most, of the modes above the last line along the more flexible of its axes.

    What responds only after it was pushed has a real part that follows from its imaginary one (Kramers, Kronig):

        Re G(ω) = −(2/π) ⨍ Ω Im G(Ω)/(Ω² − ω²) dΩ.

    Taken over the known lines alone this is the part of the modes among them, and Re G less that the part of the
    others, Σ φ²/(k_r (1 − ω²/ω_r²)) of modes r above. The middle one of many lines is told; 0 where the lines reach
    over too little to tell, or hold nothing of modes above.
    """
    low, high = float(point.lines[0]), float(point.lines[-1])
    first, last = max(_WINDOW[0] * high, _INWARD * low), _WINDOW[1] * high
    if not first < last:
        return 0.0
    steps = shape(point).lines
    inner = steps[:-1, None] + np.diff(steps)[:, None] * (np.arange(_FINER) / _FINER)
    lines = np.unique(np.concatenate([inner.ravel(), np.linspace(low, high, _LINES)]))
    at = np.searchsorted(lines, np.linspace(first, last, _PLACES))
    places = (lines[at] + lines[at - 1]) / 2
    here, along = (np.einsum("fii->fi", point(f)) for f in (places, lines))
    rest = here.real + 2 / np.pi * np.array(
        [_lossy(lines, along.imag, *one) for one in zip(places, here.imag, strict=True)]
    )
    return max(0.0, float(np.max(np.median(rest, axis=0))))


def _lossy(lines: Array, lost: Array, place: float, own: Array) -> Array:
    """⨍ Ω Im G(Ω)/(Ω² − ω²) dΩ over lines in Hz; the value at the place itself is taken out, as its part is known."""
    regular = lines[:, None] * (lost - own) / (lines**2 - place**2)[:, None]
    low, high = lines[0], lines[-1]
    return np.asarray(
        np.trapezoid(regular, lines, axis=0) + own * np.log((high**2 - place**2) / (place**2 - low**2)) / 2
    )
