"""Steps of a search: every effect beside the current model, which of them pass, and what was added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.loop.answer.report import Status
from jointlib.loop.path.acceptance import TIE, Assessment, assess, excess
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.contest import Entry, contains, contest
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.trials import Effect, Trial, member_of
from jointlib.path_fault import PathFault

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
class Composition:
    """Effects that were added one after the other; the first step is the baseline."""

    steps: tuple[Step, ...]
    terms: tuple[Term, ...] = ()
    """Those in the last model; exchanged ones are not among them."""

    @property
    def fitted(self) -> Fitted:
        return self.steps[-1].fitted

    @property
    def complexity(self) -> int:
        """Parameters that are fitted, and internal states."""
        return len(self.fitted.names) + len(self.fitted.joint.states)

    @property
    def members(self) -> tuple[tuple[str, str], ...]:
        """Family and member of its terms, whatever their order."""
        return tuple(sorted((t.family, t.member) for t in self.terms))


@dataclass(frozen=True)
class Part:
    """What one term of a composition is worth there: the others refitted without it, and who would take its place."""

    term: Term
    adds: Assessment
    """Of the whole composition over the others alone."""
    rows: tuple[Row, ...]
    """The contest beside the others, in which this term is accepted; none where they do not stand without it."""

    @property
    def row(self) -> Row | None:
        """Its own row there."""
        own = [r for r in self.rows if (r.entry.family, r.entry.member) == (self.term.family, self.term.member)]
        return own[0] if own else None


@dataclass(frozen=True)
class Finding:
    """What a search found: the best composition, what each of its terms is worth, and compositions that do as well."""

    best: Composition
    parts: tuple[Part, ...] = ()
    others: tuple[Composition, ...] = ()
    """The best of those that were followed beside it, best first."""

    @property
    def steps(self) -> tuple[Step, ...]:
        return self.best.steps

    @property
    def terms(self) -> tuple[Term, ...]:
        return self.best.terms

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


def rank(current: Fitted, effects: Sequence[Effect], store: ColumnStore, seed: int) -> tuple[Row, ...]:
    """All effects beside the current model, assessed."""
    evidence = current.evidence
    floor, folds = evidence.floor.power / evidence.block_power, evidence.deciding_folds
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
    return tuple(rows)


def winner_of(rows: Sequence[Row]) -> Row | None:
    """The simplest of those that pass and gain within one per cent of the best."""
    passed = [r for r in rows if r.entry.physical and r.assessment.accepted]
    if not passed:
        return None
    best = max(r.assessment.gain for r in passed)
    tied = [r for r in passed if r.assessment.gain >= (1 - TIE) * best]
    return min(tied, key=lambda r: (r.entry.complexity, -r.assessment.gain))


def settled(current: Fitted, rows: Sequence[Row], winner: Row | None, store: ColumnStore) -> tuple[Row, ...]:
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
