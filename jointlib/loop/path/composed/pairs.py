"""Effects that show only together: two that hide one another, each with the wrong sign or without gain alone."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.answer.naming import is_declared_pair
from jointlib.loop.path.acceptance import SHARE, Assessment, assess, excess
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.evidence import Model
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.regression import hold_out, solve, with_columns
from jointlib.loop.path.steps import Row
from jointlib.loop.path.trials import Trial, applied, columns_of

_MOST = 24
"""Effects of which pairs are made, those that lower the training loss most alone or with the least parameters."""


@dataclass(frozen=True)
class Pair:
    """Two effects at the shapes that were best for each alone, fitted together beside a model."""

    rows: tuple[Row, Row]
    trials: tuple[Trial, Trial]
    """Theirs, with the coefficients that they have together."""
    model: Model
    found: tuple[Assessment, Assessment, Assessment]
    """Of both over the model, and over the model with the first or the second alone."""


def pairs_beside(current: Fitted, rows: Sequence[Row], store: ColumnStore, seed: int) -> list[Pair]:
    """Pairs of which both together pass every test beside a model, and each beside the other; best first.

    Judged like single effects on what was left out, with the sign rule in every fold. Members of one family are no
    pair, and what passes alone needs no partner to be seen.
    """
    evidence = current.evidence
    folds, weights, sizes = evidence.deciding_folds, evidence.block_weight, evidence.sizes
    floor = evidence.floor.power / evidence.block_power
    best: dict[str, Row] = {}
    for row in rows:
        if len(row.entry.best.coefficients) <= 2:
            best.setdefault(row.entry.member, row)
    tried = list(best.values())[:_MOST]
    if len(tried) < 2:
        return []
    added = [next(columns_of(r.entry.effect, [r.entry.best.shape], current, store)) for r in tried]
    first = np.cumsum([len(current.columns), *(len(a) for a in added)])
    grams = with_columns(current.grams, current.stacked, np.vstack(added), evidence.rows)
    out = []
    for i, j in itertools.combinations(range(len(tried)), 2):
        a, b = tried[i], tried[j]
        if a.entry.family == b.entry.family or is_declared_pair(a.entry.effect, b.entry.effect):
            continue
        if any(r.entry.physical and r.assessment.accepted for r in (a, b)):
            continue
        own = [*range(first[0]), *range(first[i], first[i + 1]), *range(first[j], first[j + 1]), len(grams[0]) - 1]
        part = grams[:, own][:, :, own]
        held = hold_out(part, sizes, folds, weights)
        losses = held.blocks / evidence.block_power
        before = min(float(r.entry.deciding_loss.mean()) for r in (a, b))
        if excess(losses, floor) > (1 - SHARE) * min(excess(current.deciding_loss, floor), before * len(losses)):
            continue
        found = [
            assess(loss, losses, floor, folds, seed)
            for loss in (current.deciding_loss, a.entry.deciding_loss, b.entry.deciding_loss)
        ]
        if not all(f.accepted for f in found):
            continue
        split = len(added[i])
        total = (part * weights[:, None, None]).sum(axis=0)
        models = [_both(a, b, split, current, beta) for beta in held.coefficients]
        beta = solve(total[:-1, :-1], total[:-1, -1])
        model, n = _both(a, b, split, current, beta), len(current.names)
        together = [
            replace(r.entry.best, coefficients=c, model=model)
            for r, c in ((a, beta[n : n + split]), (b, beta[n + split :]))
        ]
        if model is not None and all(m is not None for m in models):
            out.append(Pair((a, b), (together[0], together[1]), model, (found[0], found[1], found[2])))
    return sorted(out, key=lambda p: -p.found[0].gain)


def _both(a: Row, b: Row, split: int, current: Fitted, beta: Array) -> Model | None:
    """The model with both effects; None where one is not physical."""
    n = len(current.names)
    base, first, second = beta[:n], beta[n : n + split], beta[n + split :]
    model = applied(a.entry.effect, a.entry.best.shape, current, np.concatenate([base, first]))
    if model is None:
        return None
    return applied(b.entry.effect, b.entry.best.shape, current, np.concatenate([base, second]), onto=model)
