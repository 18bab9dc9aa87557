"""Search the catalogue: rounds of a contest, acceptance, and exchange of earlier terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from jointlib.arrays import Array
from jointlib.fault import Shape
from jointlib.loop.contest import Score, refined, rivals_of, score, simplest_of_ties
from jointlib.loop.contestant import Contestant, InJoint
from jointlib.loop.fitted import Fitted
from jointlib.loop.model import Model, prediction_error
from jointlib.loop.naming import NAMED_FROM
from jointlib.loop.report import Status
from jointlib.loop.trial import Trial, prediction

_REFINED = 6
_WORTH_REFINING = 2.0
_MOST_TERMS = 3
_LEAST_SHARE = 0.05
_TOO_SMALL = 1e-3
"""Of the first term's gain: below this what is left is the error of its form, not another effect."""
_FORM = 10.0
_NEAR = 0.5
"""Further members of a family are stepped only where its first reaches this share of the leader's gain."""


@dataclass(frozen=True)
class Row:
    """One family (at one place) in a round."""

    contestant: Contestant
    score: Score
    status: Status
    reason: str
    """Why it was not accepted; empty where it passed every test."""

    @property
    def label(self) -> str:
        return self.contestant.label


@dataclass(frozen=True)
class Round:
    """A contest over one model: rows by falling gain, the row that won, and its rivals."""

    fitted: Fitted
    rows: tuple[Row, ...]
    winner: Row | None
    rivals: tuple[Row, ...]

    @property
    def model(self) -> Model:
        return self.fitted.model

    @cached_property
    def held_out_excess(self) -> float:
        """What the model leaves on records left out in turn, beyond the noise."""
        left = prediction_error(self.model)
        return float(left @ left) - self.model.entries


@dataclass(frozen=True)
class Term:
    """An accepted effect, the round it won and the model refitted with it."""

    round: Round
    row: Row
    fitted: Fitted


