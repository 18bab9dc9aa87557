"""Search the catalogue: rounds of a contest, acceptance, and exchange of earlier terms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.effect import JointEffect, Scale
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.loop.contest import Model, Score, Trial, refined, rivals_of, score, simplest_of_ties, trial
from jointlib.loop.equations import Observed
from jointlib.loop.fitted import Fitted, columns_of, features, fit, free_parameters, model_of, moved_by
from jointlib.loop.report import Status

_REFINED = 5
_WORTH_REFINING = 2.0
_MOST_TERMS = 3
_LEAST_SHARE = 0.05


@dataclass(frozen=True)
class Row:
    """One family in a round."""

    effect: JointEffect
    score: Score
    status: Status
    reason: str
    """Why it was not accepted; empty where it passed every test."""


@dataclass(frozen=True)
class Round:
    """A contest over one model: rows by falling gain, the row that won, and its rivals."""

    fitted: Fitted
    model: Model
    rows: tuple[Row, ...]
    winner: Row | None
    rivals: tuple[Row, ...]
    inapplicable: Mapping[str, str]
    """Families without a row, and why."""


@dataclass(frozen=True)
class Term:
    """An accepted effect, the round it won and the joint refitted with it."""

    round: Round
    row: Row
    fitted: Fitted


def scale_of(records: Sequence[Observed], joint: Joint) -> Scale:
    """Size of the motion, over all records."""
    paths = [o.path for o in records]
    z = max(float(np.abs(p[0]).max()) for p in paths)
    v = float(np.sqrt(np.mean([np.mean(p[1] ** 2) for p in paths])))
    return Scale(z, v, max(0.0, float(np.mean([o.stiffness for o in records]))))


def contest(records: Sequence[Observed], fitted: Fitted, effects: Sequence[JointEffect], least_gain: float) -> Round:
    """All families against one model. ``least_gain`` is what a further term must at least reach."""
    model = model_of(records, fitted)
    scale = scale_of(records, fitted.joint)
    rows: dict[str, Row] = {}
    inapplicable: dict[str, str] = {}
    families = len({e.family for e in effects})
    pools: dict[str, tuple[JointEffect, tuple[Trial, ...]]] = {}
    for effect in effects:
        tried = _trials(records, model, effect, effect.shapes(scale, fitted.joint), fitted.joint)
        if not tried:
            inapplicable.setdefault(effect.family, "the joint as it is can already move the same way")
            continue
        physical = tuple(t for t in tried if _admissible(effect, t, fitted.joint))
        row = _judge(model, effect, physical or tried, bool(physical), families, least_gain)
        if effect.family not in rows or row.score.gain > rows[effect.family].score.gain:
            rows[effect.family] = row
            pools[effect.family] = effect, physical
    order = sorted(rows, key=lambda f: -rows[f].score.gain)
    for family in [f for f in order if rows[f].status is not Status.UNPHYSICAL and rows[f].score.z > _WORTH_REFINING][
        :_REFINED
    ]:
        effect, physical = pools[family]

        def evaluate(shapes: Sequence[Mapping[str, float]], effect: JointEffect = effect) -> tuple[Trial, ...]:
            found = _trials(records, model, effect, shapes, fitted.joint)
            return tuple(t for t in found if _admissible(effect, t, fitted.joint))

        finer = refined(physical, evaluate)
        rows[family] = _judge(model, effect, finer, True, families, least_gain)
    ranked = sorted(rows.values(), key=lambda r: -r.score.gain)
    passed = [r for r in ranked if not r.reason]
    if not passed:
        return Round(fitted, model, tuple(ranked), None, (), inapplicable)
    best = simplest_of_ties(model, [r.score for r in passed])
    winner = next(r for r in passed if r.score is best)
    possible = [r.score for r in ranked if r.status is not Status.UNPHYSICAL]
    close = {s.family for s in rivals_of(model, best, possible)}
    rivals = tuple(r for r in ranked if r.score.family in close)
    marked = tuple(_marked(r, winner, close) for r in ranked)
    return Round(fitted, model, marked, replace(winner, status=Status.ACCEPTED), rivals, inapplicable)


def _marked(row: Row, winner: Row, close: set[str]) -> Row:
    if row is winner:
        return replace(row, status=Status.ACCEPTED)
    if row.score.family in close:
        return replace(row, status=Status.TIED, reason=row.reason or "these records cannot separate it from the chosen")
    return row if row.reason else replace(row, reason="explains less than the chosen one")


def _trials(
    records: Sequence[Observed], model: Model, effect: JointEffect, shapes: Sequence[Mapping[str, float]], joint: Joint
) -> tuple[Trial, ...]:
    """The effect at each shape that is admissible and that the model cannot imitate."""
    if not shapes:
        return ()
    try:
        forces = features(records, effect, shapes, joint)
    except InputError:
        return ()
    tried = (trial(model, s, columns_of(records, F)) for s, F in zip(shapes, forces, strict=True))
    return tuple(t for t in tried if t is not None)


def _admissible(effect: JointEffect, t: Trial, joint: Joint) -> bool:
    """The sign rule: whether the effect yields a joint with the fitted coefficients."""
    try:
        return effect.apply(t.coefficients, t.shape, joint) is not None
    except InputError:
        return False


def _judge(
    model: Model, effect: JointEffect, trials: Sequence[Trial], physical: bool, families: int, least_gain: float
) -> Row:
    s = score(model, effect.family, trials, families)
    if not physical:
        return Row(effect, s, Status.UNPHYSICAL, "its coefficient has a sign that the effect cannot have")
    active = [g for g, a in zip(s.per_fold, s.active, strict=True) if a]
    if s.z <= 4:
        reason = f"held-out gain only {s.z:.1f} times its noise"
    elif s.bic <= 10:
        reason = "gain does not pay for its parameters"
    elif len(active) < 2:
        reason = "only one record reaches it"
    elif min(active) <= 0:
        reason = "makes a left-out record worse"
    elif s.gain < least_gain:
        reason = "less than a twentieth of the first term's gain"
    else:
        reason = ""
    return Row(effect, s, Status.REJECTED, reason)


def added(records: Sequence[Observed], fitted: Fitted, row: Row) -> Fitted | None:
    """The joint with an effect, everything that may move refitted."""
    best = row.score.best
    mended = row.effect.apply(best.coefficients, best.shape, fitted.joint)
    if mended is None:
        return None
    new = moved_by(row.effect, best.coefficients, best.shape, fitted.joint)
    wanted = dict.fromkeys([*(n for n in free_parameters(fitted.joint) if n in mended.parameters), *new])
    held = set(fitted.held) - set(new)
    names = tuple(n for n in wanted if n not in held and n in _movable(mended, fitted, new))
    return fit(records, mended, names)


def _movable(mended: Joint, fitted: Fitted, new: Sequence[str]) -> set[str]:
    """Parameters that were free before or that the effect set; defaults of earlier effects stay where they are."""
    return (set(fitted.free) | set(new)) & set(mended.parameters)


def search(
    records: Sequence[Observed], start: Fitted, effects: Sequence[JointEffect]
) -> tuple[Round, tuple[Term, ...], tuple[Row, ...]]:
    """The first round, the accepted terms (largest first) and the rows that were only too small (secondary)."""
    opening = contest(records, start, effects, 0.0)
    terms: list[Term] = []
    current = opening
    secondary: tuple[Row, ...] = ()
    least = 0.0
    while current.winner is not None and len(terms) < _MOST_TERMS:
        grown = added(records, current.fitted, current.winner)
        if grown is None or _loss(records, grown) > current.model.loss:
            break
        terms.append(Term(current, current.winner, grown))
        if len(terms) == 1:
            least = _LEAST_SHARE * current.winner.score.gain
        else:
            terms = _exchanged(records, start, effects, terms)
        current = contest(records, terms[-1].fitted, effects, least)
    small = [r for r in current.rows if r.reason.startswith("less than a twentieth")]
    secondary = tuple(small[:1])
    return opening, tuple(terms), secondary


def _exchanged(
    records: Sequence[Observed], start: Fitted, effects: Sequence[JointEffect], terms: list[Term]
) -> list[Term]:
    """Replace the first of two terms where another family beside the second does better on left-out records."""
    if len(terms) != 2:
        return terms
    second = terms[1].row
    alone = added(records, start, replace(second, score=replace(second.score, best=second.score.best)))
    if alone is None:
        return terms
    again = contest(records, alone, effects, 0.0)
    if again.winner is None or again.winner.score.family == terms[0].row.score.family:
        return terms
    other = added(records, alone, again.winner)
    if other is None or _loss(records, other) >= 0.98 * _loss(records, terms[1].fitted):
        return terms
    opening = contest(records, start, effects, 0.0)
    own = next((r for r in opening.rows if r.score.family == second.score.family), second)
    swapped = [Term(replace(opening, winner=own), own, alone), Term(again, again.winner, other)]
    return swapped


def _loss(records: Sequence[Observed], fitted: Fitted) -> float:
    return model_of(records, fitted).loss


def prediction_error(model: Model) -> Array:
    """y of every record left out in turn, after the model's columns were fitted to the others."""
    out = model.y.copy()
    for h in range(len(model.records)):
        keep = np.ones(len(out), dtype=bool)
        keep[model.records[h]] = False
        X = model.basis
        theta = np.linalg.lstsq(X[:, keep].T, model.y[keep], rcond=None)[0] if len(X) else np.zeros(0)
        out[model.records[h]] -= theta @ X[:, model.records[h]]
    return out
