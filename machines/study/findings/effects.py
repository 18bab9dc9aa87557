"""What a result depends on: its mean over every value of a factor, and the share of its variance that follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..factors import Factor
from ..sampling import sensitivities
from ..study import ROUNDING

_LEVELS = 12
"""Different values up to which each is a level of its own."""
_IDLE = 1e-3
"""Share of the variance of a result below which a factor has no say in it."""
_BINS = 6
_LONG = 24
"""Letters of a value that a picture has room for."""
_FEWEST = 3
"""Designs that a bin needs at least."""


@dataclass(frozen=True, eq=False)
class Effect:
    """How a result follows one factor."""

    factor: Factor
    place: Array
    """Values of the factor: those of its levels, or the mean of those in each bin."""
    mean: Array
    """Mean of the result over all designs with that value (in that bin)."""
    first: float
    """Share of the variance of the result that the factor explains alone."""
    total: float | None
    """The same with every interaction that it takes part in; None where the plan does not tell."""

    @property
    def words(self) -> list[str]:
        """The values as people read them, cut off where they are long."""
        full = [self.factor.words(float(f"{x:.3g}")) for x in self.place]
        return [word if len(word) <= _LONG else f"{word[:_LONG]}…" for word in full]


def effects(factors: Sequence[Factor], numbers: Array, result: Array, method: str) -> list[Effect]:
    """Effects of the design factors (columns of ``numbers``) on a result of every design.

    The share is V(E(y|x))/V(y), the first-order index of Sobol; the total one is 1 − V(E(y|others))/V(y). A full
    factorial tells both exactly, for its values taken as equally likely; a ``sobol`` plan by Saltelli's scheme. From
    any other plan the first comes from bins, less what unrelated bins would show (Kelley's ε²), and the total is not
    told. Designs without a finite result are left out, and then bins tell what they can.
    """
    finite = np.isfinite(result)
    if not finite.any() or np.ptp(result[finite]) <= ROUNDING * np.max(np.abs(result[finite])):
        return []
    binned = [_binned(f, numbers[finite, i], result[finite]) for i, f in enumerate(factors)]
    if not finite.all():
        return binned
    if method == "sobol":
        first, total = sensitivities(result, len(factors))
    elif method == "factorial":
        first, total = _crossed(numbers, result)
    else:
        return binned
    told = zip(binned, first, total, strict=True)
    return [Effect(e.factor, e.place, e.mean, float(a), float(b)) for e, a, b in told]


def matters(found: Mapping[str, Sequence[Effect]], factor: Factor) -> bool:
    """Whether a factor has a say in any of the results, whose effects are known; where none are, nobody knows."""
    own = [effect for each in found.values() for effect in each if effect.factor == factor]
    return not found or any(max(effect.first, effect.total or 0.0) > _IDLE for effect in own)


def _crossed(numbers: Array, result: Array) -> tuple[Array, Array]:
    """Exact indices of a full factorial, whose rows run through the values of the last factor fastest."""
    grid = result.reshape([len(np.unique(column)) for column in numbers.T])
    axes = range(grid.ndim)
    alone = [grid.mean(axis=tuple(j for j in axes if j != i)) for i in axes]
    first = np.array([np.var(mean) for mean in alone]) / np.var(result)
    total = 1 - np.array([np.var(grid.mean(axis=i)) for i in axes]) / np.var(result)
    return first, total


def _binned(factor: Factor, x: Array, y: Array) -> Effect:
    levels, of = np.unique(x, return_inverse=True)
    if len(levels) > _LEVELS:
        bins = max(2, min(_BINS, len(x) // _FEWEST))
        of = (np.argsort(np.argsort(x, kind="stable"), kind="stable") * bins) // len(x)
    count = np.bincount(of)
    place, mean = np.bincount(of, x) / count, np.bincount(of, y) / count
    between, whole = float(count @ (mean - y.mean()) ** 2), float(np.sum((y - y.mean()) ** 2))
    free = len(y) - len(count)
    chance = (len(count) - 1) * (whole - between) / free if free > 0 else 0.0
    return Effect(factor, place, mean, max(0.0, (between - chance) / whole), None)