class _Contest:
    """One round: trials of every contestant against one model."""

    def __init__(self, fitted: Fitted, field: Sequence[Contestant], least_gain: float, chosen: str | None) -> None:
        self.fitted, self.field, self.least_gain, self.chosen = fitted, field, least_gain, chosen
        self.model = fitted.model
        self.families = len({c.label for c in field})
        self.predictions: dict[int, Array] = {}

    def trials(self, c: Contestant, shapes: Sequence[Shape], physical: bool = False) -> tuple[Trial, ...]:
        """The contestant at each shape that the model cannot imitate."""
        found = c.trials(self.fitted, shapes) if shapes else []
        return tuple(t for t in found if not physical or self.admissible(c, t))

    def admissible(self, c: Contestant, t: Trial) -> bool:
        return c.admissible(t.coefficients, t.shape, self.fitted)

    def judged(self, c: Contestant, trials: Sequence[Trial], physical: bool) -> Row:
        """A row with the first test that it fails."""
        s = score(self.model, c.label, trials, self.families)
        if not physical:
            return Row(c, s, Status.UNPHYSICAL, "its coefficient has a sign or size that the effect cannot have")
        active = [g for g, a in zip(s.per_fold, s.active, strict=True) if a]
        if s.z <= 4:
            reason = f"held-out gain only {s.z:.1f} times its noise"
        elif s.bic <= 10:
            reason = "gain does not pay for its parameters"
        elif len(active) < 2:
            reason = "only one record reaches it"
        elif min(active) <= 0:
            reason = "makes a left-out record worse"
        elif s.gain < self.least_gain:
            reason = "less than a twentieth of the first term's gain"
        else:
            reason = ""
        return Row(c, s, Status.REJECTED, reason)

    def distance(self, a: Score, b: Score) -> float:
        """d²: squared distance of what two candidates predict."""
        apart = self.predicted(a) - self.predicted(b)
        return float(apart @ apart)

    def predicted(self, s: Score) -> Array:
        if id(s.best) not in self.predictions:
            c = self.owner[id(s.best)]
            self.predictions[id(s.best)] = prediction(self.model, s.best, c.block(self.fitted, s.best.shape))
        return self.predictions[id(s.best)]

    def held(self) -> Round:
        rows: dict[str, Row] = {}
        pools: dict[str, tuple[Trial, ...]] = {}
        later: list[Contestant] = []

        def enter(c: Contestant) -> None:
            tried = self.trials(c, c.shapes(self.fitted))
            if not tried:
                return
            physical = tuple(t for t in tried if self.admissible(c, t))
            row = self.judged(c, physical or tried, bool(physical))
            known = rows.get(c.label)
            if known is None or (row.status is not Status.UNPHYSICAL, row.score.gain) > (
                known.status is not Status.UNPHYSICAL,
                known.score.gain,
            ):
                rows[c.label], pools[c.label] = row, physical

        for c in self.field:
            (enter if _leads(c) else later.append)(c)
        leader = max((r.score.gain for r in rows.values()), default=0.0)
        near = {label for label, r in rows.items() if r.score.gain > _NEAR * leader and r.score.z > _WORTH_REFINING}
        near -= self._present()
        for c in later:
            if c.label in near:
                enter(c)
        order = sorted(rows.values(), key=lambda r: -r.score.gain)
        worth = [r for r in order if r.status is not Status.UNPHYSICAL and r.score.z > _WORTH_REFINING]
        for r in worth[:_REFINED]:
            finer = refined(pools[r.label], partial(self.trials, r.contestant, physical=True))
            rows[r.label] = self.judged(r.contestant, finer, True)
        return self._ranked(sorted(rows.values(), key=lambda r: -r.score.gain))

    def _looks_alike(self, row: Row, winner: Row) -> bool:
        """A declared look-alike that would explain as much as a name demands, where the form of both is in doubt.

        It is ruled out only if what separates the two is ten times what the winner's own form leaves unexplained.
        """
        a, b = row.contestant.effect, winner.contestant.effect
        declared = b.family in a.look_alikes or a.family in b.look_alikes
        enough = row.score.gain >= NAMED_FROM * winner.score.gain
        left = max(0.0, self.model.loss - winner.score.best.gain - self.model.entries)
        close = winner.score.gain - row.score.gain < _FORM * left
        return declared and enough and close and row is not winner and row.status is not Status.UNPHYSICAL

    def _present(self) -> set[str]:
        """Families of which the joint holds a member already."""
        kinds = {law.kind for law in self.fitted.joint.laws}
        return {c.label for c in self.field if isinstance(c, InJoint) and c.joint_effect.member in kinds}

    def _ranked(self, ranked: Sequence[Row]) -> Round:
        self.owner = {id(r.score.best): r.contestant for r in ranked}
        passed = [r for r in ranked if (not r.reason if self.chosen is None else r.label == self.chosen)]
        if not passed:
            return Round(self.fitted, tuple(ranked), None, ())
        model = self.model
        best = simplest_of_ties(model, [r.score for r in passed], self.distance)
        winner = next(r for r in passed if r.score is best)
        possible = [r.score for r in ranked if r.status is not Status.UNPHYSICAL]
        close = {s.family for s in rivals_of(model, best, possible, self.distance)}
        close |= {r.label for r in ranked if self._looks_alike(r, winner)}
        rivals = tuple(r for r in ranked if r.label in close)
        marked = tuple(_marked(r, winner, close) for r in ranked)
        return Round(self.fitted, marked, replace(winner, status=Status.ACCEPTED), rivals)


def _leads(c: Contestant) -> bool:
    return not isinstance(c, InJoint) or c.joint_effect.leads


def _marked(row: Row, winner: Row, close: set[str]) -> Row:
    if row is winner:
        return replace(row, status=Status.ACCEPTED)
    if row.label in close:
        return replace(row, status=Status.TIED, reason=row.reason or "these records cannot separate it from the chosen")
    return row if row.reason else replace(row, reason="explains less than the chosen one")


