"""Every member of every family tried beside the current model, judged on data that took no part in its choice."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.regression import Index, Mask
from jointlib.loop.path.trials import Effect, Folds, Shape, Trial, columns_of, member_of, shapes_of, trials_of

_ZOOMS = 20
"""Rounds in which the grid of shapes is refined round the best one."""
_FINEST = 1.06
"""Ratio of neighbouring shapes at which refining ends."""
_LEAST_GAIN = 2e-3
"""Fraction of the training loss below which a neighbour is no better."""
_MOST_TOGETHER = 3
"""Shape parameters that are moved in every combination; more are moved one by one."""

_NEAR = 0.5
"""Further members of a family are tried where its first one gains this fraction of the best."""
_REACH = 0.25
"""Grids are refined where the gain is this fraction of the best."""
_LEVEL = 1e-4
"""Training losses that differ by less than this fraction prefer no shape."""


@dataclass(frozen=True)
class Entry:
    """An effect with the shape that each fold chose for itself."""

    effect: Effect
    best: Trial
    physical: bool
    deciding_loss: Array
    """Relative held-out loss of every block."""

    @property
    def family(self) -> str:
        return self.effect.family

    @property
    def member(self) -> str:
        return member_of(self.effect)

    @property
    def complexity(self) -> int:
        """Coefficients, shape parameters and internal states that the effect brings."""
        states = len(self.best.model.joint.states) if self.best.model else 0
        return int(np.count_nonzero(self.best.coefficients)) + len(self.best.shape) + states


def contest(current: Fitted, effects: Sequence[Effect], store: ColumnStore) -> list[Entry]:
    """Every applicable effect, best deciding loss first, physical ones before the others.

    Baseline columns are refitted with each candidate in every fold, so what the baseline can absorb counts for
    nothing. Further members of a family are tried where its first member comes near the leader; what is within reach
    of the leader has its grid refined before the final ranking.
    """
    leading = [e for e in effects if not isinstance(e, JointEffect) or e.leads]
    entries, trials = _tried(current, leading, store)
    before = float(current.deciding_loss.mean())
    gains = [(e.family, before - float(e.deciding_loss.mean())) for e in entries if e.physical]
    most = max([gain for _, gain in gains], default=0.0)
    near = {family for family, gain in gains if gain > _NEAR * most > 0}
    more = [e for e in effects if e not in leading and e.family in near]
    further = _tried(current, more, store)
    entries, trials = [*entries, *further[0]], [*trials, *further[1]]
    gains = [(e.family, before - float(e.deciding_loss.mean())) for e in entries if e.physical]
    reach = max(_REACH * max([gain for _, gain in gains], default=0.0), 0.1 * before)
    for i, entry in enumerate(entries):
        if entry.physical and before - entry.deciding_loss.mean() > reach:
            finer = [*trials[i], *_zoom(current, entry.effect, trials[i], store)]
            entries[i] = _entry(current.evidence, entry.effect, finer)
    return sorted(entries, key=lambda e: (not e.physical, float(e.deciding_loss.mean())))


def _tried(current: Fitted, effects: Sequence[Effect], store: ColumnStore) -> tuple[list[Entry], list[list[Trial]]]:
    """Effects over their grids; those that do not apply are left out."""
    tried = [trials_of(e, shapes_of(e, current), current, store) for e in effects]
    kept = [(e, t) for e, t in zip(effects, tried, strict=True) if t]
    return [_entry(current.evidence, e, t) for e, t in kept], [t for _, t in kept]


def contains(current: Fitted, wide: Entry, narrow: Entry, store: ColumnStore) -> bool:
    """True if what ``narrow`` adds is, to a hundredth, one of the forces that ``wide`` can make with more terms."""
    if len(wide.best.coefficients) <= len(narrow.best.coefficients):
        return False
    rows = np.concatenate(current.evidence.rows)
    small = next(columns_of(narrow.effect, [narrow.best.shape], current, store))[:, rows]
    large = next(columns_of(wide.effect, [wide.best.shape], current, store))[:, rows]
    base = (current.columns / np.maximum(np.linalg.norm(current.columns, axis=1), 1e-300)[:, None])[:, rows]
    large = large / np.maximum(np.linalg.norm(large, axis=1), 1e-300)[:, None]
    added = narrow.best.coefficients @ small

    def left(columns: Array) -> float:
        return float(np.sum((added - np.linalg.lstsq(columns.T, added, rcond=None)[0] @ columns) ** 2))

    return left(np.vstack([base, large])) < 1e-2 * left(base)


def _entry(evidence: Evidence, effect: Effect, trials: Sequence[Trial]) -> Entry:
    """Let every fold choose its shape on the data it trains on, among physical ones where there are any."""
    pool = [t for t in trials if t.model is not None] or list(trials)
    best = min(pool, key=lambda t: t.training)
    overall = np.array([t.training for t in trials])
    losses, physical = _choose([t.folds for t in trials], evidence.deciding_folds, overall)
    return Entry(effect, best, bool(best.model is not None and physical.all()), losses)


def _choose(folds: Sequence[Folds], numbers: Index, overall: Array) -> tuple[Array, Mask]:
    """Loss of every block at the shape its fold chose, and whether each fold's choice is physical.

    A fold whose data do not tell shapes apart takes the one that is best on everything.
    """
    training, possible = np.array([f.training for f in folds]), np.array([f.physical for f in folds])
    training = np.where(possible | ~possible.any(axis=0), training, np.inf)
    level = training <= training.min(axis=0) * (1 + _LEVEL)
    pick = np.argmin(np.where(level, overall[:, None], np.inf), axis=0)
    losses = np.array([folds[pick[h]].losses[b] for b, h in enumerate(numbers)])
    return losses, np.array([folds[p].physical[h] for h, p in enumerate(pick)])


def _zoom(current: Fitted, effect: Effect, trials: Sequence[Trial], store: ColumnStore) -> list[Trial]:
    """Further shapes all round the best one, in steps that shrink when it stays and grow when it moves.

    Neighbours in every combination of shape parameters (each times or over its step), so that two that make up for one
    another are followed along their valley. It ends with steps of six per cent; the refit does the rest.
    """
    keys = [k for k in trials[0].shape if all(t.shape[k] > 0 for t in trials) and len({t.shape[k] for t in trials}) > 1]
    if not keys:
        return []
    step = {k: _spacing([t.shape[k] for t in trials]) ** 0.5 for k in keys}
    moves = [m for m in itertools.product((-1, 0, 1), repeat=len(keys)) if any(m)]
    if len(keys) > _MOST_TOGETHER:
        moves = [m for m in moves if sum(map(abs, m)) == 1]
    added: list[Trial] = []
    known = {_key(t.shape, keys) for t in trials}
    for _ in range(_ZOOMS):
        best = _best([*trials, *added])
        shapes = []
        for move in moves:
            shape = {**best.shape, **{k: best.shape[k] * step[k] ** i for k, i in zip(keys, move, strict=True)}}
            if _key(shape, keys) not in known:
                known.add(_key(shape, keys))
                shapes.append(shape)
        found = trials_of(effect, shapes, current, store) if shapes else []
        added += found
        moved = _best([best, *found]).training < (1 - _LEAST_GAIN) * best.training
        step = {k: v**1.5 if moved else v**0.5 for k, v in step.items()}
        if max(step.values()) < _FINEST:
            break
    return added


def _best(trials: Sequence[Trial]) -> Trial:
    return min([t for t in trials if t.model is not None] or trials, key=lambda t: t.training)


def _spacing(values: Sequence[float]) -> float:
    """Mean ratio of neighbouring values of a grid."""
    different = len(set(values))
    return float((max(values) / min(values)) ** (1 / (different - 1)))


def _key(shape: Shape, keys: Sequence[str]) -> tuple[float, ...]:
    return tuple(float(f"{shape[k]:.6g}") for k in keys)
