"""Where in the motion and when in a record the rest sits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.layout import Layout

_BINS = 5
_STRETCHES = 8


def by_amplitude(records: Sequence[Observed], residuals: Sequence[ComplexArray]) -> list[dict[str, float]]:
    """Root mean square of the joint residual (N, period average) where abs(z) lies in fifths of its largest value.

    ``residuals`` are (lines, 3) in N, m/s² and N times samples. What leaves more at large displacement grows with
    it; friction leaves most near reversals, which is where the displacement is large, too.
    """
    z, r = np.empty(0), np.empty(0)
    for o, residual in zip(records, residuals, strict=True):
        use = o.on_period & o.valid[:, 2]
        z = np.append(z, _period(o, o.Z))
        r = np.append(r, _period(o, np.where(use, residual[:, 2], 0)))
    edges = np.linspace(0.0, float(np.abs(z).max()), _BINS + 1)
    out = []
    for low, high in itertools.pairwise(edges):
        inside = (np.abs(z) >= low) & (np.abs(z) <= high)
        if inside.any():
            rms = float(np.sqrt(np.mean(r[inside] ** 2)))
            out.append({"from_m": float(low), "to_m": float(high), "rms_N": rms})
    return out


def by_time(layout: Layout, whitened: Sequence[ComplexArray], sample_rate: float) -> list[dict[str, float]]:
    """χ² of all equations in eighths of the records: even where the rest repeats, uneven where it does not."""
    sums, seconds = np.zeros(_STRETCHES), 0.0
    for i, r in enumerate(whitened):
        power = np.sum(layout.in_time(i, r) ** 2, axis=0)
        sums += np.array([part.sum() for part in np.array_split(power, _STRETCHES)])
        seconds = max(seconds, layout.samples[i] / sample_rate)
    entries = sum(int(np.count_nonzero(r)) for r in whitened) / _STRETCHES
    edges = np.linspace(0.0, seconds, _STRETCHES + 1)
    return [
        {"from_s": float(a), "to_s": float(b), "chi2": float(s / entries)}
        for (a, b), s in zip(itertools.pairwise(edges), sums, strict=True)
    ]


def _period(o: Observed, X: ComplexArray) -> Array:
    return o.spectra.averaged_period(X[o.on_period])
