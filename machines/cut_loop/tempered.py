"""Draws of a suspect moved from the prior to where the cuts are explained, the cuts coming to count by and by.

Sequential Monte Carlo by tempering (Del Moral, Doucet & Jasra 2006): a population stands for prior·Lᵝ; β rises by as
much as leaves a share of it effective, the population is drawn anew by its weights and moved by Metropolis steps along
differences of its own members (ter Braak 2006), which follow ridges and reach from one mode to another. All populations
count in the end, each draw over the mixture of what all of them stand for (Shirts & Chodera 2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from zlib import crc32

import numpy as np
from scipy.special import logsumexp

from jointlib.arrays import Array
from jointlib.system.processes import each_on_every_core

from ..indices import Index, Mask
from ..uncertainty.drawn_machines import draws
from .contest import NEEDED
from .posterior import Posterior, evaluated
from .problem import Problem
from .suspects import Suspect

_LEFT = 0.4
"""Share of a population that is effective still where the next power is."""
_MOVES, _LAST, _LAST_OF_MANY = 2, 6, 3
"""Metropolis steps at a power, and where all cuts count in full; of more than `_FIRST` draws, which are enough side by
side, half as many leave five sixths of the effective draws."""
_MOVED, _JUMPS, _ROWS = 0.6, 0.1, 0.15
"""Share of the numbers that a step moves, of the steps that go the whole difference, and that take another sample."""
_ACCEPTED, _TOLD = 0.25, 1.5
"""Share of the steps that should be accepted, and how fast their length follows."""
_LIKELIER = 1.0
"""Nats, over the power, by which a move may make the places left likelier than any draw does and still be followed."""
_JITTER = 0.01
_SETTLED, _TURNS = 1e-4, 1000
"""Nats by which integrals of the powers change where they are believed, and turns at most."""
_FIRST, _BEHIND = 300, 4.5
"""Draws that every suspect is tried with, and by how many nats it may be behind then and be told after all: three leave
one of twenty chances, and one and a half more is four times what so few draws err."""
_LONGER = 3
"""Times as often that a suspect is moved who may be named but for too few effective draws."""


def posteriors(suspects: Sequence[Suspect], problem: Problem, needed: float) -> list[Posterior]:
    """Of every suspect: few draws tell who can be named at all, and all draws how well.

    ``needed`` is the evidence that a name needs at least, in nats.
    """

    def first(suspect: Suspect) -> Posterior:
        return posterior(suspect, problem, _FIRST)

    found = each_on_every_core("suspects", first, suspects)
    least, many = max([needed, *(one.evidence for one in found)]) - _BEHIND, problem.tool.count > _FIRST
    able = [k for k, one in enumerate(found) if one.evidence >= least and (many or one.effective < NEEDED)]

    def again(k: int) -> Posterior:
        one = posterior(suspects[k], problem) if many else found[k]
        return posterior(suspects[k], problem, times=_LONGER) if one.effective < NEEDED else one

    for k, one in zip(able, each_on_every_core("suspects that are left", again, able), strict=True):
        found[k] = one
    return found


def posterior(suspect: Suspect, problem: Problem, most: int | None = None, times: int = 1) -> Posterior:
    """Draws of a suspect with their weights, as many as there are samples of the tool, or ``most``; moved so many times
    as often as usual where all cuts count in full."""
    count, name = problem.tool.count, f"{suspect.family} {suspect.member}"
    count = count if most is None else min(count, most)
    size = len(suspect.parameters) + problem.tool.freedom + 1  # the scatter of the verdicts comes last
    rng = np.random.default_rng([problem.seed, crc32(name.encode())])
    every = np.arange(count, dtype=np.intp)
    now = evaluated(suspect, problem, every, draws(f"cuts {name}", count, size, problem.seed), every)
    power, length, powers, kept = 0.0, 1.0, [0.0], [now]
    last = times * (_LAST_OF_MANY if count > _FIRST else _LAST)
    while power < 1:
        step = _next(now.total, power)
        archive = now.of(_drawn_anew(step * now.total, rng))
        now, power = archive, min(power + step, 1.0)
        for _ in range(_MOVES if power < 1 else last):
            now, share = _moved(now, archive.z, power, length, problem, rng)
            length = float(np.clip(length * np.exp(_TOLD * (share - _ACCEPTED)), 0.1, 2.0))
            if power == 1:
                powers.append(power)
                kept.append(now)
        if power < 1:
            powers.append(power)
            kept.append(now)
    return _over_all(kept, np.array(powers))


def _next(total: Array, power: float) -> float:
    """By how much the power may rise."""
    low, high = 0.0, 1 - power
    if _share(high * total) >= _LEFT:
        return high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if _share(middle * total) >= _LEFT else (low, middle)
    return high


def _share(total: Array) -> float:
    """Effective share of draws by ln of their weights."""
    return float(np.exp(2 * logsumexp(total) - logsumexp(2 * total))) / len(total)


def _drawn_anew(total: Array, rng: np.random.Generator) -> Index:
    """Draws by ln of their weights, each as often as its weight says, to one (systematic resampling)."""
    weight = np.cumsum(np.exp(total - logsumexp(total)))
    at = (np.arange(len(total)) + rng.uniform()) / len(total)
    return np.minimum(np.searchsorted(weight, at), len(total) - 1).astype(np.intp)


def _moved(
    now: Posterior, archive: Array, power: float, length: float, problem: Problem, rng: np.random.Generator
) -> tuple[Posterior, float]:
    """A population after a Metropolis step at a power, and the share that it accepted of the moves."""
    count, size = now.z.shape
    moved = rng.uniform(size=(count, size)) < _MOVED
    long = np.where(rng.uniform(size=count) < _JUMPS, 1.0, length * 2.38 / np.sqrt(2 * size * _MOVED))
    first, second = rng.integers(count, size=(2, count))
    shift = long[:, None] * (archive[first] - archive[second]) + _JITTER * rng.standard_normal((count, size))
    other: Mask = np.asarray(rng.uniform(size=count) < (_ROWS if problem.tool.freedom else 0.5))
    other &= not problem.tool.alike
    rows = np.where(other, rng.integers(problem.tool.count, size=count), now.rows)
    z = now.z + np.where(moved & ~other[:, None], shift, 0.0)
    cost = 0.5 * np.sum(z**2 - now.z**2, axis=1)
    least = now.total + (np.log(rng.uniform(size=count)) + cost) / power
    new = evaluated(now.suspect, problem, rows, z, now.family, least - _LIKELIER / power, now)
    taken: Mask = new.total > least
    return now.where(taken, new), float(np.mean(taken[~other])) if not np.all(other) else _ACCEPTED


def _over_all(kept: list[Posterior], powers: Array) -> Posterior:
    """All populations together, with ln of the prior over their mixture."""
    over = over_mixture(np.array([one.total for one in kept]), powers)
    return replace(kept[0].joined(kept[1:]), prior=over)


def over_mixture(total: Array, powers: Array) -> Array:
    """ln of the prior over the mixture that populations stand for, (populations·draws,), by ln L of their draws,
    (populations, draws), and their powers, ascending from 0.

    ln ∫ prior·Lᵝ of every power first comes from the draws of the one before, and then settles by turns over all of
    them.
    """
    each_power, at, many = np.unique(powers, return_index=True, return_counts=True)
    low = total[at[1:] - 1]  # the last population of the power before
    steps = logsumexp(np.diff(each_power)[:, None] * low, axis=1) - np.log(total.shape[1])
    norm = np.concatenate([[0.0], np.cumsum(steps)])
    tempered, share = each_power[:, None] * total.ravel(), np.log(many / len(powers))
    for _ in range(_TURNS):
        over = -logsumexp((share - norm)[:, None] + tempered, axis=0)
        before, norm = norm, logsumexp(over + tempered, axis=1)
        norm -= norm[0]
        if np.max(np.abs(norm - before)) < _SETTLED:
            break
    return np.asarray(over)
