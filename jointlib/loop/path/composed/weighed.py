"""What every term of a composition is worth beside the others, and the composition without what is worth nothing."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.loop.path.acceptance import Assessment, assess
from jointlib.loop.path.composed.choice import is_another, least_gain, pays, shown, stands
from jointlib.loop.path.composed.field import Field
from jointlib.loop.path.steps import Composition, Part, Row, Step, Term, deciding_excess, settled

EXCHANGES = 3
"""Rounds of exchange and further growth at most."""


def is_certain(c: Composition, part: Part) -> bool:
    """True where a term pays, and is told from nothing beside the others; an effect alone has passed its tests."""
    return len(c.terms) < 2 or (pays(c, part) and stands(c, part.term))


def certain(field: Field, c: Composition, parts: Sequence[Part]) -> tuple[Composition, tuple[Part, ...]]:
    """A composition without the terms that the others make up for, and what those left are worth."""
    kept = [p.term for p in parts if is_certain(c, p)]
    fitted = field.replayed(kept, c.fitted.model) if kept else None
    if fitted is None:
        return c, tuple(parts)
    less = now = Composition((*c.steps, Step(kept[-1], fitted, action="dropped others")), tuple(kept))
    # What is left was chosen beside the others, so each of it is held against the whole catalogue once more.
    for _ in range(EXCHANGES):
        swapped, again = weighed(field, now)
        if swapped is None:
            return now, again
        now = swapped
    return less, tuple(p for p in parts if p.term in kept)


def weighed(field: Field, c: Composition) -> tuple[Composition | None, tuple[Part, ...]]:
    """What each term of a composition is worth; or instead the composition with one of them exchanged for an effect
    that passes the tests against the whole."""
    evidence, current, parts = field.evidence, c.fitted, list[Part]()
    floor, folds = evidence.floor.power / evidence.block_power, evidence.deciding_folds
    for i, term in enumerate(c.terms):
        others = [t for k, t in enumerate(c.terms) if k != i]
        last = i == len(others) and c.steps[-1].action == "added"
        base = c.steps[-2].fitted if last else field.replayed(others, current.model)
        if base is None:
            parts.append(Part(term, term.assessment, ()))
            continue
        rows = c.steps[-2].rows if last else field.rank(base)
        own = next((r for r in rows if (r.entry.family, r.entry.member) == (term.family, term.member)), None)
        first = next((r for r in rows if not is_another(r, others)), None)
        passes = first is not None and first.entry.physical and first.assessment.accepted
        # What gains too little to be a further effect is none in the place of another either.
        if first is not None and first.assessment.share * deciding_excess(base) < least_gain(c, first.entry.effect):
            passes = False
        if not last and first is not None and first is not own and passes:
            found = assess(current.deciding_loss, first.entry.deciding_loss, floor, folds, field.seed)
            swapped = _with(field, c, others, first, found) if found.accepted else None
            if swapped is not None:
                return swapped, ()
        adds = assess(base.deciding_loss, current.deciding_loss, floor, folds, field.seed)
        parts.append(Part(term, adds, rows if last else settled(base, rows, own, field.store)))
    return None, tuple(parts)


def _with(field: Field, c: Composition, others: Sequence[Term], row: Row, found: Assessment) -> Composition | None:
    """A composition with another effect in the place of one of its terms, if that lowers the excess."""
    if row.entry.best.model is None:
        return None
    fitted = field.fit(row.entry.best.model, len(others) + 1)
    if deciding_excess(fitted) >= deciding_excess(c.fitted) or not shown(row.entry.effect, fitted):
        return None
    term = Term(row.entry.effect, row.entry.best, found)
    return Composition((*c.steps, Step(term, fitted, action="exchanged")), (*others, term))
