"""Every family of effects tried beside the current model, judged on data that took no part in its choice."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Path
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.path.evidence import Evidence, Fitted
from jointlib.loop.path.preparation import Run
from jointlib.loop.path.regression import Index, Mask, block_grams, hold_out, loss, solve
from jointlib.loop.refit import bounds_of
from jointlib.registry import installed

_ZOOMS = 10
"""Rounds in which the grid of shapes is refined round the best one."""

_LEVEL = 1e-4
"""Training losses that differ by less than this fraction prefer no shape."""

Shape = Mapping[str, float]


@dataclass(frozen=True)
class Trial:
    """One family and shape fitted beside the current model, once on everything and once without each fold."""

    shape: Shape
    coefficients: Array
    """Of the effect, on all blocks."""
    training: float
    """Mean squared residual on all blocks, N²."""
    joint: Joint | None
    """The joint with the effect, None where its coefficients are not physical."""
    condition: _Folds | None
    block: _Folds


@dataclass(frozen=True)
class _Folds:
    training: Array
    losses: Array
    """Relative held-out loss of every block."""
    physical: Mask
    """Whether the coefficients that each fold finds are physical."""


@dataclass(frozen=True)
class Entry:
    """A family with the shape that each fold chose for itself."""

    effect: JointEffect
    best: Trial
    physical: bool
    condition_loss: Array | None
    block_loss: Array

    @property
    def deciding_loss(self) -> Array:
        return self.block_loss if self.condition_loss is None else self.condition_loss

    @property
    def complexity(self) -> int:
        """Coefficients, shape parameters and internal states that the effect brings."""
        states = len(self.best.joint.states) if self.best.joint else 0
        return len(self.best.coefficients) + len(self.best.shape) + states


class ColumnStore:
    """Columns of effects along the fit records, kept from round to round while the joint does not enter them."""

    def __init__(self, evidence: Evidence) -> None:
        self._evidence = evidence
        self._kept: dict[tuple[str, str, tuple[tuple[str, float], ...]], tuple[Joint, Array]] = {}

    def columns(self, effect: JointEffect, shape: Shape, joint: Joint) -> Array:
        """Filtered and thinned force for unit coefficients, (coefficient, sample)."""
        key = (effect.family, effect.member, tuple(sorted(shape.items())))
        if key in self._kept:
            then, columns = self._kept[key]
            probe = _probe(self._evidence.runs[0].path)
            if np.array_equal(effect.columns(probe, shape, then), effect.columns(probe, shape, joint)):
                return columns
        columns = np.concatenate([_along(run, effect, shape, joint) for run in self._evidence.runs], axis=1)
        self._kept[key] = joint, columns
        return columns


def contest(evidence: Evidence, current: Fitted, effects: Sequence[JointEffect], store: ColumnStore) -> list[Entry]:
    """Every applicable family, best deciding loss first, physical ones before the others.

    Baseline columns are refitted with each candidate in every fold, so what the baseline can absorb counts for
    nothing. Families within reach of the leader have their grids refined before the final ranking.
    """
    trials: dict[int, list[Trial]] = {}
    for i, effect in enumerate(effects):
        shapes = effect.shapes(evidence.scale, current.joint)
        found = [refitted_trial(evidence, current, effect, s, store) for s in shapes]
        trials[i] = [t for t in found if t is not None]
    entries = {i: _entry(evidence, effects[i], t) for i, t in trials.items() if t}
    if not entries:
        return []
    before = current.deciding_loss.mean()
    gains = {i: before - e.deciding_loss.mean() for i, e in entries.items() if e.physical}
    reach = 0.25 * max([*gains.values(), 0.0])
    for i in entries:
        if gains.get(i, 0.0) > max(reach, 0.1 * before):
            trials[i] += _zoom(evidence, current, effects[i], trials[i], store)
            entries[i] = _entry(evidence, effects[i], trials[i])
    return sorted(entries.values(), key=lambda e: (not e.physical, float(e.deciding_loss.mean())))


def contains(evidence: Evidence, current: Fitted, wide: Entry, narrow: Entry, store: ColumnStore) -> bool:
    """True if what ``narrow`` adds is, to a thousandth, one of the forces that ``wide`` can make with more terms."""
    if len(wide.best.coefficients) <= len(narrow.best.coefficients):
        return False
    rows = np.concatenate(evidence.rows)
    small = store.columns(narrow.effect, narrow.best.shape, current.joint)[:, rows]
    large = store.columns(wide.effect, wide.best.shape, current.joint)[:, rows]
    base = (current.columns / np.maximum(np.linalg.norm(current.columns, axis=1), 1e-300)[:, None])[:, rows]
    large = large / np.maximum(np.linalg.norm(large, axis=1), 1e-300)[:, None]
    added = narrow.best.coefficients @ small

    def left(columns: Array) -> float:
        return float(np.sum((added - np.linalg.lstsq(columns.T, added, rcond=None)[0] @ columns) ** 2))

    return left(np.vstack([base, large])) < 1e-2 * left(base)


def refitted_trial(
    evidence: Evidence, current: Fitted, effect: JointEffect, shape: Shape, store: ColumnStore
) -> Trial | None:
    """One shape of a family fitted beside the current model; None where it does not act on this path."""
    added = store.columns(effect, shape, current.joint)
    if not np.all(np.isfinite(added)) or not np.all(np.any(added, axis=1)):
        return None
    rows, sizes = evidence.rows, np.array([len(r) for r in evidence.rows])
    columns = np.vstack([current.columns, added])
    grams = block_grams(columns, _target(evidence, current), rows)
    total = grams.sum(axis=0)
    beta = solve(total[:-1, :-1], total[:-1, -1])

    joint = _applied(effect, shape, current, beta)

    def folds(number: Index, each: bool) -> _Folds:
        """``each``: ask the sign rule of every fold's coefficients, else of those of the whole."""
        held = hold_out(grams, sizes, number)
        found = [_applied(effect, shape, current, b) if each else joint for b in held.coefficients]
        physical = np.array([f is not None for f in found])
        return _Folds(held.training, held.blocks / evidence.block_power, physical)

    several = len(evidence.division.conditions) > 1
    return Trial(
        shape=shape,
        coefficients=beta[len(current.names) :],
        training=float(loss(total, beta) / sizes.sum()),
        joint=joint,
        condition=folds(evidence.condition_folds, True) if several else None,
        block=folds(evidence.floor.block_folds, not several),
    )


