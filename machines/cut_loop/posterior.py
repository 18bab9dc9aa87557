"""A suspect against the cuts: its size and the tool drawn, weighed by how likely each draw makes what was heard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from jointlib.arrays import Array

from ..indices import Index
from ..uncertainty.drawn_machines import draws
from .distances import Place, distances
from .evidence import of_frequency, of_verdict, scatter, stable
from .problem import Problem
from .sampled_tool import SampledTool
from .suspects import Suspect

_ROUNDS, _MOST, _ENOUGH = 2, 14, 50.0
"""Times the draws are moved to where the cuts are explained, at least and at most; and how many that count end it."""
_NEAR = 0.7
"""Deviations of the prior around the likeliest draw that every second round keeps to: what explains may be narrow."""
_KEPT = 0.2
"""Share of the draws that stays with the prior."""
_FEWEST = 30.0
"""Effective draws that the next round is guided by; a likelihood that leaves fewer is flattened until it does not."""


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
    sigma
        Scatter of the verdicts, (draws,).
    apart, frequency
        ln(b_lim/b) at every cut and the chatter there in Hz, (draws, cuts).
    likelihood
        ln P(cut | draw), (draws, cuts).
    prior
        ln of prior over proposal, (draws,).
    """

    suspect: Suspect
    rows: Index
    values: Array
    modes: Array
    sigma: Array
    apart: Array
    frequency: Array
    likelihood: Array
    prior: Array

    def joined(self, other: Posterior) -> Posterior:
        """The draws of both."""
        names = ("rows", "values", "modes", "sigma", "apart", "frequency", "likelihood", "prior")
        both = {name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in names}
        return replace(self, **both)  # type: ignore[arg-type]

    def weights(self, without: Sequence[int] = ()) -> Array:
        """Of the draws, summing to 1, by all cuts but some."""
        kept = np.ones(self.likelihood.shape[1], dtype=bool)
        kept[list(without)] = False
        total = self.prior + np.sum(self.likelihood[:, kept], axis=1)
        return np.asarray(np.exp(total - logsumexp(total)))

    @property
    def effective(self) -> float:
        """Effective number of draws, 1/Σw²."""
        return float(1 / np.sum(self.weights() ** 2))

    @property
    def strain(self) -> float:
        """Standard errors by which the cuts pull the modes off what was known of them, at most."""
        return float(np.max(np.abs(self.weights() @ self.modes), initial=0.0))

    @property
    def evidence(self) -> float:
        """ln P(all cuts | the suspect), with its prior and that of the tool."""
        return float(logsumexp(self.prior + np.sum(self.likelihood, axis=1)) - np.log(len(self.prior)))

    def predicted(self, held: Sequence[int]) -> float:
        """ln P of some cuts together, from all others."""
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


@dataclass(frozen=True, eq=False)
class Proposal:
    """Where a round of draws came from: the prior, or for most of them the neighbourhood of weighed draws."""

    centres: Array
    weight: Array
    root: Array
    of_row: Array

    def drawn(self, count: int, rng: np.random.Generator) -> tuple[Index, Array]:
        """Rows of the tool and standard normal numbers."""
        fresh = rng.standard_normal((count, self.centres.shape[1]))
        stays = rng.uniform(size=count) < _KEPT
        near = self.centres[rng.choice(len(self.centres), count, p=self.weight)] + fresh @ self.root.T
        rows = np.asarray(rng.choice(len(self.of_row), count, p=self.of_row), dtype=np.intp)
        return rows, np.where(stays[:, None], fresh, near)

    def over_prior(self, rows: Index, z: Array) -> Array:
        """ln of its density over the prior's."""
        plain = -0.5 * np.sum(z**2, axis=1)
        near = _mixture(z, self.centres, self.weight, self.root)
        mixed = np.logaddexp(np.log(_KEPT) + plain, np.log(1 - _KEPT) + near) - plain
        return np.asarray(mixed + np.log(self.of_row[rows] * len(self.of_row)))


def posterior(suspect: Suspect, problem: Problem) -> Posterior:
    """Draw from the prior, then from where the cuts are explained, with the weights that this costs.

    The tool's samples are drawn anew from among themselves, the suspect's parameters and the modes from normal
    distributions around the weighed draws (population Monte Carlo, Cappé et al. 2004); a fifth of the draws stays with
    the prior, so that no region is lost. All rounds count, each draw over the mean of what it could have been drawn
    from (Cornuet et al. 2012).
    """
    count, name = problem.tool.count, f"{suspect.family} {suspect.member}"
    size = len(suspect.parameters) + problem.tool.freedom  # and the scatter of the verdicts, which comes last
    z = draws(f"cuts {name}", count, size + 1, problem.seed)
    rows: Index = np.arange(count, dtype=np.intp)
    found = _evaluated(suspect, problem, rows, z)
    proposals = list[Proposal]()
    for turn in range(_MOST):
        if turn >= _ROUNDS and found.effective >= _ENOUGH:
            break
        rng = np.random.default_rng([problem.seed, turn, len(name)])
        proposals.append(_around(found, z, count, rng, narrow=turn % 2 == 1))
        new_rows, new = proposals[-1].drawn(count, rng)
        fresh = _evaluated(suspect, problem, new_rows, new)
        z = np.concatenate([z, new])
        joined = found.joined(fresh)
        over = [np.zeros(len(z)), *(one.over_prior(joined.rows, z) for one in proposals)]
        found = replace(joined, prior=np.log(len(over)) - logsumexp(np.array(over), axis=0))
    return found


