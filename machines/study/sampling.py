"""Plans: which configurations of the factors a study computes, as quantiles in [0, 1]."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError

from .factors import Factor

METHODS = ("factorial", "latin-hypercube", "sobol", "pareto")
SEARCH = "pareto"
"""The method that plans designs only as results of others are known."""
MOST = 20_000_000
"""Configurations that a plan may hold."""


def plan(factors: Sequence[Factor], method: str, count: int, seed: int) -> Array:
    """Quantiles of every factor, (configurations, factors); the same arguments give the same plan.

    ``factorial``: every combination of lists and levels. ``latin-hypercube``: ``count`` configurations, each factor
    evenly spread. ``sobol``: the matrices of Saltelli's scheme for variance-based sensitivities, ``count`` (a power of
    two) base points and count · (factors + 2) configurations, in the order A, B, then A with column i from B.
    """
    refuse_many(plan_size(factors, method, count), "configurations")
    if method == "factorial":
        axes = [factor.midpoints for factor in factors]
        return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)
    if method == "latin-hypercube":
        return np.asarray(scipy.stats.qmc.LatinHypercube(len(factors), rng=np.random.default_rng(seed)).random(count))
    base = scipy.stats.qmc.Sobol(2 * len(factors), rng=np.random.default_rng(seed)).random(count)
    A, B = base[:, : len(factors)], base[:, len(factors) :]
    mixed = [np.where(np.arange(len(factors)) == i, B, A) for i in range(len(factors))]
    return np.concatenate([A, B, *mixed])


def plan_size(factors: Sequence[Factor], method: str, count: int) -> int:
    """How many configurations of the factors a plan holds."""
    if method == "factorial":
        for factor in factors:
            if not factor.choices and factor.levels < 1:
                raise InputError(
                    f"[[factor]] {factor.name!r}: a full factorial needs its values, "
                    "expected a list or levels with the range"
                )
        return math.prod(len(f.choices) or f.levels for f in factors)
    if method == "sobol":
        if count & (count - 1) or count < 2:
            raise InputError(f"[sampling]: count is {count}, expected a power of two for 'sobol'")
        return count * (len(factors) + 2)
    return count


def refuse_many(count: int, what: str) -> None:
    """Refuse more than a plan may hold."""
    if count > MOST:
        raise InputError(f"[sampling]: asks for {count:,} {what}, expected at most {MOST:,}")


def checked_search(factors: Sequence[Factor], count: int, population: int, where: str) -> None:
    """Refuse a search without a choice, of less than a generation, or of no less than all there is."""
    there = math.prod(len(f.choices) or math.inf for f in factors)
    if there == 1:
        raise InputError(f"{where}: no factor has anything to choose, expected a design factor with several values")
    if there <= count:
        raise InputError(
            f"{where}: [sampling]: the lists have {there} combinations and count is {count}, "
            'expected method = "factorial" or a smaller count'
        )
    if population > count:
        raise InputError(f"{where}: [sampling]: population is {population} and count {count}, expected at most as many")


def sensitivities(results: Array, factors: int) -> tuple[Array, Array]:
    """First-order and total Sobol indices of a result over a ``sobol`` plan, one per factor.

    First order is the share of the variance that a factor explains alone; total adds every interaction it takes part
    in (Saltelli et al. 2010, as scipy computes them).
    """
    values = np.asarray(results, dtype=float).reshape(factors + 2, -1)
    # Twice the same result: of a single one with a single factor scipy drops every axis, and stumbles.
    A, B, mixed = values[[0, 0]], values[[1, 1]], np.repeat(values[2:, None], 2, axis=1)
    found = scipy.stats.sobol_indices(func={"f_A": A, "f_B": B, "f_AB": mixed}, n=values.shape[1])
    return np.reshape(found.first_order, (2, -1))[0], np.reshape(found.total_order, (2, -1))[0]
