"""One effect or two for what a joint leaves of free decays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.effect import JointEffect
from jointlib.loop.answer.naming import NAMED_FROM, is_declared_pair
from jointlib.loop.decay.contest import ALIKE, CLEAN, Round, Row, contest, excess, held_out, numbers
from jointlib.loop.decay.fitted import Fitted, Folds, with_folds
from jointlib.loop.decay.unnamed import Power, against_names
from jointlib.ringdown.evidence import Evidence

_LOOSE = 4.0
"""Times as much where the joint has a memory: no element has the loop of a real contact."""
_TWO = 0.05
"""Of the first excess, that a second effect must remove."""


@dataclass(frozen=True)
class Search:
    """What the contest came to."""

    before: Fitted
    first: Round
    terms: tuple[Row, ...]
    """What is added, in order."""
    after: Fitted
    explained: float
    """Share of the held-out excess that all terms remove."""
    rivals: tuple[Row, ...]
    count: int
    unnamed: Power | None = None
    """Damping without a name that does as well as two effects."""
    rounded: float | None = None
    """Smoothing velocity over the largest speed, of friction that turns too slowly to be dry."""

    @property
    def clean(self) -> bool:
        """Nothing that is known contradicts the joint with all terms."""
        return self.after.held_out <= CLEAN * self.count * (_LOOSE if self.after.joint.states else 1.0)


@dataclass(frozen=True)
class _Pair:
    """An effect and the contest beside it, whose best is ``two``."""

    one: Row
    two: Row
    second: Round
    plainer: bool
    """``one`` is the best single effect without its bend."""


def search(evidence: Evidence, folds: Folds, before: Fitted, effects: Sequence[JointEffect]) -> Search:
    """The best single effect; two where it leaves too much and they do better, where it is a plainer one with a bend
    and another beside that one makes the bend as well, or where none passes, as two that hide one another do not."""
    count = len(folds.masks[0])
    reference = excess(before.held_out, count)
    first = contest(evidence, folds, before, effects, reference)
    best = first.best
    if best is None or best.fitted is None:
        alone = Search(before, first, (), before, 0.0, (), count)
        begun = [(r, False) for r in _hiding(evidence, folds, first)]
    else:
        alone = Search(before, first, (best,), best.fitted, best.share, first.rivals, count)
        enough = best.share >= NAMED_FROM and alone.clean
        begun = [] if enough else [(r, False) for r in [best, *first.rivals][:3]]
        begun += [(r, True) for r in _plainer(first, best)]
    pairs = []
    for one, plainer in begun:
        if one.fitted is None:
            continue
        barred = {one.effect.family} | ({best.effect.family} if plainer and best else set())
        second = contest(evidence, folds, one.fitted, [e for e in effects if e.family not in barred], reference)
        if second.best is not None and (plainer or second.best.share > _TWO):
            pairs.append(_Pair(one, second.best, second, plainer))
    if not pairs:
        return alone
    lowest = min(pairs, key=lambda p: held_out(p.two))
    alike = [p for p in pairs if held_out(p.two) <= _alike(lowest.two, count)]
    pair = min(alike, key=lambda p: (numbers(p.two), held_out(p.two)))
    if best is None:
        found = _together(evidence, folds, alone, pair, pairs)
        return found if found.explained >= NAMED_FROM and found.clean else alone
    if held_out(best) <= _alike(pair.two, count):
        if not pair.plainer or numbers(pair.two) >= numbers(best):
            return alone
        if held_out(best) <= held_out(pair.two):
            return _beside(alone, pair) if held_out(pair.two) <= _alike(best, count) else alone
    return _together(evidence, folds, alone, pair, pairs)


def _together(evidence: Evidence, folds: Folds, alone: Search, pair: _Pair, pairs: Sequence[_Pair]) -> Search:
    """Two effects, with what does as well among their rivals."""
    assert pair.two.fitted is not None
    before, count = alone.before, alone.count
    others = (*alone.terms, *(p.two for p in pairs if p is not pair))
    rivals = {r.effect.family: r for r in pair.second.rivals}
    rivals |= {r.effect.family: r for r in others if held_out(r) <= _alike(pair.two, count)}
    rivals |= {p.one.effect.family: p.one for p in pairs if held_out(p.two) <= _alike(pair.two, count)}
    own = {pair.one.effect.family, pair.two.effect.family}
    return Search(
        before,
        alone.first,
        (pair.one, pair.two),
        pair.two.fitted,
        1 - excess(pair.two.fitted.held_out, count) / excess(before.held_out, count),
        tuple(r for f, r in rivals.items() if f not in own),
        count,
        against_names(evidence, folds, before.joint, pair.two.fitted),
    )


def _hiding(evidence: Evidence, folds: Folds, first: Round) -> list[Row]:
    """Where none passes alone, the two families that leave least in sample, plainer ones before those with a bend."""
    told = sorted((r for r in first.rows if r.fitted is not None), key=lambda r: r.fitted.loss if r.fitted else np.inf)
    best = dict[str, Row]()
    for r in told:
        if not any(is_declared_pair(r.effect, o.effect) and numbers(o) < numbers(r) for o in told):
            best.setdefault(r.effect.family, r)
    two = list(best.values())[:2]
    return [replace(r, fitted=with_folds(evidence, folds, r.fitted)) for r in two if r.fitted is not None]


def _alike(r: Row, count: int) -> float:
    """Σ r² on what was left out, up to which another does as well."""
    return max(ALIKE * held_out(r), CLEAN * count)


def _plainer(first: Round, best: Row) -> tuple[Row, ...]:
    """What the best effect is without its bend, told on levels left out: Coulomb friction of a Stribeck curve."""
    return tuple(
        r
        for r in first.rows
        if is_declared_pair(r.effect, best.effect) and np.isfinite(held_out(r)) and numbers(r) < numbers(best)
    )


def _beside(alone: Search, pair: _Pair) -> Search:
    """The best effect, with two that do as well together among its rivals."""
    known = {r.effect.family for r in (*alone.terms, *alone.rivals)}
    return replace(alone, rivals=(*alone.rivals, *(r for r in (pair.one, pair.two) if r.effect.family not in known)))
