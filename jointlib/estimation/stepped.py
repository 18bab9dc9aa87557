"""Stepped sine: a frequency at a time, each held until the motion is steady."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.estimation.blocks import motions_of
from jointlib.estimation.estimators import spread
from jointlib.estimation.shaker import Lines
from jointlib.measurement import Measurement, Record

_PARTS = 8
"""Pieces of a dwell that tell its noise."""
_CYCLES = 16
"""Fewest cycles of a dwell."""
_STEADY = 0.5
"""Share of a dwell that is used, its end."""
_SAME = 2e-3


def stepped_lines(m: Measurement, records: Sequence[Record], notes: list[str]) -> list[Lines]:
    """Every dwell gives one line: the sines that fit the end of force and motion best, and their ratio.

    The pieces of a dwell give ratios of their own, whose scatter is the variance of the line.
    """
    rate, sensors = records[0].sample_rate, motions_of(m)
    (source,) = m.of("force")
    rows: dict[float, list[Array]] = {}
    for record in records:
        force = record.channels[source.name] - np.mean(record.channels[source.name])
        for first, last in dwells(force, rate):
            begin = last - round(_STEADY * (last - first))
            frequency = _refined(force[begin:last], rate)
            parts = np.array_split(np.arange(begin, last), _PARTS)
            signals = [force, *(record.channels[c.name] for c in sensors)]
            found = np.array([[_sine(x[p], p / rate, frequency) for x in signals] for p in parts])
            rows.setdefault(float(f"{frequency:.4g}"), []).append(
                np.concatenate([np.full((len(found), 1), frequency), found], 1)
            )
    if len(rows) < 4:
        raise InputError(
            f"{m.source}: {len(rows)} frequencies are held for at least {_CYCLES} cycles, expected a stepped sine of 4 "
            "or more"
        )
    notes.append(f"{len(rows)} frequencies are held long enough; of each the last half is used.")
    tables = [np.concatenate(rows[key]) for key in sorted(rows)]
    lines = np.array([np.mean(t[:, 0].real) for t in tables])
    out = []
    for k in range(len(sensors)):
        values, chance, free, coherences = [], [], [], []
        for table in tables:
            F, X = table[:, 1], table[:, 2 + k]
            power = np.sum(np.abs(F) ** 2)
            H = np.sum(X * F.conj()) / power
            n = len(F)
            chance.append(np.sum(np.abs(X - H * F) ** 2) / (n - 1) / power)
            free.append(n - 1.0)
            coherences.append(np.abs(np.sum(X * F.conj())) ** 2 / (power * np.sum(np.abs(X) ** 2)))
            values.append(H)
        known = spread(np.array(chance), np.array(free))
        out.append(Lines(lines, np.array(values), known, np.array(coherences), float(_PARTS)))
    return out


def dwells(force: Array, rate: float) -> Iterator[tuple[int, int]]:
    """First and last sample of every stretch in which the force keeps its frequency and its size."""
    analytic = np.asarray(scipy.signal.hilbert(force))
    turn = np.unwrap(np.angle(analytic))
    strong = np.abs(analytic) > 0.1 * np.max(np.abs(analytic))
    mean = np.median(np.diff(turn)[strong[1:]]) if np.any(strong[1:]) else 0.0
    if not mean > 0:
        return
    first = 0
    while first < len(force):
        size = int(_CYCLES * 2 * np.pi / max(_speed(turn, first, len(force)), 1e-9))
        if first + size > len(force):
            return
        t = np.arange(first, first + size)
        slope, offset = np.polyfit(t, turn[first : first + size], 1)
        miss = np.abs(turn[first : first + size] - slope * t - offset)
        if slope <= 0 or not np.all(strong[first : first + size]) or np.percentile(miss, 95) > 0.3:
            first += max(1, size // 8)
            continue
        last = first + size
        step = max(1, size // 4)
        while last + step <= len(force):
            t = np.arange(last, last + step)
            if np.percentile(np.abs(turn[last : last + step] - slope * t - offset), 50) > 0.5 or not np.all(
                strong[last : last + step]
            ):
                break
            last += step
            t = np.arange(first, last)
            slope, offset = np.polyfit(t, turn[first:last], 1)
        if last < len(force):  # the last pieces may reach into what follows
            yield first, last - 2 * step
        else:
            yield first, last
        first = last


def _speed(turn: Array, first: int, end: int) -> float:
    """Radians a sample soon after a sample."""
    piece = np.diff(turn[first : min(first + 64, end)])
    return float(np.median(piece)) if len(piece) else 0.0


def _refined(x: Array, rate: float) -> float:
    """The frequency in Hz at which a sine fits best, from the phase of pieces."""
    analytic = np.asarray(scipy.signal.hilbert(x * np.hanning(len(x))))
    turn = np.unwrap(np.angle(analytic))
    middle = slice(len(x) // 8, len(x) - len(x) // 8)
    t = np.arange(len(x))[middle]
    return float(np.polyfit(t, turn[middle], 1)[0] * rate / (2 * np.pi))


def _sine(x: Array, t: Array, frequency: float) -> complex:
    """Complex amplitude of x ≈ Re(a·e^(jωt)) + c by least squares."""
    w = 2 * np.pi * frequency
    design = np.stack([np.cos(w * t), -np.sin(w * t), np.ones(len(t))], axis=1)
    (re, im, _), *_ = np.linalg.lstsq(design, x, rcond=None)
    return complex(re, im)
