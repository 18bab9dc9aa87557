"""Candidates compete: held-out gain of a family over the refitted model, record by record."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import qr
from scipy.optimize import minimize

from jointlib.arrays import Array

Shape = Mapping[str, float]
_ROUNDS, _POINTS = 3, 8
_SIMPLEX_STEPS = 25
_DEPENDENT = 1e-5
"""A column of which less than this share is left after the model's columns cannot be told from them."""


@dataclass(frozen=True)
class Model:
    """Whitened residual y and the columns the current model can move by, real parts and imaginary parts stacked.

    y has n entries, columns are rows of an array (p, n), ``records`` says to which record an entry belongs. Losses
    are sums of squares; where nothing is missing E Σy² is ``entries``, the number of valid complex entries.
    """

    y: Array
    columns: Array
    records: tuple[slice, ...]
    entries: int

    @cached_property
    def basis(self) -> Array:
        """Orthonormal rows that span the columns; dependent columns are dropped."""
        if not len(self.columns):
            return self.columns
        size = np.linalg.norm(self.columns, axis=1, keepdims=True)
        scaled = (self.columns / np.where(size > 0, size, 1)).T
        Q, R, _ = qr(scaled, mode="economic", pivoting=True)
        rank = int(np.sum(np.abs(np.diag(R)) > _DEPENDENT))
        return np.ascontiguousarray(Q[:, :rank].T)

    @cached_property
    def left(self) -> Array:
        """y after the best fit of the model's own columns."""
        return self.y - (self.basis @ self.y) @ self.basis

    @property
    def loss(self) -> float:
        return float(self.left @ self.left)

    def without(self, block: Array) -> Array | None:
        """What the model's columns leave of a candidate's columns; None where that is nothing."""
        size = np.linalg.norm(block, axis=1)
        if not np.all(np.isfinite(size)) or np.any(size == 0):
            return None
        rest = block - (block @ self.basis.T) @ self.basis
        rest = rest - (rest @ self.basis.T) @ self.basis
        if np.any(np.linalg.norm(rest, axis=1) < _DEPENDENT * size):
            return None
        return np.asarray(rest)


@dataclass(frozen=True)
class Trial:
    """One family at one shape: its Gram matrices with the model, record by record."""

    shape: Shape
    rest: Array
    gram: Array
    """(records, p + q, p + q)."""
    moment: Array
    """(records, p + q)."""

    @cached_property
    def coefficients(self) -> Array:
        q = len(self.rest)
        G = self.gram.sum(axis=0)[-q:, -q:]
        return _solve(G, self.moment.sum(axis=0)[-q:])

    @property
    def gain(self) -> float:
        """Drop of the training loss."""
        return float(self.coefficients @ self.moment.sum(axis=0)[-len(self.rest) :])

    @property
    def prediction(self) -> Array:
        """Change of the fitted y."""
        return np.asarray(self.coefficients @ self.rest)


def trial(model: Model, shape: Shape, block: Array) -> Trial | None:
    """Fit a candidate beside the model; None where it cannot be told from the model."""
    rest = model.without(block)
    if rest is None:
        return None
    everything = np.concatenate([model.basis, rest])
    gram = np.array([everything[:, s] @ everything[:, s].T for s in model.records])
    moment = np.array([everything[:, s] @ model.left[s] for s in model.records])
    return Trial(shape, rest, gram, moment)


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
    """Leave one record out in turn; the shape is chosen on the others each time."""
    R, p = len(model.records), len(model.basis)
    alone_gram, alone_moment = trials[0].gram[:, :p, :p], trials[0].moment[:, :p]
    per_fold = []
    for h in range(R):
        others = [r for r in range(R) if r != h]
        base = _solve(alone_gram[others].sum(axis=0), alone_moment[others].sum(axis=0)) if p else np.zeros(0)
        before = base @ alone_gram[h] @ base - 2 * base @ alone_moment[h]
        fits = []
        for t in trials:
            b = t.moment[others].sum(axis=0)
            theta = _solve(t.gram[others].sum(axis=0), b)
            fits.append((float(theta @ b), theta, t))
        _, theta, t = max(fits, key=lambda f: f[0])
        after = theta @ t.gram[h] @ theta - 2 * theta @ t.moment[h]
        per_fold.append(float(before - after))
    best = max(trials, key=lambda t: t.gain)
    moved = best.prediction
    share = np.array([moved[s] @ moved[s] for s in model.records])
    d2 = float(share.sum())
    chi2 = max(1.0, (model.loss - best.gain) / model.entries)
    gain = float(sum(per_fold))
    complexity = len(best.rest) + len(best.shape)
    return Score(
        family=family,
        best=best,
        gain=gain,
        per_fold=tuple(per_fold),
        active=tuple(bool(s) for s in share >= 0.01 * d2),
        z=gain / np.sqrt(2 * d2 * chi2) if d2 > 0 else 0.0,
        bic=gain - 0.5 * (complexity + 1) * np.log(model.entries) - np.log(max(1, families)),
        complexity=complexity,
    )


