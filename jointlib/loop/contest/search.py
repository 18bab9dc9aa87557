"""Search the catalogue: rounds of a contest, acceptance, and exchange of earlier terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.loop.answer.naming import NAMED_ON_A_RIG_FROM
from jointlib.loop.balance.excess import total_excess
from jointlib.loop.contest.contestant import Contestant
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.contest.model import Model
from jointlib.loop.contest.rounds import WORSENS, WORTH_REFINING, Round, Row, contest, is_outside_joint

_MOST_TERMS = 3
_LEAST_SHARE = 0.05
_TOO_SMALL = 1e-3
"""Of the first term's gain: below this what is left is the error of its form, not another effect."""
_PROMISING = 0.3
"""Of what the terms before leave: where one explains less, no set with a third will be named."""
_MOST_LEFT = 0.5
"""Of what a first term leaves that is too little for a name: a second one of so much enters whatever its size."""
_STRONG = 0.5
"""Of the largest gain: how much an effect that was held back must reach for terms to begin with it."""
_MOST_BEGINNINGS = 2
_STARTS = (0.5, 1.0, 0.2)
"""Of its linear fit: where a second element starts from while the first still has the whole size."""


@dataclass(frozen=True)
class Term:
    """An accepted effect, the round it won and the model refitted with it."""

    round: Round
    row: Row
    alone: Fitted
    """With one element of it: what its name is judged by."""
    fitted: Fitted
    """With a second element of the same family where the records show that one does not have its form."""
    beside: Round | None = None
    """The contest beside all other terms, refitted without it, if it wins there too."""


def explained(start: Fitted, mended: Fitted) -> float:
    """Share of the excess of the start that is gone from a mended model; 1 where there was none."""
    before, after = (total_excess(f.localised) for f in (start, mended))
    return 1.0 if before <= 0 else 1 - after / before


def adds(term: Term, terms: Sequence[Term]) -> float:
    """Share of what all other terms leave that a term explains beside them; nothing where another takes its place.

    What is wrong outside the joint may explain that share of what they leave in the balance and redundancy equations
    instead: there is nothing of what the form of an effect of the joint leaves.
    """
    if term.beside is None:
        return 0.0
    before, after = term.beside.fitted, terms[-1].fitted
    share = explained(before, after)
    if is_outside_joint(term.row.contestant):
        left, still = (f.model.excess_outside_joint for f in (before, after))
        if left * (1 - NAMED_ON_A_RIG_FROM) > after.model.hidden:
            share = max(share, 1 - still / left)
    return share


def together(start: Fitted, terms: Sequence[Term]) -> bool:
    """Whether the first term is too little for a name alone, and each of several explains as much as that demands of
    what the others leave.

    A stack that imitates something else leaves more: the parts of two effects that resemble a third make up for one
    another, so that the last of them explains nine tenths of what the others leave, not 97 %. Noise must not hide
    that difference.
    """
    if len(terms) < 2 or _enough_alone(start, terms):
        return False
    whole = terms[-1].fitted.model
    least = whole.hidden / (1 - NAMED_ON_A_RIG_FROM)
    return all(
        t.beside is not None and t.beside.model.loss - whole.loss > least and adds(t, terms) >= NAMED_ON_A_RIG_FROM
        for t in terms
    )


def grown(fitted: Fitted, row: Row) -> Fitted | None:
    """The model with an effect, everything that may move refitted."""
    best = row.score.best
    return row.contestant.grown(best.coefficients, best.shape, fitted)


def search(start: Fitted, field: Sequence[Contestant]) -> tuple[Round, tuple[Term, ...], tuple[Row, ...]]:
    """The first round, the accepted terms (largest first) and the rows that were only too small (secondary).

    Where no name comes of it, terms begin with an effect that made a record left out worse while another was missing;
    they count if each wins beside the others.
    """
    opening = contest(start, field)
    terms, small = _terms_from(start, field, opening)
    if opening.model.loss - opening.model.entries > opening.model.hidden and not _is_named(start, terms):
        for row in _held_back(opening):
            others, _ = _terms_from(start, field, replace(opening, winner=row, rivals=()))
            if together(start, others):
                return opening, others, ()
    return opening, terms, small


def _is_named(start: Fitted, terms: Sequence[Term]) -> bool:
    """Whether one effect explains what a name demands, or several together."""
    return bool(terms) and (_enough_alone(start, terms) or together(start, terms))


def _held_back(opening: Round) -> tuple[Row, ...]:
    """The strongest that failed for no more than one record left out."""
    most = max((r.score.gain for r in opening.rows), default=0.0)
    return tuple(r for r in opening.rows if r.reason == WORSENS and r.score.gain > _STRONG * most)[:_MOST_BEGINNINGS]


