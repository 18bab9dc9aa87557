"""Plans: which configurations of the factors a study computes, as quantiles in [0, 1]."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from jointlib.arrays import Array
from jointlib.errors import InputError

from .factors import Factor

METHODS = ("factorial", "latin-hypercube", "sobol", "pareto")
SEARCH = "pareto"
"""The method that plans designs only as results of others are known."""
_MOST = 20_000_000


def plan(factors: Sequence[Factor], method: str, count: int, seed: int) -> Array:
    """Quantiles of every factor, (configurations, factors); the same arguments give the same plan.

    ``factorial``: every combination of lists and levels. ``latin-hypercube``: ``count`` configurations, each factor
    evenly spread. ``sobol``: the matrices of Saltelli's scheme for variance-based sensitivities, ``count`` (a power of
    two) base points and count · (factors + 2) configurations, in the order A, B, then A with column i from B.
    """
    if method == "factorial":
        return _factorial(factors)
    if method == "latin-hypercube":
        return np.asarray(stats.qmc.LatinHypercube(len(factors), rng=np.random.default_rng(seed)).random(count))
    if count & (count - 1) or count < 2:
        raise InputError(f"[sampling]: count is {count}, expected a power of two for 'sobol'")
    base = stats.qmc.Sobol(2 * len(factors), rng=np.random.default_rng(seed)).random(count)
    A, B = base[:, : len(factors)], base[:, len(factors) :]
    mixed = [np.where(np.arange(len(factors)) == i, B, A) for i in range(len(factors))]
    return np.concatenate([A, B, *mixed])


def _factorial(factors: Sequence[Factor]) -> Array:
    for factor in factors:
        if not factor.choices and factor.levels < 1:
            raise InputError(
                f"[[factor]] {factor.name!r}: a full factorial needs its values, "
                "expected a list or levels with the range"
            )
    axes = [factor.midpoints for factor in factors]
    size = int(np.prod([len(axis) for axis in axes], dtype=float))
    if size > _MOST:
        raise InputError(f"[sampling]: the full factorial has {size:,} configurations, expected at most {_MOST:,}")
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


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
    blocks: Any = {"f_A": values[:1], "f_B": values[1:2], "f_AB": values[2:][:, None, :]}
    found = stats.sobol_indices(func=blocks, n=values.shape[1])
    return np.ravel(found.first_order), np.ravel(found.total_order)
