"""Candidates compete: held-out gain of a family over the refitted model, record by record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.fault import Shape
from jointlib.loop.contest.model import Model
from jointlib.loop.contest.trial import Trial, solve

_ROUNDS, _POINTS = 3, 8
_BOX_ROUNDS = 6


@dataclass(frozen=True)
class Score:
    """A family as it fared: best shape on all training records, and the held-out gain with the shape chosen anew."""

    family: str
    best: Trial
    gain: float
    """G = Σ over left-out records of the drop in their loss."""
    per_fold: tuple[float, ...]
    active: tuple[bool, ...]
    z: float
    bic: float
    complexity: int
    """Columns and shape parameters."""


def score(model: Model, family: str, trials: Sequence[Trial], families: int) -> Score:
    """Leave one part out in turn; the shape is chosen on the others each time."""
    G, b = np.array([t.gram for t in trials]), np.array([t.moment for t in trials])
    p = G.shape[-1] - trials[0].size
    per_fold, whole = [], np.diagonal(G.sum(axis=1), axis1=-2, axis2=-1)
    for h in range(G.shape[1]):
        trained, target = G.sum(axis=1) - G[:, h], b.sum(axis=1) - b[:, h]
        theta = solve(trained, target, whole)
        best = int(np.argmax(np.einsum("ti,ti->t", theta, target)))
        after = _loss(G[best, h], b[best, h], theta[best])
        alone = solve(trained[0, :p, :p], target[0, :p], whole[0, :p]) if p else np.zeros(0)
        per_fold.append(_loss(G[0, h, :p, :p], b[0, h, :p], alone) - after)
    chosen = max(trials, key=lambda t: t.gain)
    share = chosen.moved
    d2 = float(share.sum())
    chi2 = max(1.0, (model.loss - chosen.gain) / model.entries)
    gain = float(sum(per_fold))
    complexity = chosen.size + len(chosen.shape)
    return Score(
        family=family,
        best=chosen,
        gain=gain,
        per_fold=tuple(per_fold),
        active=tuple(bool(s) for s in share >= 0.01 * d2),
        z=gain / np.sqrt(2 * d2 * chi2) if d2 > 0 else 0.0,
        bic=gain - 0.5 * (complexity + 1) * np.log(model.entries) - np.log(max(1, families)),
        complexity=complexity,
    )


def _loss(G: Array, b: Array, theta: Array) -> float:
    """Loss with coefficients θ less the loss without columns."""
    return float(theta @ G @ theta - 2 * theta @ b)


def refined(trials: Sequence[Trial], evaluate: Callable[[Sequence[Shape]], Sequence[Trial]]) -> tuple[Trial, ...]:
    """The trials with those of a narrowing search around the best one.

    Positive shape parameters are searched on a logarithmic scale; one that takes both signs on the grid is a side,
    and keeps its value. Each round tries a line of points (one parameter) or a box of neighbours (several) at once.
    """
    start = max(trials, key=lambda t: t.gain)
    names = [
        n
        for n, value in start.shape.items()
        if value > 0
        and min(t.shape[n] for t in trials) >= 0
        and len({t.shape[n] for t in trials if t.shape[n] > 0}) > 1
    ]
    if not names:
        return tuple(trials)
    visited = list(trials)
    width = np.array([_spacing([t.shape[n] for t in trials], start.shape[n]) for n in names])
    if len(names) == 1:
        stencil, rounds, shrink = np.linspace(-1, 1, _POINTS)[:, None], _ROUNDS, 2 / (_POINTS - 1)
    else:
        box = np.stack(np.meshgrid(*[(-1.0, 0.0, 1.0)] * len(names), indexing="ij"), axis=-1).reshape(-1, len(names))
        stencil, rounds, shrink = box[np.any(box != 0, axis=1)], _BOX_ROUNDS, 0.5
        width = width / 2
    for _ in range(rounds):
        best = max(visited, key=lambda t: t.gain)
        at = np.log([best.shape[n] for n in names])
        points = np.exp(at + stencil * width)
        visited += evaluate([{**best.shape, **dict(zip(names, x.tolist(), strict=True))} for x in points])
        width = width * shrink
    return tuple(visited)


def _spacing(values: Sequence[float], here: float) -> float:
    """Logarithmic distance to the nearest other value on the grid."""
    others = np.array([v for v in values if v > 0 and v != here])
    return float(np.min(np.abs(np.log(others / here))))


def simplest_of_ties(model: Model, ranked: Sequence[Score], distance: Callable[[Score, Score], float]) -> Score:
    """Nested preference: among the first four, those as good as the best within its noise; the least complex wins.

    ``distance`` is d², the squared distance of what two candidates predict.
    """
    first = ranked[0]
    chi2 = max(1.0, (model.loss - first.best.gain) / model.entries)
    ties = [
        s
        for s in ranked[:4]
        if s is first or first.gain - s.gain < max(10.0, 4 * np.sqrt(2 * distance(first, s) * chi2))
    ]
    return min(ties, key=lambda s: (s.complexity, -s.gain))


def rivals_of(
    model: Model, chosen: Score, ranked: Sequence[Score], distance: Callable[[Score, Score], float]
) -> tuple[Score, ...]:
    """Families among the first eight that the data cannot separate from the chosen one."""
    chi2 = max(1.0, (model.loss - chosen.best.gain) / model.entries)
    return tuple(
        s
        for s in ranked[:8]
        if s.family != chosen.family
        and chosen.gain - s.gain < max(3 * np.sqrt(2 * distance(chosen, s) * chi2), 0.01 * chosen.gain)
    )