def refined(trials: Sequence[Trial], evaluate: Callable[[Sequence[Shape]], Sequence[Trial]]) -> tuple[Trial, ...]:
    """The trials with those around the best one: a narrowing search for one shape parameter, else a simplex.

    Positive shape parameters are searched on a logarithmic scale, within a factor of 30 of the grid point; one that
    takes both signs on the grid is a side, and keeps its value.
    """
    start = max(trials, key=lambda t: t.gain)
    names = [n for n, value in start.shape.items() if value > 0 and min(t.shape[n] for t in trials) >= 0]
    if not names:
        return tuple(trials)
    visited = list(trials)
    if len(names) == 1:
        grid = sorted({t.shape[names[0]] for t in trials if t.shape[names[0]] > 0})
        width = np.log(grid[1] / grid[0]) if len(grid) > 1 else 1.0
        for _ in range(_ROUNDS):
            at = max(visited, key=lambda t: t.gain).shape
            around = at[names[0]] * np.exp(width * np.linspace(-1, 1, _POINTS))
            visited += evaluate([{**at, names[0]: float(x)} for x in around])
            width *= 2 / (_POINTS - 1)
        return tuple(visited)
    origin = np.log([start.shape[n] for n in names])

    def loss(x: Array) -> float:
        if np.any(np.abs(x - origin) > np.log(30)):
            return 0.0
        found = evaluate([{**start.shape, **dict(zip(names, np.exp(x).tolist(), strict=True))}])
        visited.extend(found)
        return -found[0].gain if found else 0.0

    simplex = np.concatenate([origin[None], origin + 0.2 * np.eye(len(names))])
    minimize(
        loss,
        origin,
        method="Nelder-Mead",
        options={"maxfev": _SIMPLEX_STEPS, "initial_simplex": simplex, "xatol": 1e-2, "fatol": 0.1},
    )
    return tuple(visited)


def distance(a: Score, b: Score) -> float:
    """d²: squared distance of what two candidates predict."""
    apart = a.best.prediction - b.best.prediction
    return float(apart @ apart)


def simplest_of_ties(model: Model, ranked: Sequence[Score]) -> Score:
    """Nested preference: among the first four, those as good as the best within its noise; the least complex wins."""
    first = ranked[0]
    chi2 = max(1.0, (model.loss - first.best.gain) / model.entries)
    ties = [
        s
        for s in ranked[:4]
        if first.gain - s.gain < max(10.0, 4 * np.sqrt(2 * distance(first, s) * chi2)) or s is first
    ]
    return min(ties, key=lambda s: (s.complexity, -s.gain))


def rivals_of(model: Model, chosen: Score, ranked: Sequence[Score]) -> tuple[Score, ...]:
    """Families among the first eight that the data cannot separate from the chosen one."""
    chi2 = max(1.0, (model.loss - chosen.best.gain) / model.entries)
    return tuple(
        s
        for s in ranked[:8]
        if s.family != chosen.family
        and chosen.gain - s.gain < max(3 * np.sqrt(2 * distance(chosen, s) * chi2), 0.01 * chosen.gain)
    )


def _solve(G: Array, b: Array) -> Array:
    """Normal equations with the Gram matrix scaled to a unit diagonal; nothing is regularised but exact rank loss."""
    size = np.sqrt(np.maximum(np.diag(G), 1e-300))
    return np.asarray(np.linalg.pinv(G / np.outer(size, size), rcond=1e-13, hermitian=True) @ (b / size) / size)