def contest(fitted: Fitted, field: Sequence[Contestant], least_gain: float = 0.0, chosen: str | None = None) -> Round:
    """All contestants against one model. ``least_gain`` is what a further term must at least reach.

    Where the winner is ``chosen`` beforehand, the round tells how it fares and who its rivals are.
    """
    return _Contest(fitted, field, least_gain, chosen).held()


def grown(fitted: Fitted, row: Row) -> Fitted | None:
    """The model with an effect, everything that may move refitted."""
    best = row.score.best
    return row.contestant.grown(best.coefficients, best.shape, fitted)


def search(start: Fitted, field: Sequence[Contestant]) -> tuple[Round, tuple[Term, ...], tuple[Row, ...]]:
    """The first round, the accepted terms (largest first) and the rows that were only too small (secondary)."""
    opening = contest(start, field)
    terms: list[Term] = []
    current, least = opening, 0.0
    while current.winner is not None and len(terms) < _MOST_TERMS:
        bigger = grown(current.fitted, current.winner)
        if bigger is None or bigger.model.loss > current.model.loss:
            break
        terms.append(Term(current, current.winner, bigger))
        if len(terms) == 1:
            least = _LEAST_SHARE * current.winner.score.gain
        elif len(terms) == 2:
            # Once: beside a third term the same question costs more than the rest of the trace, and names nothing.
            terms = _exchanged(start, field, terms)
        if not _leaves_room(terms[-1].fitted.model, least):
            return opening, tuple(terms), ()
        current = contest(terms[-1].fitted, field, least)
    floor = _TOO_SMALL * (terms[0].row.score.gain if terms else 0.0)
    small = [r for r in current.rows if r.reason.startswith("less than a twentieth") and r.score.gain > floor]
    return opening, tuple(terms), tuple(small[:1])


def _leaves_room(model: Model, least: float) -> bool:
    """Whether what is left is more than noise, or noise could hide as much as a further term must at least gain."""
    excess, noise = model.loss - model.entries, 3 * np.sqrt(model.entries)
    return bool(excess > noise or excess + noise >= least)


def _exchanged(start: Fitted, field: Sequence[Contestant], terms: list[Term]) -> list[Term]:
    """Replace an earlier term where another family beside the others lowers the loss of everything.

    A greedy order starts with whatever imitates two effects at once; beside the second one its place is taken by
    the first. Tried are families that showed more than noise in one of the contests.
    """
    shown = {r.label for t in terms for r in t.round.rows if r.score.z > _WORTH_REFINING}
    strong = [c for c in field if c.label in shown]
    for i in range(len(terms) - 1):
        others = _rebuilt(start, strong, [t.row for j, t in enumerate(terms) if j != i])
        if others is None:
            continue
        again = contest(others[-1].fitted, strong)
        if again.winner is None or again.winner.label == terms[i].row.label:
            continue
        other = grown(others[-1].fitted, again.winner)
        if other is None or other.model.loss > terms[-1].fitted.model.loss - 10 * np.log(other.model.entries):
            continue
        rows = sorted([*(t.row for t in others), again.winner], key=lambda r: -r.score.gain)
        return _rebuilt(start, strong, rows, first_among=field) or terms
    return terms


def _rebuilt(
    start: Fitted, field: Sequence[Contestant], rows: Sequence[Row], first_among: Sequence[Contestant] = ()
) -> list[Term] | None:
    """Terms added anew in a given order; the first may be judged among a whole field, which shows its rivals."""
    terms: list[Term] = []
    for row in rows:
        here = terms[-1].fitted if terms else start
        own = [c for c in field if c.label == row.label]
        round_ = contest(here, own if terms or not first_among else first_among, chosen=row.label)
        bigger = None if round_.winner is None else grown(here, round_.winner)
        if round_.winner is None or bigger is None:
            return None
        terms.append(Term(round_, round_.winner, bigger))
    return terms
