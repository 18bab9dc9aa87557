"""A suspect against the cuts: its size and the tool drawn, weighed by how likely each draw makes what was heard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from jointlib.arrays import Array
from jointlib.cuts.tried_cut import TriedCut

from ..indices import Index
from ..uncertainty.drawn_machines import draws
from .borders import Condition, border, met, still
from .evidence import distance as distance_of
from .evidence import of_frequency, of_verdict, scatter, stable
from .exactness import Exactness
from .sampled_tool import SampledTool
from .suspects import Suspect

_ROUNDS, _MOST, _ENOUGH = 2, 9, 30.0
"""Times the draws are moved to where the cuts are explained, at least and at most; and how many that count end it."""
_KEPT = 0.2
"""Share of the draws that stays with the prior."""
_FEWEST = 30.0
"""Effective draws that the next round is guided by; a likelihood that leaves fewer is flattened until it does not."""


@dataclass(frozen=True, eq=False)
class Problem:
    """The cuts, where they were made, and the tool that made them."""

    cuts: tuple[TriedCut, ...]
    conditions: tuple[Condition, ...]
    index: Index
    """The condition of each cut."""
    tool: SampledTool
    exactness: Exactness
    seed: int


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
    depth, frequency
        Of the borders, (draws, conditions), m and Hz.
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
    depth: Array
    frequency: Array
    likelihood: Array
    prior: Array

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


def posterior(suspect: Suspect, problem: Problem) -> Posterior:
    """Draw from the prior, then from where the cuts are explained, with the weights that this costs.

    The tool's samples are drawn anew from among themselves, the suspect's parameters and the modes from normal
    distributions around the weighed draws (population Monte Carlo, Cappé et al. 2004); a fifth of the draws stays with
    the prior, so that no region is lost.
    """
    count, name = problem.tool.count, f"{suspect.family} {suspect.member}"
    size = len(suspect.parameters) + problem.tool.freedom  # and the scatter of the verdicts, which comes last
    z = draws(f"cuts {name}", count, size + 1, problem.seed)
    rows: Index = np.arange(count, dtype=np.intp)
    prior: Array = np.zeros(count)
    found = _evaluated(suspect, problem, rows, z, prior)
    for turn in range(_MOST):
        if turn >= _ROUNDS and found.effective >= _ENOUGH:
            break
        rng = np.random.default_rng([problem.seed, turn, len(name)])
        weight = _flattened(found)
        heaped = np.asarray(np.bincount(found.rows, weight, count), dtype=float)
        of_row = (1 - _KEPT) * heaped / np.sum(heaped) + _KEPT / count
        centres, middle = z, weight @ z
        spread = (z - middle).T @ ((z - middle) * weight[:, None])
        effective = 1 / np.sum(weight**2)
        width = (4 / (size + 3) / effective) ** (1 / (size + 5))  # Silverman's, in size + 1 dimensions
        root = np.asarray(np.linalg.cholesky(width**2 * spread + 1e-4 * np.eye(size + 1)), dtype=float)
        fresh = rng.standard_normal((count, size + 1))
        stays = rng.uniform(size=count) < _KEPT
        z = np.where(stays[:, None], fresh, centres[rng.choice(count, count, p=weight)] + fresh @ root.T)
        rows = np.asarray(rng.choice(count, count, p=of_row), dtype=np.intp)
        plain = -0.5 * np.sum(z**2, axis=1)
        near = _mixture(z, centres, weight, root)
        prior = plain - np.logaddexp(np.log(_KEPT) + plain, np.log(1 - _KEPT) + near) - np.log(of_row[rows] * count)
        found = _evaluated(suspect, problem, rows, z, prior)
    return found


def _mixture(z: Array, centres: Array, weight: Array, root: Array) -> Array:
    """ln of a sum of normal densities around weighed centres, but for the constant that the prior shares."""
    a, b = (np.linalg.solve(root, part.T).T for part in (z, centres))
    apart = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
    total = logsumexp(np.log(np.maximum(weight, 1e-300)) - 0.5 * apart, axis=1)
    return np.asarray(total - np.sum(np.log(np.diag(root))))


def _evaluated(suspect: Suspect, problem: Problem, rows: Index, z: Array, prior: Array) -> Posterior:
    own = len(suspect.parameters)
    values, modes, sigma = suspect.values(z[:, :own]), z[:, own:-1], scatter(z[:, -1])
    depth, frequency = borders_of(suspect, problem.tool, problem.conditions, problem.exactness, rows, values, modes)
    likelihood = np.zeros((len(rows), len(problem.cuts)))
    for i, (cut, k) in enumerate(zip(problem.cuts, problem.index, strict=True)):
        wide = np.hypot(sigma, problem.exactness.scatter[k])
        likelihood[:, i] = of_verdict(str(cut.verdict), distance_of(depth[:, k], cut.depth, wide))
        if cut.chatter_frequency is not None and cut.verdict == "chatter":
            at, flip = problem.conditions[k], bool(problem.exactness.flip[k])
            likelihood[:, i] += of_frequency(cut.chatter_frequency, frequency[:, k], at.tooth_frequency, flip)
    return Posterior(suspect, rows, values, modes, sigma, depth, frequency, likelihood, prior)


def borders_of(
    suspect: Suspect,
    tool: SampledTool,
    conditions: Sequence[Condition],
    exactness: Exactness | None,
    rows: Index,
    values: Array,
    modes: Array,
) -> tuple[Array, Array]:
    """Depths in m and frequencies in Hz, (draws, conditions); by zero order where there is no exactness."""
    base = tool.placed(tool.drawn().of(rows), modes)
    depth, frequency = np.zeros((len(rows), len(conditions))), np.zeros((len(rows), len(conditions)))
    changed, G, shared, of = None, None, None, None
    for k, at in enumerate(conditions):
        if changed is None or G is None or suspect.by_speed:
            changed, shared = suspect.changed(base, values, at.speed), None
            G = tool.response(changed, rows)
        forces = changed.tangential, changed.normal
        damping = changed.damping + (at.cutting.process_damping or 0.0)
        if np.any(damping):
            depth[:, k], frequency[:, k] = border(G, tool.lines, at, *forces, damping)
        else:
            if shared is None or of != at.cutting:
                shared, of = still(G, at, *forces), at.cutting
            depth[:, k], frequency[:, k] = met(shared, tool.lines, at)
        if exactness is not None:
            depth[:, k] *= np.exp(exactness.logarithm(changed, k))
            frequency[:, k] += exactness.shift[k]
    return depth, frequency


def probability(found: Posterior, problem: Problem, without: Sequence[int] = ()) -> Array:
    """P(stable) of every cut, from all but some of them, (cuts,)."""
    weight = found.weights(without)
    out = np.zeros(len(problem.cuts))
    for i, (cut, k) in enumerate(zip(problem.cuts, problem.index, strict=True)):
        wide = np.hypot(found.sigma, problem.exactness.scatter[k])
        out[i] = weight @ stable(found.depth[:, k], cut.depth, wide)
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
