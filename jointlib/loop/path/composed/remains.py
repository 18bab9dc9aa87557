"""Where the force sits that a composition leaves: in frequency, amplitude, speed, time and condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.fitted import Fitted

_PARTS = 4
"""Of the range of amplitude, speed and time."""
_STANDS_OUT = 1.5
"""A part is said to hold what is left if its share is so many times its share of the samples."""


def remains(fitted: Fitted) -> dict[str, list[dict[str, Any]]]:
    """Shares of the squared residual, each beside its share ``of_samples``, over frequency that of the squared force.

    ``frequency`` by octaves below the cutoff (Hz), ``amplitude`` and ``speed`` by quarters of the samples in rising
    abs(z) (m) and abs(ż) (m/s), ``time`` by quarters of the records laid end to end (s), ``condition`` by name.
    """
    runs, power = fitted.evidence.runs, fitted.residual**2
    z = np.concatenate([run.path.displacement[run.keep] for run in runs])
    v = np.concatenate([run.path.velocity[run.keep] for run in runs])
    starts = np.cumsum([0.0, *(len(run.force) * run.path.time_step for run in runs)])
    clock = np.concatenate([start + run.time for start, run in zip(starts, runs, strict=False)])
    middle = (z.max() + z.min()) / 2
    return {
        "frequency": _octaves(fitted),
        "amplitude": _quarters(np.abs(z - middle), power),
        "speed": _quarters(np.abs(v), power),
        "time": _quarters(clock, power),
        "condition": _conditions(fitted, power),
    }


def _quarters(along: Array, power: Array) -> list[dict[str, Any]]:
    edges = np.quantile(along, np.linspace(0, 1, _PARTS + 1))
    number = np.clip(np.searchsorted(edges, along, side="right") - 1, 0, _PARTS - 1)
    share, count = (np.bincount(number, w, _PARTS) for w in (power, None))
    return [
        {"low": low, "high": high, "share": s / max(power.sum(), 1e-300), "of_samples": n / len(along)}
        for low, high, s, n in zip(edges[:-1].tolist(), edges[1:].tolist(), share, count, strict=True)
    ]


def _octaves(fitted: Fitted) -> list[dict[str, Any]]:
    """Of the spectra of residual and force, record by record, from the cutoff down; the lowest holds all below."""
    preparation = fitted.evidence.runs[0].preparation
    edges = preparation.cutoff * 2.0 ** np.arange(-5, 1)
    edges[0] = 0.0
    left, force, first = np.zeros(len(edges) - 1), np.zeros(len(edges) - 1), 0
    for run in fitted.evidence.runs:
        here = slice(first, first + len(run.time))
        first = here.stop
        f = np.fft.rfftfreq(len(run.time), preparation.stride / preparation.sample_rate)
        number = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, len(edges) - 2)
        for total, x in ((left, fitted.residual[here]), (force, fitted.evidence.force[here])):
            total += np.bincount(number, np.abs(np.fft.rfft(x)) ** 2, len(edges) - 1) / len(x)
    return [
        {"low": low, "high": high, "share": s / max(left.sum(), 1e-300), "of_samples": n / max(force.sum(), 1e-300)}
        for low, high, s, n in zip(edges[:-1].tolist(), edges[1:].tolist(), left, force, strict=True)
    ]


def _conditions(fitted: Fitted, power: Array) -> list[dict[str, Any]]:
    evidence = fitted.evidence
    out = []
    rows = list(zip(evidence.division.blocks, evidence.rows, strict=True))
    total, samples = sum(float(power[r].sum()) for _, r in rows), sum(len(r) for _, r in rows)
    for name in evidence.division.conditions:
        own = [r for b, r in rows if b.condition == name]
        share = sum(float(power[r].sum()) for r in own) / max(total, 1e-300)
        out.append({"name": name, "share": share, "of_samples": sum(len(r) for r in own) / max(samples, 1)})
    return out


def said(found: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """The part that stands out most, as a sentence; nothing where what is left is spread evenly."""
    words = {"frequency": "Hz", "amplitude": "m from the middle", "speed": "m/s", "time": "s"}
    rows = [(axis, row) for axis, rows in found.items() for row in rows if row["share"] > 0.5]
    rows = [(a, r) for a, r in rows if r["share"] > _STANDS_OUT * r["of_samples"]]
    if not rows:
        return ""
    axis, row = max(rows, key=lambda r: r[1]["share"] / max(r[1]["of_samples"], 0.05))
    where = f"in {row['name']}" if axis == "condition" else f"at {row['low']:.3g} to {row['high']:.3g} {words[axis]}"
    return f"{row['share']:.0%} of what is left sits {where}."
