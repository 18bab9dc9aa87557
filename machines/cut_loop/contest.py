"""Suspects compete for the cuts: what is held out decides, by speed, and what they cannot explain is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.loop.answer.report import Status, Verdict

from ..indices import Index, Mask
from .evidence import ELSEWHERE, judged, of_verdicts, replayed
from .posterior import Posterior, probability
from .problem import Problem

NEEDED = 10.0
"""Effective draws that make a posterior; with fewer the prior does not reach the cuts."""
STRAINED = 3.5
"""Standard errors by which a posterior may pull a mode; further off it contradicts what was measured."""
ODDS = 50.0
"""By which the cuts must be likelier under the suspects, all together, than under the machine as it is. Where it is as
it is, that happens in one of 50 campaigns at most, whatever the suspects (Ville's inequality)."""
_SURE = 0.95
"""Probability that the families that are told hold together."""
_FOLDS = 8
_SURPRISE, _CHANCE, _REPLAYS = 0.1, 0.02, 500
"""Predicted probability below which a verdict surprises, how improbable a campaign is that is not explained, and how
many are made to tell."""
_STRANGE = 1.5
"""Times the density of frequencies that may be anywhere below which one is held to be that."""


@dataclass(frozen=True, eq=False)
class Entry:
    """A suspect as it fared.

    Parameters
    ----------
    score
        ln P(held-out cuts | the others), by fold, in nats.
    stable
        P(stable) of each cut from the folds it is not in, (cuts,).
    sung
        Density of the frequency heard in each cut from those folds, times half a tooth frequency, (cuts,).
    """

    posterior: Posterior
    score: Array
    stable: Array
    sung: Array

    @property
    def total(self) -> float:
        """Of all folds."""
        return float(np.sum(self.score))

    @property
    def weight(self) -> float:
        """ln P(all cuts | the suspect)."""
        return self.posterior.evidence

    @property
    def reached(self) -> bool:
        """Whether the draws are a posterior."""
        return self.posterior.effective >= NEEDED and self.posterior.strain <= STRAINED


@dataclass(frozen=True, eq=False)
class Outcome:
    """Who won.

    Parameters
    ----------
    chosen
        The family's best member; None where nothing is named.
    rivals
        The best member of every other family that cannot be ruled out beside the chosen one.
    left_open
        Where nothing is named: the best members of the families that cannot be ruled out beside the machine as it is.
    odds
        ln of the odds of all suspects together against the machine as it is, in nats.
    """

    verdict: Verdict
    chosen: Entry | None
    rivals: tuple[Entry, ...]
    left_open: tuple[Entry, ...]
    odds: float
    status: tuple[Status, ...]
    reason: tuple[str, ...]


def folds_of(problem: Problem) -> list[list[int]]:
    """Places held out together: those of one speed, or of neighbouring ones where there are many."""
    speeds = np.array([place.at.speed for place in problem.places])
    parts = np.array_split(np.unique(speeds), min(_FOLDS, len(np.unique(speeds))))
    return [[int(k) for k in np.flatnonzero(np.isin(speeds, part))] for part in parts]


def entry(found: Posterior, problem: Problem, folds: Sequence[Sequence[int]]) -> Entry:
    """Scores of a suspect on what is held out."""
    stable, sung = np.zeros((2, len(problem.cuts)))
    for held in folds:
        cuts = np.isin(problem.index, held)
        stable[cuts] = probability(found, problem, held)[cuts]
        sung[cuts] = found.weights(held) @ np.exp(found.sung[:, cuts])
    return Entry(found, np.array([found.predicted(held) for held in folds]), stable, sung)


def errors(one: Entry, problem: Problem) -> dict[str, float | str]:
    """Share of held-out cuts that are classified rightly, and the mean ln of the probability of their verdicts."""
    known, said = judged(problem.cuts), _said(problem)
    right = np.mean((one.stable > 0.5)[known] == said[known])
    return {"right": float(right), "log_score": log_score(one, problem), "where": "cuts held out by speed"}


def log_score(one: Entry, problem: Problem) -> float:
    """Mean ln of the probability of the verdicts of cuts that are held out."""
    return float(np.mean(np.log(_chance(one, problem)[judged(problem.cuts)])))


def surprising(one: Entry, problem: Problem) -> Mask:
    """Cuts whose verdict was held to be improbable, from all others."""
    return np.asarray(judged(problem.cuts) & (_chance(one, problem) < _SURPRISE))


def decided(base: Entry, entries: Sequence[Entry], problem: Problem) -> Outcome:
    """The verdict.

    Families have equal odds at first and so have the members of each, their sizes those of their priors: what the cuts
    make of the odds is the mean of their likelihoods (Kass & Raftery 1995). Effects that would fit a campaign of any
    outcome are thus paid less by one. Whoever is named has to do better on cuts held out as well, and no worse on their
    verdicts alone: frequencies do not outvote them.
    """
    families = list(dict.fromkeys(one.posterior.suspect.family for one in entries))
    members = {name: [i for i, one in enumerate(entries) if one.posterior.suspect.family == name] for name in families}
    gains = np.array([one.weight - base.weight for one in entries])
    family = np.array([scipy.special.logsumexp(gains[members[name]]) - np.log(len(members[name])) for name in families])
    odds = float(scipy.special.logsumexp(family) - np.log(len(families)))
    order = np.argsort(-family)
    best = {name: members[name][int(np.argmax(gains[members[name]]))] for name in families}
    status = [Status.REJECTED] * len(entries)
    by = [f" by {n} draws" if (n := one.posterior.count) < problem.tool.count else "" for one in entries]
    reason = [f"gains {gain:.1f} nats over the machine as it is{of}" for gain, of in zip(gains, by, strict=True)]
    for i, one in enumerate(entries):
        if not one.reached:
            of = one.posterior
            reason[i] = f"{of.effective:.1f} effective draws, modes pulled by {of.strain:.1f} standard errors"
    if odds <= np.log(ODDS):
        left = _sure(np.append(family, np.log(len(families))), order=np.append(order, len(families)))
        open_ = tuple(entries[best[families[k]]] for k in left if k < len(families))
        return Outcome(_unnamed(base, problem), None, (), open_, odds, tuple(status), tuple(reason))
    kept = [best[families[k]] for k in _sure(family, order)]
    least = log_score(base, problem)
    able = [
        i
        for i in kept
        if entries[i].reached and entries[i].total > base.total and log_score(entries[i], problem) >= least
    ]
    if not able:
        open_ = tuple(entries[i] for i in kept)
        return Outcome(Verdict.UNEXPLAINED, None, (), open_, odds, tuple(status), tuple(reason))
    chosen = entries[able[0]]
    status[able[0]], reason[able[0]] = Status.ACCEPTED, ""
    rivals = tuple(entries[i] for i in kept if i != able[0])
    for i in kept:
        if i != able[0]:
            status[i], reason[i] = Status.TIED, f"{gains[able[0]] - gains[i]:.1f} nats behind the chosen one"
    left_over = _unexplained(chosen, problem)
    verdict = Verdict.AMBIGUOUS if rivals else Verdict.PARTIAL if left_over else Verdict.IDENTIFIED
    return Outcome(verdict, chosen, rivals, (), odds, tuple(status), tuple(reason))


def _sure(weight: Array, order: Index) -> list[int]:
    """The likeliest of some explanations that together hold the probability asked for, by ln of their odds."""
    order = order[np.argsort(-weight[order], kind="stable")]
    share = np.exp(weight[order] - scipy.special.logsumexp(weight))
    return [int(k) for k in order[: int(np.searchsorted(np.cumsum(share), _SURE)) + 1]]


def _unnamed(base: Entry, problem: Problem) -> Verdict:
    """Nothing missing, or something that has no name."""
    hidden = not base.reached or _unexplained(base, problem)
    return Verdict.UNEXPLAINED if hidden else Verdict.NOTHING_MISSING


def _unexplained(one: Entry, problem: Problem) -> bool:
    """Whether verdicts or frequencies of chatter are not what a suspect would make itself."""
    return _unlikely(one.posterior, problem) or _elsewhere(one, problem)


def _unlikely(found: Posterior, problem: Problem) -> bool:
    """Whether the verdicts, held out by speed, are less likely than those of nearly all campaigns that the draws would
    make at these cuts (a predictive check, Rubin 1984)."""
    rng, known = np.random.default_rng([problem.seed, 40]), judged(problem.cuts)
    mine, made = 0.0, np.zeros(_REPLAYS)
    for held in folds_of(problem):
        weight = found.weights(held)
        pick = rng.choice(len(weight), _REPLAYS, p=weight)
        for k in held:
            here = np.flatnonzero(known & (problem.index == k))
            apart, sigma = found.apart[:, here], np.hypot(found.sigma, problem.scatter(k))
            of_place = apart[pick], sigma[pick], problem.shaken[here]
            outcomes = np.vstack([_said(problem)[here], replayed(*of_place, rng)])
            different, which = np.unique(outcomes, axis=0, return_inverse=True)
            said = [["stable" if one else "chatter" for one in outcome] for outcome in different]
            likely = [weight @ np.exp(of_verdicts(one, apart, sigma, problem.shaken[here])) for one in said]
            score = np.log(likely)[which.ravel()]
            mine, made = mine + score[0], made + score[1:]
    return bool(np.mean(made <= mine) < _CHANCE)


def _elsewhere(one: Entry, problem: Problem) -> bool:
    """Whether chatter was heard where it was not expected at more places than chance allows."""
    heard = np.array([cut.chatter_frequency is not None for cut in problem.cuts])
    strange = heard & (one.sung < _STRANGE * ELSEWHERE)
    places = int(np.count_nonzero(np.bincount(problem.index, strange)))
    chance = np.ones(1)  # of no place, one, two …
    for each in 1 - (1 - ELSEWHERE) ** np.bincount(problem.index, heard):
        chance = np.convolve(chance, [1 - each, each])
    return bool(np.sum(chance[places:]) < _CHANCE)


def _chance(one: Entry, problem: Problem) -> Array:
    """Probability of the verdict of every cut, from the folds it is not in."""
    return np.where(_said(problem), one.stable, 1 - one.stable)


def _said(problem: Problem) -> Mask:
    return np.array([cut.verdict == "stable" for cut in problem.cuts])
