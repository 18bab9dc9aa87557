"""A suspect against the cuts: its size and the tool drawn, weighed by how likely each draw makes what was heard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from jointlib.arrays import Array

from ..indices import Index, Mask
from .distances import Draws, Place, distances
from .evidence import of_frequency, of_verdicts, scatter, stable
from .problem import Problem
from .sampled_tool import SampledTool
from .suspects import Suspect

_BY_DRAW = ("rows", "values", "modes", "z", "sigma", "apart", "frequency", "sung", "likelihood", "prior", "family")
_ONE = 1e-9
_LOST = 6.0
"""Nats at a place beyond which it is all the same how many were lost."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of a suspect with their weights.

    Parameters
    ----------
    rows
        Which sample of the tool each draw has.
    values
        Parameters of the suspect, (draws, parameters).
    modes
        Standard normal numbers that its modes are told by, see `SampledTool.placed`.
    z
        All standard normal numbers of each draw: of the parameters, the modes and the scatter of the verdicts.
    sigma
        Scatter of the verdicts, (draws,).
    apart, frequency
        ln(b_lim/b) at every cut and the chatter there in Hz, (draws, cuts).
    sung
        ln of the density of the frequency that was heard, see `of_frequency`, (draws, cuts); 0 where none was.
    likelihood
        ln P(cuts of a place | draw), (draws, places).
    prior
        ln of prior over proposal, (draws,).
    family
        Which draw of the prior each one descends from, (draws,).
    count
        Draws that were side by side.
    """

    suspect: Suspect
    rows: Index
    values: Array
    modes: Array
    z: Array
    sigma: Array
    apart: Array
    frequency: Array
    sung: Array
    likelihood: Array
    prior: Array
    family: Index
    count: int

    @property
    def total(self) -> Array:
        """ln P(all cuts | draw), (draws,)."""
        return np.asarray(np.sum(self.likelihood, axis=1))

    def of(self, pick: Index) -> Posterior:
        """Some of the draws, in an order, any of them several times."""
        return self._with({name: getattr(self, name)[pick] for name in _BY_DRAW})

    def _with(self, parts: dict[str, Array]) -> Posterior:
        return replace(self, **parts)  # type: ignore[arg-type]

    def joined(self, others: Sequence[Posterior]) -> Posterior:
        """These draws and those of others."""
        every = [self, *others]
        return self._with({name: np.concatenate([getattr(one, name) for one in every]) for name in _BY_DRAW})

    def where(self, taken: Mask, other: Posterior) -> Posterior:
        """These draws, and in the place of some those of another population."""
        order = np.arange(len(self.rows)) + np.where(taken, len(self.rows), 0)
        return self.joined([other]).of(order)

    def weights(self, without: Sequence[int] = ()) -> Array:
        """Of the draws, summing to 1, by the cuts of all places but some."""
        kept = np.ones(self.likelihood.shape[1], dtype=bool)
        kept[list(without)] = False
        total = self.prior + np.sum(self.likelihood[:, kept], axis=1)
        return np.asarray(np.exp(total - logsumexp(total)))

    @property
    def effective(self) -> float:
        """Effective number of independent draws.

        Draws that descend from one draw of the prior are alike until they have moved far enough. How much the distances
        from the border scatter between such families, against how much they scatter at all, tells what they are worth
        (the variance estimate of Lee & Whiteley 2018, by its share between families); never more than 1/Σw², nor than
        were side by side. Where the tool is known by whole samples alone, those that count are families as well.
        """
        weight, most = self.weights(), float(self.count)
        if not self.modes.shape[1]:
            most = min(most, float(1 / np.sum(np.bincount(self.rows, weight) ** 2)))
        share = np.bincount(self.family, weight, self.count)
        apart = 1 - np.sum(share**2)
        if apart < _ONE:
            return 1.0
        off = weight[:, None] * (self.apart - weight @ self.apart)
        between = np.zeros((self.count, off.shape[1]))
        np.add.at(between, self.family, off)
        scatter = weight @ (self.apart - weight @ self.apart) ** 2
        moves = scatter > _ONE
        inflated = np.sum(between**2, axis=0)[moves] / (scatter[moves] * apart)
        found = 1 / float(np.mean(inflated)) if np.any(moves) else most
        return float(max(1.0, min(found, 1 / np.sum(weight**2), most)))

    @property
    def strain(self) -> float:
        """Standard errors by which the cuts pull the modes off what was known of them, at most."""
        return float(np.max(np.abs(self.weights() @ self.modes), initial=0.0))

    @property
    def evidence(self) -> float:
        """ln P(all cuts | the suspect), with its prior and that of the tool."""
        return float(logsumexp(self.prior + self.total) - np.log(len(self.prior)))

    def predicted(self, held: Sequence[int]) -> float:
        """ln P of the cuts of some places together, from all others."""
        weight = self.weights(held)
        return float(logsumexp(np.log(np.maximum(weight, 1e-300)) + np.sum(self.likelihood[:, list(held)], axis=1)))

    def mean(self) -> dict[str, float]:
        """Parameters in the middle: weighed medians."""
        weight = self.weights()
        return {name: _quantile(self.values[:, i], weight, 0.5) for i, (name, _) in enumerate(self.suspect.parameters)}

    def interval(self) -> dict[str, tuple[float, float]]:
        """95 % intervals of the parameters."""
        weight = self.weights()
        return {
            name: (_quantile(self.values[:, i], weight, 0.025), _quantile(self.values[:, i], weight, 0.975))
            for i, (name, _) in enumerate(self.suspect.parameters)
        }

    def told(self) -> str:
        """What is suspected as these cuts show it, in words."""
        return self.suspect.told_within(self.mean(), self.interval())


def evaluated(
    suspect: Suspect,
    problem: Problem,
    rows: Index,
    z: Array,
    family: Index,
    least: Array | None = None,
    beside: Posterior | None = None,
) -> Posterior:
    """Draws with what each of them makes of the cuts.

    Where ``least`` says how likely, in ln, a draw has to make all cuts, it is left, and makes them impossible, as soon
    as it would have to make those of the places left likelier than any draw of a population ``beside`` it does.
    """
    own, count, number = len(suspect.parameters), len(rows), len(problem.cuts)
    values, modes, sigma = suspect.values(z[:, :own]), z[:, own:-1], scatter(z[:, -1])
    group = Draws(suspect, problem.tool, problem.tool.placed(problem.tool.drawn().of(rows), modes), rows, values)
    apart, frequency, sung = np.zeros((3, count, number))
    likelihood = np.zeros((count, len(problem.places)))
    repeats = _repeats(suspect, problem)
    alive, left = np.arange(count, dtype=np.intp), np.ones(len(problem.places), dtype=bool)
    for k in np.arange(len(problem.places)) if beside is None else telling(beside):
        place = problem.places[k]
        told = distances(group, place)
        here, left[k] = np.flatnonzero(problem.index == k), False
        rungs = np.searchsorted(place.depths, [problem.cuts[i].depth for i in here])
        x, f = (part[:, rungs] for part in told[:2])
        apart[np.ix_(alive, here)], frequency[np.ix_(alive, here)] = x, f
        verdicts, forced = [str(problem.cuts[i].verdict) for i in here], problem.shaken[here]
        of_place = of_verdicts(verdicts, x, np.hypot(sigma[alive], problem.scatter(k)), forced)
        for i, own, beyond, by in zip(here, f.T, x.T, forced, strict=True):
            heard = problem.cuts[i].chatter_frequency
            if heard is not None:
                sung[alive, i] = of_frequency(heard, told[2], own, beyond, repeats[i], problem.flips(k), float(by))
        of_place = of_place + np.sum(sung[np.ix_(alive, here)], axis=1)
        likelihood[alive, k] = of_place
        if least is not None and beside is not None:
            hoped = np.max(np.sum(beside.likelihood[:, left], axis=1))
            able = np.sum(likelihood[alive], axis=1) + hoped >= least[alive]
            likelihood[alive[~able]] = -np.inf
            alive, group = alive[able], group.of(np.flatnonzero(able))
            if not len(alive):
                break
    none = np.zeros(count)
    return Posterior(suspect, rows, values, modes, z, sigma, apart, frequency, sung, likelihood, none, family, count)


def _repeats(suspect: Suspect, problem: Problem) -> list[float]:
    """Frequency in Hz by multiples of which chatter of every cut may be heard elsewhere.

    In turning nothing repeats, and no tool is heard twice as high as it is asked.
    """
    at = [problem.places[k].at for k in problem.index]
    none = 2 * float(problem.tool.lines[-1])
    return [
        none if one.cutting.process != "milling" else one.speed / 60 if suspect.by_turn else one.tooth_frequency
        for one in at
    ]


def telling(population: Posterior) -> Index:
    """The places, those first of which its draws differ most in how likely they make the cuts."""
    likely = population.likelihood
    scatter = np.std(np.maximum(likely, np.max(likely, axis=0) - _LOST), axis=0)
    return np.argsort(-scatter, kind="stable").astype(np.intp)


def seen(
    suspect: Suspect, tool: SampledTool, places: Sequence[Place], rows: Index, values: Array, modes: Array
) -> list[tuple[Array, Array]]:
    """ln(b_lim/b) and frequencies of chatter at every place, (draws, depths) each."""
    draws = Draws(suspect, tool, tool.placed(tool.drawn().of(rows), modes), rows, values)
    return [distances(draws, place)[:2] for place in places]


def probability(found: Posterior, problem: Problem, without: Sequence[int] = ()) -> Array:
    """P(stable) of every cut, from those of all places but some, (cuts,)."""
    weight = found.weights(without)
    out = np.zeros(len(problem.cuts))
    for i, k in enumerate(problem.index):
        out[i] = weight @ stable(found.apart[:, i], np.hypot(found.sigma, problem.scatter(k)), problem.shaken[i])
    return out


def _quantile(values: Array, weight: Array, share: float) -> float:
    order = np.argsort(values)
    at = int(np.searchsorted(np.cumsum(weight[order]), share))
    return float(values[order][min(at, len(order) - 1)])