def _target(evidence: Evidence, current: Fitted) -> Array:
    """What the columns of mass, offset and changes of the joint parameters are fitted to."""
    return evidence.target - evidence.joint_force(current.joint)


def _applied(effect: JointEffect, shape: Shape, current: Fitted, beta: Array) -> Joint | None:
    """The current joint moved along its tangents, with the effect; None where that is not physical."""
    at = current.joint.parameters
    moved = {n: float(at[n] + d) for n, d in zip(current.names, beta, strict=False) if n in at}
    lower, upper = bounds_of(current.joint, tuple(moved))
    joint = current.joint
    # Parameters may leave their range together though none does alone; the refit finds admissible ones.
    with contextlib.suppress(InputError):
        values = np.clip(list(moved.values()), lower, upper).tolist()
        joint = joint.with_parameters(dict(zip(moved, values, strict=True)))
    try:
        return effect.apply(beta[len(current.names) :], shape, joint)
    except InputError:
        return None


def _entry(evidence: Evidence, effect: JointEffect, trials: Sequence[Trial]) -> Entry:
    """Let every fold choose its shape on the data it trains on, among physical ones where there are any."""
    pool = [t for t in trials if t.joint is not None] or list(trials)
    best = min(pool, key=lambda t: t.training)
    overall = np.array([t.training for t in trials])
    block, physical = _choose([t.block for t in trials], evidence.floor.block_folds, overall)
    condition = None
    if best.condition is not None:
        folds = [t.condition for t in trials if t.condition is not None]
        condition, physical = _choose(folds, evidence.condition_folds, overall)
    return Entry(effect, best, bool(best.joint is not None and physical.all()), condition, block)


def _choose(folds: Sequence[_Folds], number: Index, overall: Array) -> tuple[Array, Mask]:
    """Held-out losses with the shape each fold prefers; ``overall`` decides where its data cannot tell shapes apart."""
    training = np.array([f.training for f in folds])
    physical = np.array([f.physical for f in folds])
    any_physical = physical.any(axis=0)
    admitted = np.where(physical | ~any_physical, training, np.inf)
    level = admitted <= admitted.min(axis=0) * (1 + _LEVEL)
    pick = np.argmin(np.where(level, overall[:, None], np.inf), axis=0)
    losses = np.array([f.losses for f in folds])
    return losses[pick[number], np.arange(len(number))], np.asarray(any_physical)


def _zoom(
    evidence: Evidence, current: Fitted, effect: JointEffect, trials: Sequence[Trial], store: ColumnStore
) -> list[Trial]:
    """Further shapes: midway to the neighbours of the best one, and outward in growing steps from the edge of the grid.

    It ends when no midpoint lowers the loss by one per cent.
    """
    added: list[Trial] = []
    keys = [k for k in trials[0].shape if all(t.shape[k] > 0 for t in trials) and len({t.shape[k] for t in trials}) > 1]
    stride = {k: max(t.shape[k] for t in trials) / min(t.shape[k] for t in trials) for k in keys}
    stride = {k: v ** (1 / len({t.shape[k] for t in trials})) for k, v in stride.items()}
    for _ in range(_ZOOMS if keys else 0):
        known = [*trials, *added]
        best = min([t for t in known if t.joint is not None] or known, key=lambda t: t.training)
        go_on = False
        for k in keys:
            values, here = sorted({t.shape[k] for t in known}), best.shape[k]
            below = [np.sqrt(here * v) for v in values if v < here][-1:]
            above = [np.sqrt(here * v) for v in values if v > here][:1]
            if not (below and above):
                stride[k] **= 1.5
                below, above = ([] if below else [here / stride[k]]), ([] if above else [here * stride[k]])
                go_on = True
            for value in (*below, *above):
                trial = refitted_trial(evidence, current, effect, {**best.shape, k: float(value)}, store)
                if trial is not None:
                    added.append(trial)
                    go_on |= trial.training < 0.99 * best.training
        if not go_on:
            break
    return added


def _along(run: Run, effect: JointEffect, shape: Shape, joint: Joint) -> Array:
    """Columns along one record."""
    laws = installed("jointlib.laws").found
    has_memory = effect.member in laws and bool(laws[effect.member].states)
    return run.column(run.spread(effect.columns(run.stepped(has_memory), shape, joint)))


def _probe(path: Path) -> Path:
    """A short stretch of a path, to see whether columns have changed."""
    pick = np.linspace(0, len(path.displacement) - 1, 40).astype(int)
    return Path(path.displacement[pick], path.velocity[pick], path.time_step)
