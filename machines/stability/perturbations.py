"""Stability of branches, point by point, and of peaks, and what is said where no motion that was found is stable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import Outcome

from ..harmonic_balance.cycle import Harmonics
from ..harmonic_balance.harmonics import with_mean
from ..indices import Index, Mask
from ..operating.branches import Branch, Stability
from ..operating.peaks import Peak
from .disturbances import Disturbances
from .labels import Branches, motions

_WIDTH = 1e-2
"""Half width of a peak over its frequency where it is not known."""


def with_stability(
    branches: Branches,
    peaks: Sequence[Sequence[Peak]],
    connections: Sequence[str],
    disturbed: Disturbances,
    most: float,
) -> tuple[Branches, str]:
    """Branches with what small disturbances do at every point, and what is to be said; peaks are per force.

    Where all points would cost more than ``most`` multiplications those at the peaks alone are told. A branch beyond a
    fold stays unstable.
    """
    where = [
        [np.arange(len(b.frequency)) if b.stability is not Stability.UNSTABLE else np.arange(0) for b in of_force]
        for of_force in branches
    ]
    said = ""
    if _price(branches, where, disturbed) > most:
        where = [_at_peaks(of_force, tops, connections) for of_force, tops in zip(branches, peaks, strict=True)]
        said = "telling the stability of every point would take minutes, so that of the peaks alone is told"
    if said and _price(branches, where, disturbed) > most:
        return branches, 'telling the stability beyond folds would take minutes; in Python stability="hill" does so'
    out = []
    for of_force, rows in zip(branches, where, strict=True):
        out.append(tuple(_told(b, own, disturbed) for b, own in zip(of_force, rows, strict=True)))
    return out, said


def labelled(branches: Branches) -> Branches:
    """Branches with the label of the whole at every point."""
    return [tuple(replace(b, labels=(b.stability,) * len(b.frequency)) for b in of_force) for of_force in branches]


def of_peaks(peaks: Sequence[Peak], branches: Sequence[Branch], connections: Sequence[str]) -> tuple[Peak, ...]:
    """Peaks at one force with the stability of the nearest point of a branch; an unstable one is not converged."""
    out, place = [], {name: i for i, name in enumerate(connections)}
    for p in peaks:
        near = _nearest(p, branches, place[p.connection])
        label = Stability.UNKNOWN if near is None else branches[near[0]].labels[near[1]]
        unstable = label is Stability.UNSTABLE and p.outcome is Outcome.CONVERGED
        out.append(replace(p, stability=label, outcome=Outcome.UNSTABLE if unstable else p.outcome))
    return tuple(out)


def nothing_stable(forces: Array, branches: Branches) -> tuple[str, ...]:
    """A sentence for every force with frequencies at which all motions that were found are unstable."""
    out = []
    for force, of_force in zip(forces.tolist(), branches, strict=True):
        bad = [
            (f, label is Stability.UNSTABLE) for b in of_force for f, label in zip(b.frequency, b.labels, strict=True)
        ]
        if not bad:
            continue
        at, unstable = np.array([f for f, _ in bad]), np.array([u for _, u in bad])
        order = np.argsort(at)
        spans = _spans(at[order], unstable[order], of_force)
        if spans:
            where = ", ".join(f"{low:.5g} to {high:.5g} Hz" if high > low else f"{low:.5g} Hz" for low, high in spans)
            out.append(
                f"at {force:g} N no stable motion was found at {where}: there the machine beats or wanders, its "
                "amplitude is not told"
            )
    return tuple(out)


def _spans(at: Array, unstable: Mask, branches: Sequence[Branch]) -> list[tuple[float, float]]:
    """Frequencies at which every branch is unstable, as ranges between neighbouring points."""
    spans: list[tuple[float, float]] = []
    before = False
    for f, own in zip(at.tolist(), unstable.tolist(), strict=True):
        alone = own and not any(_may_stand(b, f) for b in branches)
        if alone and before:
            spans[-1] = (spans[-1][0], f)
        elif alone:
            spans.append((f, f))
        before = alone
    return spans


def _may_stand(b: Branch, frequency: float) -> bool:
    """Whether a branch passes a frequency and is not known to be unstable on both sides of it."""
    if not b.frequency[0] <= frequency <= b.frequency[-1]:
        return False
    i = int(np.searchsorted(b.frequency, frequency))
    near = {b.labels[i]} if b.frequency[i] == frequency else {b.labels[i - 1], b.labels[i]}
    return near != {Stability.UNSTABLE}


def _told(b: Branch, rows: Index, disturbed: Disturbances) -> Branch:
    """A branch with labels at some of its points."""
    labels = [b.stability] * len(b.frequency)
    if len(rows):
        labels = [Stability.UNKNOWN if len(rows) < len(labels) else b.stability] * len(labels)
        found = disturbed.labels(motions(b)[rows], 2 * np.pi * b.frequency[rows], _solved(b), b.error[rows])
        for i, label in zip(rows, found, strict=True):
            labels[i] = label
    kinds = set(labels)
    return replace(b, labels=tuple(labels), stability=labels[0] if len(kinds) == 1 else Stability.UNKNOWN)


def _price(branches: Branches, where: Sequence[Sequence[Index]], disturbed: Disturbances) -> float:
    price = 0.0
    for of_force, rows in zip(branches, where, strict=True):
        for b, own in zip(of_force, rows, strict=True):
            if len(own):
                price += len(own) * disturbed.price(motions(b)[:1], 2 * np.pi * b.frequency, _solved(b))
    return price


def _at_peaks(branches: Sequence[Branch], peaks: Sequence[Peak], connections: Sequence[str]) -> list[Index]:
    rows: list[set[int]] = [set() for _ in branches]
    place = {name: i for i, name in enumerate(connections)}
    for p in peaks:
        near = _nearest(p, branches, place[p.connection])
        if near is not None and branches[near[0]].stability is not Stability.UNSTABLE:
            rows[near[0]].add(near[1])
    return [np.array(sorted(own), dtype=int) for own in rows]


def _nearest(p: Peak, branches: Sequence[Branch], joint: int) -> tuple[int, int] | None:
    """Branch and point nearest to a peak in frequency, over its width, and in amplitude, over its own."""
    best, found = np.inf, None
    scale = p.width if p.width > 0 else _WIDTH * p.frequency

    def apart(b: Branch, rows: slice) -> Array:
        away = np.hypot((b.frequency[rows] - p.frequency) / scale, np.abs(b.joint[rows, joint]) / p.amplitude - 1)
        return np.asarray(np.where(np.isfinite(away), away, np.inf))

    for k, b in enumerate(branches):
        beside = min(int(np.searchsorted(b.frequency, p.frequency)), len(b.frequency) - 1)
        # What is further off in frequency alone is not nearer.
        reach = scale * min(best, float(apart(b, slice(beside, beside + 1))[0])) * (1 + 1e-9)
        first, last = np.searchsorted(b.frequency, [p.frequency - reach, p.frequency + reach + 1e-9 * p.frequency])
        rows = slice(int(first), int(last))
        away = apart(b, rows)
        i = int(np.argmin(away)) if len(away) else 0
        if len(away) and away[i] < best:
            best, found = float(away[i]), (k, rows.start + i)
    return found


def _solved(b: Branch) -> Harmonics:
    return with_mean(b.harmonics, b.mean.size > 0)
