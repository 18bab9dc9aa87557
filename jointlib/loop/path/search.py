"""Term after term: contest, acceptance, refit, exchange."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.answer.report import Status
from jointlib.loop.path.acceptance import TIE, Assessment, assess, excess
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.contest import Entry, contains, contest
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, fit
from jointlib.loop.path.regression import Index
from jointlib.loop.path.trials import Effect, Trial, member_of, trials_of
from jointlib.path_fault import PathFault

_MOST_TERMS = 4
_QUIET = 1.5
"""Nothing is missing where the held-out rms is below this multiple of the floor."""


@dataclass(frozen=True)
class Row:
    """A family, how it fared and what became of it."""

    entry: Entry
    assessment: Assessment
    status: Status
    reason: str


@dataclass(frozen=True)
class Term:
    """An accepted effect: the trial that was applied, and its share of the excess at that time."""

    effect: Effect
    trial: Trial
    assessment: Assessment

    @property
    def family(self) -> str:
        return self.effect.family

    @property
    def member(self) -> str:
        return member_of(self.effect)


@dataclass(frozen=True)
class Step:
    """The model after one more term (none at the start), and the contest that followed."""

    term: Term | None
    fitted: Fitted
    rows: tuple[Row, ...] = ()
    action: str = "added"


@dataclass(frozen=True)
class Finding:
    """Every step of a search; the first is the baseline."""

    steps: tuple[Step, ...]
    terms: tuple[Term, ...]

    @property
    def before(self) -> Fitted:
        return self.steps[0].fitted

    @property
    def after(self) -> Fitted:
        return self.steps[-1].fitted

    @property
    def rows(self) -> tuple[Row, ...]:
        """The contest beside the baseline."""
        return self.steps[0].rows


def search(evidence: Evidence, joint: Joint, effects: Sequence[Effect], seed: int) -> Finding:
    """Add the best effect as long as one passes every test, trying to exchange earlier terms after each."""
    store = ColumnStore(evidence.recorded)
    steps, terms = [Step(None, fit(evidence, Model(joint)))], list[Term]()
    while True:
        current = steps[-1].fitted
        rows = rank(current, effects, store, seed)
        winner = None if is_quiet(current) or len(terms) == _MOST_TERMS else _winner(rows)
        if winner is not None and winner.entry.best.model is not None:
            fitted = fit(evidence, winner.entry.best.model)
            if deciding_excess(fitted) >= deciding_excess(current):
                winner = None
        steps[-1] = replace(steps[-1], rows=_settled(current, rows, winner, store))
        if winner is None:
            return Finding(tuple(steps), tuple(terms))
        terms.append(Term(winner.entry.effect, winner.entry.best, winner.assessment))
        steps.append(Step(terms[-1], fitted))
        if len(terms) > 1:
            swapped = _exchange(evidence, joint, effects, terms, fitted, store, seed)
            if swapped is not None:
                terms, fitted, term = swapped
                steps.append(Step(term, fitted, action="exchanged"))


def is_quiet(fitted: Fitted) -> bool:
    """True where what is left is about what repetitions differ by; never with an unknown floor."""
    evidence = fitted.evidence
    return evidence.floor.known and bool(
        np.mean(fitted.deciding_loss) < _QUIET**2 * np.mean(evidence.floor.power / evidence.block_power)
    )


def deciding_excess(fitted: Fitted) -> float:
    """E of a fitted model on the folds that decide."""
    evidence = fitted.evidence
    return excess(fitted.deciding_loss, evidence.floor.power / evidence.block_power)


def deciding_folds(evidence: Evidence) -> Index:
    """Fold number of every block: conditions, or the blocks themselves where there is one trajectory."""
    several = len(evidence.division.conditions) > 1
    return evidence.condition_folds if several else evidence.floor.block_folds


def rank(current: Fitted, effects: Sequence[Effect], store: ColumnStore, seed: int) -> list[Row]:
    """All effects beside the current model, assessed."""
    evidence = current.evidence
    floor, folds = evidence.floor.power / evidence.block_power, deciding_folds(evidence)
    rows = []
    for entry in contest(current, effects, store):
        found = assess(current.deciding_loss, entry.deciding_loss, floor, folds, seed)
        status = Status.REJECTED if entry.physical else Status.UNPHYSICAL
        wrong = (
            "a damping below zero beside it"
            if isinstance(entry.effect, PathFault)
            else "coefficients of the wrong sign"
        )
        reason = "; ".join(found.reasons) if entry.physical else f"best fit has {wrong}"
        rows.append(Row(entry, found, status, reason))
    return rows


def _winner(rows: Sequence[Row]) -> Row | None:
    """The simplest of those that pass and gain within one per cent of the best."""
    passed = [r for r in rows if r.entry.physical and r.assessment.accepted]
    if not passed:
        return None
    best = max(r.assessment.gain for r in passed)
    tied = [r for r in passed if r.assessment.gain >= (1 - TIE) * best]
    return min(tied, key=lambda r: (r.entry.complexity, -r.assessment.gain))


def _settled(current: Fitted, rows: Sequence[Row], winner: Row | None, store: ColumnStore) -> tuple[Row, ...]:
    """Rows with the status that the winner leaves them."""
    out = []
    for row in rows:
        if row is winner:
            row = replace(row, status=Status.ACCEPTED, reason="removes most of what is left and passes every test")
        elif row.entry.physical and row.assessment.accepted:
            if winner is None:
                row = replace(row, reason="what is left is at the floor, or the refit does not hold the gain")
            elif row.assessment.gain < (1 - TIE) * winner.assessment.gain:
                row = replace(row, reason="gains less than the leader")
            elif contains(current, row.entry, winner.entry, store):
                reason = f"contains {winner.entry.member}; its further terms gain nothing"
                row = replace(row, status=Status.TIED, reason=reason)
            else:
                row = replace(row, status=Status.TIED, reason="gains as much as the chosen one: a rival")
        out.append(row)
    return tuple(out)


def is_rival(row: Row) -> bool:
    """A tied family that is another explanation, not an extension of the chosen one."""
    return row.status is Status.TIED and row.reason.endswith("rival")


def _exchange(
    evidence: Evidence,
    joint: Joint,
    effects: Sequence[Effect],
    terms: Sequence[Term],
    current: Fitted,
    store: ColumnStore,
    seed: int,
) -> tuple[list[Term], Fitted, Term] | None:
    """Replace one earlier term by another effect if that passes the tests against the current model."""
    floor, folds = evidence.floor.power / evidence.block_power, deciding_folds(evidence)
    for i in range(len(terms) - 1):
        others = [t for k, t in enumerate(terms) if k != i]
        without = _replayed(evidence, joint, others, store)
        if without is None:
            continue
        for entry in contest(without, effects, store)[:1]:
            same = (entry.family, entry.member) == (terms[i].family, terms[i].member)
            if same or not entry.physical or entry.best.model is None:
                continue
            found = assess(current.deciding_loss, entry.deciding_loss, floor, folds, seed)
            if not found.accepted:
                continue
            fitted = fit(evidence, entry.best.model)
            if deciding_excess(fitted) < deciding_excess(current):
                term = Term(entry.effect, entry.best, found)
                return [*others, term], fitted, term
    return None


def _replayed(evidence: Evidence, joint: Joint, terms: Sequence[Term], store: ColumnStore) -> Fitted | None:
    """The baseline with some of the terms, refitted; None where one is not physical without the others."""
    fitted = fit(evidence, Model(joint))
    for term in terms:
        found = trials_of(term.effect, [term.trial.shape], fitted, store)
        if not found or found[0].model is None:
            return None
        fitted = fit(evidence, found[0].model)
    return fitted
