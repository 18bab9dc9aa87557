"""Suspects compete for the cuts: what is held out decides, by speed, and what they cannot explain is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.loop.answer.report import Status, Verdict

from ..indices import Mask
from .evidence import judged
from .posterior import Posterior, Problem, probability

NEEDED = 10.0
"""Effective draws that make a posterior; with fewer the prior does not reach the cuts."""
STRAINED = 3.5
"""Standard errors by which a posterior may pull a mode; further off it contradicts what was measured."""
GAIN, _TIED = 6.0, 3.0
"""Nats on held-out cuts that a name needs, and within which another family cannot be ruled out."""
_FOLDS = 8
_SURPRISE, _CHANCE = 0.1, 0.02
"""Predicted probability below which a verdict surprises, and how improbable so many of those must be."""


@dataclass(frozen=True, eq=False)
class Entry:
    """A suspect as it fared.

    Parameters
    ----------
    score
        ln P(held-out cuts | the others), by fold, in nats.
    stable
        P(stable) of each cut from the folds it is not in, (cuts,).
    """

    posterior: Posterior
    score: Array
    stable: Array

    @property
    def total(self) -> float:
        """Of all folds."""
        return float(np.sum(self.score))

    @property
    def reached(self) -> bool:
        """Whether the draws are a posterior."""
        return self.posterior.effective >= NEEDED and self.posterior.strain <= STRAINED


@dataclass(frozen=True, eq=False)
class Outcome:
    """Who won: ``chosen`` is None where nothing is named, ``status`` and ``reason`` are those of each entry."""

    verdict: Verdict
    chosen: Entry | None
    rivals: tuple[Entry, ...]
    status: tuple[Status, ...]
    reason: tuple[str, ...]


def folds_of(problem: Problem) -> list[list[int]]:
    """Cuts held out together: those of one speed, or of neighbouring ones where there are many."""
    speeds = np.array([cut.speed for cut in problem.cuts])
    parts = np.array_split(np.unique(speeds), min(_FOLDS, len(np.unique(speeds))))
    return [[int(i) for i in np.flatnonzero(np.isin(speeds, part))] for part in parts]


def entry(found: Posterior, problem: Problem, folds: Sequence[Sequence[int]]) -> Entry:
    """Scores of a suspect on what is held out."""
    stable = np.zeros(len(problem.cuts))
    for held in folds:
        stable[list(held)] = probability(found, problem, held)[list(held)]
    return Entry(found, np.array([found.predicted(held) for held in folds]), stable)


def errors(one: Entry, problem: Problem) -> dict[str, float | str]:
    """Share of held-out cuts that are classified rightly, and the mean ln of the probability of their verdicts."""
    known, said = judged(problem.cuts), _said(problem)
    right = np.mean((one.stable > 0.5)[known] == said[known])
    chance = np.where(said, one.stable, 1 - one.stable)[known]
    return {"right": float(right), "log_score": float(np.mean(np.log(chance))), "where": "cuts held out by speed"}


def surprising(one: Entry, problem: Problem) -> Mask:
    """Cuts whose verdict was held to be improbable, from all others."""
    known, said = judged(problem.cuts), _said(problem)
    return np.asarray(known & (np.where(said, one.stable, 1 - one.stable) < _SURPRISE))


def decided(base: Entry, entries: Sequence[Entry], problem: Problem) -> Outcome:
    """The verdict."""
    gains = np.array([one.total - base.total for one in entries])
    reached = np.array([one.reached for one in entries])
    folds = [np.count_nonzero(one.score - base.score > 0.2) for one in entries]
    able = reached & (gains > GAIN) & (np.array(folds) >= 2)
    status, reason = [Status.REJECTED] * len(entries), []
    for one, gain, helps in zip(entries, gains, folds, strict=True):
        if not one.reached:
            of = one.posterior
            reason.append(
                f"{of.effective:.1f} effective draws, modes pulled by {of.strain:.1f} standard errors: no posterior"
            )
        elif gain <= GAIN:
            reason.append(f"gains {gain:.1f} nats on held-out cuts, {GAIN:g} are needed")
        else:
            reason.append("" if helps >= 2 else "helps at one speed alone")
    if not np.any(able):
        return Outcome(_unnamed(base, gains, reached, problem), None, (), tuple(status), tuple(reason))
    top = float(np.max(gains[able]))
    even = [i for i in range(len(entries)) if able[i] and gains[i] > top - _TIED]
    size = [len(one.posterior.suspect.parameters) for one in entries]
    best = min(even, key=lambda i: (size[i], -gains[i]))  # the simpler one
    family = entries[best].posterior.suspect.family
    status[best] = Status.ACCEPTED
    rivals: list[Entry] = []
    for i in np.argsort(-gains):
        other = entries[i].posterior.suspect.family
        # An effect with more parameters has to lead by as much more.
        more = max(size[best] - size[i], 0)
        near = gains[i] > max(gains[best] - _TIED * (1 + more), 0.0)
        if near and other != family and other not in {r.posterior.suspect.family for r in rivals}:
            status[i] = Status.TIED
            reason[i] = f"{gains[best] - gains[i]:.1f} nats behind the chosen one"
            rivals.append(entries[i])
    chosen = entries[best]
    left = _too_many(surprising(chosen, problem), problem)
    verdict = Verdict.AMBIGUOUS if rivals else Verdict.PARTIAL if left else Verdict.IDENTIFIED
    return Outcome(verdict, chosen, tuple(rivals), tuple(status), tuple(reason))


def _unnamed(base: Entry, gains: Array, reached: Mask, problem: Problem) -> Verdict:
    """Nothing missing, or something that has no name."""
    collapsed = not base.reached
    hidden = bool(np.any((gains > GAIN) & ~reached))
    if collapsed or hidden or _too_many(surprising(base, problem), problem):
        return Verdict.UNEXPLAINED
    return Verdict.NOTHING_MISSING


def _too_many(surprises: Mask, problem: Problem) -> bool:
    """More surprises than a model that is right has."""
    count, number = int(np.count_nonzero(surprises)), int(np.count_nonzero(judged(problem.cuts)))
    return bool(scipy.stats.binom.sf(count - 1, number, _SURPRISE / 2) < _CHANCE)


def _said(problem: Problem) -> Mask:
    return np.array([cut.verdict == "stable" for cut in problem.cuts])
