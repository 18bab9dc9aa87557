"""What to cut next: the cut whose verdict tells most, and the most productive one that is safe enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from ..cutting.process.cutting import Cutting
from ..model.machine import Machine
from .borders import condition
from .contest import Entry
from .evidence import stable
from .exactness import learnt
from .posterior import Problem, borders_of
from .suspects import AsItIs

_SPEEDS, _DEPTHS, _DRAWS = 25, 32, 200
_SHARES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Advice:
    """A cut to make: rpm, m, the probability that it is stable, and bits that its verdict is expected to tell."""

    speed: float
    depth: float
    probability: float
    bits: float


@dataclass(frozen=True, eq=False)
class Outlook:
    """Borders over the range: ``before`` and ``after`` are 5, 50 and 95 % of the depth in m, (3, speeds)."""

    speed: Array
    before: Array
    after: Array
    next_cut: Advice
    safe_cut: Advice | None
    """None where no cut is as safe as was asked for."""


def outlook(machine: Machine, problem: Problem, believed: Sequence[Entry], safe: float, seed: int) -> Outlook:
    """Borders as the inputs have them and as the cuts leave them, and what to cut next.

    ``believed`` are the entries that cannot be ruled out, weighed by their scores on held-out cuts. A verdict tells
    H(mean p) − mean H(p) bits of them, H the entropy of a coin. ``safe`` is the probability that a safe cut has.
    """
    table = Cutting(**dict(machine.cutting or {}))
    told = [cut.speed for cut in problem.cuts]
    low, high = table.speed or (min(told), max(told))
    low = max(low, 0.7 * min(told))
    speeds = np.round(np.linspace(low, high, _SPEEDS), -1)
    conditions = [condition(problem.conditions[problem.index[0]].cutting, float(n), machine.tool_axes) for n in speeds]
    exact = learnt(machine, problem.tool, conditions, seed, tools=1)
    rng = np.random.default_rng([seed, 30])
    rows = np.asarray(rng.choice(problem.tool.count, _DRAWS), dtype=np.intp)
    modes = rng.standard_normal((_DRAWS, problem.tool.freedom))
    before, _ = borders_of(AsItIs(), problem.tool, conditions, exact, rows, np.zeros((_DRAWS, 0)), modes)
    share = np.exp(np.array([one.total for one in believed]) - max(one.total for one in believed))
    depths, sigmas = [], []
    for one, many in zip(believed, np.ceil(share / np.sum(share) * _DRAWS).astype(int), strict=True):
        found = one.posterior
        pick = rng.choice(len(found.rows), int(many), p=found.weights())
        drawn = found.rows[pick], found.values[pick], found.modes[pick]
        depths.append(borders_of(found.suspect, problem.tool, conditions, exact, *drawn)[0])
        sigmas.append(found.sigma[pick])
    depth, sigma = np.concatenate(depths), np.concatenate(sigmas)[:, None]
    middle = np.quantile(depth, 0.5, axis=0, method="inverted_cdf")
    finite = middle[np.isfinite(middle)]
    top = 1.5 * float(np.max(finite)) if len(finite) else 2 * max(cut.depth for cut in problem.cuts)
    tried = np.linspace(top / _DEPTHS, top, _DEPTHS)
    chance = np.array([[stable(depth[:, i], float(b), sigma[:, 0]) for b in tried] for i in range(len(speeds))])
    mean = np.mean(chance, axis=2)
    bits = _entropy(mean) - np.mean(_entropy(chance), axis=2)
    i, k = np.unravel_index(int(np.argmax(bits)), bits.shape)
    best = Advice(float(speeds[i]), float(tried[k]), float(mean[i, k]), float(bits[i, k]))
    removed = np.where(mean >= safe, speeds[:, None] * tried, -1.0)
    i, k = np.unravel_index(int(np.argmax(removed)), removed.shape)
    held = (
        Advice(float(speeds[i]), float(tried[k]), float(mean[i, k]), float(bits[i, k])) if removed[i, k] > 0 else None
    )
    was, now = (np.asarray(np.quantile(part, _SHARES, axis=0, method="inverted_cdf")) for part in (before, depth))
    return Outlook(speeds, was, now, best, held)


def _entropy(p: Array) -> Array:
    """Bits of a coin."""
    return np.asarray(-(p * np.log2(p) + (1 - p) * np.log2(1 - p)))
