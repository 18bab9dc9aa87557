"""Branches: solutions on neighbouring lines joined into curves, each with its stability and how it ends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import Outcome

from ..indices import Index, Mask

_SAME = 1e-5
"""Of the largest joint's motion; two searches settle the same point to better than that."""


class Stability(Enum):
    """What is known of the stability of a branch at fixed frequency."""

    FOLD_STABLE = "fold_stable"
    """∂F/∂A > 0: no fold was passed. Instabilities of Hopf kind and period doublings are not excluded."""
    STABLE = "stable"
    """Every small disturbance dies out (Hill's method on the equations of motion)."""
    UNSTABLE = "unstable"
    """Motion leaves it: a fold was passed, or Hill's method finds a disturbance that grows."""
    UNKNOWN = "unknown"
    """Several joints, and the Jacobian's determinant alone does not tell; or not the same all along a branch."""


class End(Enum):
    """How a branch ends on one side."""

    RANGE = "edge of the frequency range"
    FOLD = "fold: the branch turns back with the other stability"
    LIMIT = "limit of a joint, named in the outcome"
    LOST = "no convergence on the next line"


@dataclass(frozen=True, eq=False)
class Branch:
    """One curve of solutions over frequency at one force."""

    frequency: Array
    """Hz, (n,)."""
    joint: ComplexArray
    """Relative displacement of every connection in m, phase relative to the force, (n, connections)."""
    output: ComplexArray
    """Displacement of the outputs in m, (n, outputs)."""
    stability: Stability
    ends: tuple[End, End]
    outcome: Outcome
    """CONVERGED, or the limit at which it ends."""
    harmonics: tuple[int, ...] = (1,)
    """What was solved for; ``joint`` and ``output`` are the first of them."""
    overtones: ComplexArray = field(default_factory=lambda: np.empty((0, 0, 0), dtype=complex))
    """Relative displacement of every connection in the other harmonics, m, (n, harmonics − 1, connections)."""
    mean: Array = field(default_factory=lambda: np.empty((0, 0)))
    """Mean displacement of every connection under a static load in m, (n, connections); empty without one."""
    error: Array = field(default_factory=lambda: np.empty(0))
    """Estimated relative error of the first harmonic because of those left out, (n,); nan where it cannot be told."""
    held: Array = field(default_factory=lambda: np.empty(0))
    """Relative change of the first harmonic that a force held by sliders can make at most, (n,); nan where it cannot be
    told, empty where no joint holds one."""
    labels: tuple[Stability, ...] = ()
    """Stability point by point, (n,)."""
    outcomes: tuple[Outcome, ...] = ()
    """Per point: CONVERGED, or why more harmonics are needed than were solved for, (n,)."""


def without_repeats(branches: Sequence[Branch]) -> list[Branch]:
    """Branches, the longer first where one is part of another: the same motions at all its frequencies that both have.

    A curve that is begun twice, or followed inside a window and again outside it, would be listed twice.
    """
    kept: list[Branch] = []
    for b in sorted(branches, key=lambda b: -len(b.frequency)):
        if not any(_is_part(b, a) for a in kept):
            kept.append(b)
    return [b for b in branches if any(b is a for a in kept)]


def _is_part(b: Branch, a: Branch) -> bool:
    if b.frequency[0] < a.frequency[0] or b.frequency[-1] > a.frequency[-1] or b.harmonics != a.harmonics:
        return False
    _, own, other = np.intersect1d(b.frequency, a.frequency, return_indices=True)
    # Branches that meet at a fold share that point; a piece of one or two points is a part if it shares them all.
    inner = (own > 0) & (own < len(b.frequency) - 1)
    if not np.any(inner) and len(own) < len(b.frequency):
        return False
    apart = np.max(np.abs(b.joint[own] - a.joint[other]), axis=1, initial=0.0)
    return bool(np.all(apart <= _SAME * np.max(np.abs(a.joint[other]), axis=1, initial=0.0)))