def _terms_from(start: Fitted, field: Sequence[Contestant], opening: Round) -> tuple[tuple[Term, ...], tuple[Row, ...]]:
    """The accepted terms from the winner of a first round on, and the rows that were only too small."""
    terms: list[Term] = []
    named: list[Term] = []
    current, least = opening, 0.0
    while current.winner is not None:
        bigger = grown(current.fitted, current.winner)
        if bigger is None or bigger.size > current.fitted.size:
            break
        terms.append(_term(current, current.winner, bigger, field, first=not terms))
        if len(terms) == 1:
            least = _LEAST_SHARE * current.winner.score.gain
            if not _enough_alone(start, terms):
                left = bigger.model.loss - bigger.model.entries
                least = min(least, _MOST_LEFT * left)
        elif len(terms) == 2 or not _enough_alone(start, terms):
            # Beside a third the question costs more than the rest of the trace: not where the first is named alone.
            terms = _exchanged(start, field, terms)
            if not _enough_alone(start, terms):
                if any(t.beside is None for t in terms):
                    terms = _exchanged(start, field, terms)
                if together(start, terms):
                    named = [*terms]
                elif named or explained(terms[-2].fitted, terms[-1].fitted) < _PROMISING:
                    # A third that is not named as well is left out; without two no name will come of it.
                    return tuple(named or terms), ()
        if len(terms) == _MOST_TERMS or not _leaves_room(terms[-1].fitted.model, least):
            return tuple(terms), ()
        current = contest(terms[-1].fitted, field, least)
    floor = _TOO_SMALL * (terms[0].row.score.gain if terms else 0.0)
    small = [r for r in current.rows if r.reason.startswith("less than a twentieth") and r.score.gain > floor]
    return tuple(terms), tuple(small[:1])


def _enough_alone(start: Fitted, terms: Sequence[Term]) -> bool:
    """Whether the first effect explains what a name demands."""
    return explained(start, terms[0].alone) >= NAMED_ON_A_RIG_FROM


def _term(round_: Round, row: Row, alone: Fitted, field: Sequence[Contestant], *, first: bool) -> Term:
    """An accepted effect; the first is brought into form, what it leaves is what further ones are judged by."""
    return Term(round_, row, alone, _in_form(round_.fitted, alone, row, field) if first else alone)


def _in_form(before: Fitted, fitted: Fitted, row: Row, field: Sequence[Contestant]) -> Fitted:
    """The model with a second element of a family just accepted, where that passes every test of a further term.

    Real contacts do not come in one size: friction that rises over several speeds, clearances of several widths. What
    one element leaves of its own family would otherwise be taken for an effect of another one. Laws with memory have
    members of several elements already.
    """
    brought = fitted.joint.laws[len(before.joint.laws) :]
    if not row.score.best.shape or not brought or any(law.states for law in brought):
        return fitted
    round_ = contest(fitted, [c for c in field if c.label == row.label])
    if round_.winner is None:
        return fitted
    best, worth = round_.winner.score.best, 10 * np.log(fitted.model.entries)
    for share in _STARTS:
        bigger = row.contestant.grown(share * best.coefficients, best.shape, fitted)
        if bigger is not None and bigger.size < fitted.size - worth:
            return bigger
    return fitted


def _leaves_room(model: Model, least: float) -> bool:
    """Whether what is left is more than noise, or noise could hide as much as a further term must at least gain."""
    excess, noise = model.loss - model.entries, model.hidden
    return bool(excess > noise or excess + noise >= least)


def _exchanged(start: Fitted, field: Sequence[Contestant], terms: list[Term]) -> list[Term]:
    """Replace an earlier term where another family beside the others lowers the loss of everything.

    A greedy order starts with whatever imitates two effects at once; beside the second one its place is taken by
    the first. Tried are families that showed more than noise in one of the contests. A term that wins again keeps the
    contest beside the others.
    """
    shown = {r.label for t in terms for r in t.round.rows if r.score.z > WORTH_REFINING}
    strong = [c for c in field if c.label in shown]
    terms = _with_last_beside(terms, strong)
    for i in range(len(terms) - 1):
        others = _rebuilt(start, strong, [t.row for j, t in enumerate(terms) if j != i])
        if others is None:
            continue
        again = contest(others[-1].fitted, strong)
        if again.winner is None:
            continue
        same = again.winner.label == terms[i].row.label
        if same:
            terms[i] = replace(terms[i], beside=again)
            if not again.winner.score.best.shape:
                continue
        other = grown(others[-1].fitted, again.winner)
        if other is None or other.model.loss > terms[-1].fitted.model.loss - 10 * np.log(other.model.entries):
            continue
        if same:  # Its wavelength, frequency or clearance was found while another effect was missing.
            terms[-1] = replace(terms[-1], fitted=other)
            continue
        rows = sorted([*(t.row for t in others), again.winner], key=lambda r: -r.score.gain)
        anew = _rebuilt(start, strong, rows, first_among=field)
        return terms if anew is None else _with_last_beside(anew, strong)
    return terms


def _with_last_beside(terms: list[Term], strong: Sequence[Contestant]) -> list[Term]:
    """Terms of which the last keeps the contest beside all others, if it wins there or ties with the winner.

    The mass of one of two bodies that move together ties with that of the other.
    """
    last, label = terms[-1].round, terms[-1].row.label
    if len(last.rows) == 1:  # It was added anew, against nothing but itself.
        last = contest(terms[-2].fitted, strong)
    if last.winner is not None and label in {r.label for r in last.rivals}:
        last = contest(terms[-2].fitted, strong, chosen=label)
    if last.winner is None or last.winner.label != label:
        return terms
    return [*terms[:-1], replace(terms[-1], beside=last)]


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
        terms.append(_term(round_, round_.winner, bigger, field, first=not terms))
    return terms