def _around(found: Posterior, z: Array, count: int, rng: np.random.Generator, narrow: bool) -> Proposal:
    """The neighbourhood of what explains the cuts."""
    weight = _flattened(found)
    heaped = np.asarray(np.bincount(found.rows, weight, count), dtype=float)
    of_row = (1 - _KEPT) * heaped / np.sum(heaped) + _KEPT / count
    size = z.shape[1]
    if narrow:
        best = z[int(np.argmax(found.prior + np.sum(found.likelihood, axis=1)))]
        weight = weight * np.exp(-0.5 * np.sum((z - best) ** 2, axis=1) / _NEAR**2) + 1e-12 * weight
        weight = weight / np.sum(weight)
    middle = weight @ z
    spread = (z - middle).T @ ((z - middle) * weight[:, None])
    effective = 1 / np.sum(weight**2)
    width = (4 / (size + 2) / effective) ** (1 / (size + 4))  # Silverman's
    root = np.asarray(np.linalg.cholesky(width**2 * spread + 1e-4 * np.eye(size)), dtype=float)
    picked = rng.choice(len(z), count, p=weight)
    return Proposal(z[picked], np.full(count, 1 / count), root, of_row)


def _mixture(z: Array, centres: Array, weight: Array, root: Array) -> Array:
    """ln of a sum of normal densities around weighed centres, but for the constant that the prior shares."""
    a, b = (np.linalg.solve(root, part.T).T for part in (z, centres))
    apart = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
    total = logsumexp(np.log(np.maximum(weight, 1e-300)) - 0.5 * apart, axis=1)
    return np.asarray(total - np.sum(np.log(np.diag(root))))


def _evaluated(suspect: Suspect, problem: Problem, rows: Index, z: Array) -> Posterior:
    own = len(suspect.parameters)
    values, modes, sigma = suspect.values(z[:, :own]), z[:, own:-1], scatter(z[:, -1])
    told = seen(suspect, problem.tool, problem.places, rows, values, modes)
    apart, frequency = np.zeros((len(rows), len(problem.cuts))), np.zeros((len(rows), len(problem.cuts)))
    likelihood = np.zeros((len(rows), len(problem.cuts)))
    for i, (cut, k) in enumerate(zip(problem.cuts, problem.index, strict=True)):
        rung = int(np.searchsorted(problem.places[k].depths, cut.depth))
        apart[:, i], frequency[:, i] = (part[:, rung] for part in told[k])
        likelihood[:, i] = of_verdict(str(cut.verdict), apart[:, i] / np.hypot(sigma, problem.scatter(k)))
        if cut.chatter_frequency is not None:
            at = problem.places[k].at
            repeats = at.speed / 60 if suspect.by_turn else at.tooth_frequency
            likelihood[:, i] += of_frequency(
                cut.chatter_frequency, frequency[:, i], apart[:, i], repeats, problem.flips(k)
            )
    return Posterior(suspect, rows, values, modes, sigma, apart, frequency, likelihood, np.zeros(len(rows)))


def seen(
    suspect: Suspect, tool: SampledTool, places: Sequence[Place], rows: Index, values: Array, modes: Array
) -> list[tuple[Array, Array]]:
    """ln(b_lim/b) and frequencies of chatter at every place, (draws, depths) each."""
    base = tool.placed(tool.drawn().of(rows), modes)
    return [distances(suspect, tool, place, base, rows, values) for place in places]


def probability(found: Posterior, problem: Problem, without: Sequence[int] = ()) -> Array:
    """P(stable) of every cut, from all but some of them, (cuts,)."""
    weight = found.weights(without)
    out = np.zeros(len(problem.cuts))
    for i, k in enumerate(problem.index):
        out[i] = weight @ stable(found.apart[:, i], np.hypot(found.sigma, problem.scatter(k)))
    return out


def _flattened(found: Posterior) -> Array:
    """Weights of the likelihood to a power below 1, as high as leaves enough effective draws."""
    total = found.prior + np.sum(found.likelihood, axis=1)
    for power in np.linspace(1.0, 0.05, 20):
        weight = np.exp(power * total - logsumexp(power * total))
        if 1 / np.sum(weight**2) >= min(_FEWEST, len(weight) / 4):
            break
    return np.asarray(weight)


def _quantile(values: Array, weight: Array, share: float) -> float:
    order = np.argsort(values)
    at = int(np.searchsorted(np.cumsum(weight[order]), share))
    return float(values[order][min(at, len(order) - 1)])