@dataclass(frozen=True, eq=False)
class Chain:
    """Indices of the solutions that make one branch, ascending in frequency."""

    members: Index
    rising: bool
    ends: tuple[End, End]
    outcome: Outcome


def chains(line: Index, amplitude: Array, rising: Mask, cut: Mask, reasons: tuple[Outcome, ...]) -> list[Chain]:
    """Join the solutions of one force, sorted by line and amplitude.

    Between lines with the same pattern of stabilities the k-th solution continues the k-th; where the pattern
    changes, solutions of one stability are matched by amplitude. ``cut`` and ``reasons`` are per line.
    """
    open_chains: dict[int, list[Index]] = {}
    finished: list[tuple[list[Index], int]] = []
    born: dict[int, int] = {}
    key = 0
    previous: list[int] = []
    previous_rows: Index = np.empty(0, dtype=int)
    previous_line = -2
    for rows in _runs(line, rising, len(cut)):
        # rows: (lines of the run, solutions per line)
        first_line = int(line[rows[0, 0]])
        links: dict[int, int] = {}
        if previous_line == first_line - 1:
            links = _match(previous_rows, rows[0], amplitude, rising)
        current = []
        for k in range(rows.shape[1]):
            if k in links:
                name = previous[links[k]]
                open_chains[name].append(rows[:, k])
            else:
                name, key = key, key + 1
                open_chains[name], born[name] = [rows[:, k]], first_line
            current.append(name)
        for name in set(previous) - set(current):
            finished.append((open_chains.pop(name), name))
        previous, previous_rows, previous_line = current, rows[-1], int(line[rows[-1, 0]])
    finished += [(pieces, name) for name, pieces in open_chains.items()]
    out = []
    for pieces, _ in sorted(finished, key=lambda item: (line[item[0][0][0]], amplitude[item[0][0][0]])):
        members = np.concatenate(pieces)
        up = bool(rising[members[0]])
        ends, outcome = [], Outcome.CONVERGED
        for at, beyond in ((members[0], -1), (members[-1], 1)):
            neighbour = int(line[at]) + beyond
            if not 0 <= neighbour < len(cut):
                ends.append(End.RANGE)
            elif cut[neighbour] != cut[line[at]] and _topmost(at, line):
                outcome = reasons[neighbour if cut[neighbour] else line[at]]
                ends.append(End.LOST if outcome is Outcome.STALLED else End.LIMIT)
            else:
                ends.append(End.FOLD)
        out.append(Chain(members, up, (ends[0], ends[1]), outcome))
    return out


def _topmost(at: int, line: Index) -> bool:
    """Whether no solution of the same line lies above this one; only such a one can pass a limit."""
    return at == len(line) - 1 or bool(line[at + 1] != line[at])


def _runs(line: Index, rising: Mask, lines: int) -> Iterator[Index]:
    """Groups of neighbouring lines with the same number and pattern of solutions, (lines, solutions)."""
    count = np.bincount(line, minlength=lines)
    start = np.concatenate([[0], np.cumsum(count)])
    code = np.zeros(lines, dtype=int)
    place = np.arange(len(line)) - start[line]
    np.add.at(code, line, np.where(rising, 1, 2) * 3 ** np.minimum(place, 30))
    new = np.flatnonzero(np.diff(code) != 0) + 1
    for first, last in zip(np.concatenate([[0], new]), np.concatenate([new, [lines]]), strict=True):
        if count[first]:
            yield np.arange(start[first], start[last]).reshape(last - first, count[first])


def _match(old: Index, new: Index, amplitude: Array, rising: Mask) -> dict[int, int]:
    """Which old column each new column continues: same stability, least change of amplitude."""
    links: dict[int, int] = {}
    for kind in (True, False):
        a, b = np.flatnonzero(rising[old] == kind), np.flatnonzero(rising[new] == kind)
        if len(a) and len(b):
            cost = np.abs(amplitude[old[a]][:, None] - amplitude[new[b]])
            for i, j in zip(*scipy.optimize.linear_sum_assignment(cost), strict=True):
                links[int(b[j])] = int(a[i])
    return links
