"""The best compositions of effects: forward selection that follows several, exchange, and what each term is worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from jointlib.joint import Joint
from jointlib.loop.answer.naming import NAMED_FROM
from jointlib.loop.path.acceptance import SHARE, TIE
from jointlib.loop.path.columns import ColumnStore, moved_or_none
from jointlib.loop.path.composed.choice import (
    LEAST,
    as_left_out,
    further,
    is_another,
    is_nested,
    leaders,
    least_gain,
    shown,
    stands,
    widest,
)
from jointlib.loop.path.composed.field import Field
from jointlib.loop.path.composed.late_input import with_late_inputs
from jointlib.loop.path.composed.own_offsets import with_own_offsets
from jointlib.loop.path.composed.pairs import pairs_beside
from jointlib.loop.path.composed.weighed import EXCHANGES, certain, is_certain, weighed
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, fit, named_by_role
from jointlib.loop.path.steps import (
    Composition,
    Finding,
    Part,
    Step,
    Term,
    deciding_excess,
    is_quiet,
    settled,
)
from jointlib.loop.path.trials import Effect, trials_of
from jointlib.parameter import Role

_WIDTH = 3
"""Compositions that are followed side by side where no effect alone explains what is missing."""
_MOST_TERMS = 4
_PAIRS = 2
"""Pairs of effects that hide one another which are followed beside what passes alone."""
_CLEARLY = 0.25
"""Of what the best single effect leaves; a pair that hid one another and leaves less competes with it."""
_DECADES, _LESS = (0.1, 10.0, 100.0, 1000.0), 0.9
"""Times its velocity at which a corner is tried anew, and the share of the excess that it has to fall below."""


def search(evidence: Evidence, joint: Joint, effects: Sequence[Effect], seed: int) -> Finding:
    """The effect that explains what is missing, or else the composition of effects that does.

    Where the best single effect explains enough to be named, no pair that hid one another leaves clearly less and no
    simpler effect beside a second one leaves less, further ones are added one by one as long as one passes every test.
    Else the best few compositions are followed side by side, each with the effects that pass beside it,
    and all are refitted as a whole. Every earlier term of the best may then be exchanged for another effect.
    """
    field = Field(evidence, joint, tuple(effects), ColumnStore(evidence.recorded), seed)
    start = Composition((Step(None, fit(evidence, Model(joint))),))
    start, children = _grown(replace(field, quick=False), start, 1)
    alone = bool(children) and _explained(start, children[0]) >= NAMED_FROM
    simpler: list[Composition] = []
    if alone:
        left = deciding_excess(children[0].fitted)
        simpler = [c for c in _simpler(field, start, children[0]) if deciding_excess(c.fitted) < (1 - SHARE) * left]
        alone = not simpler and not any(deciding_excess(p.fitted) < _CLEARLY * left for p in _paired(field, start))
    own = None if alone or evidence.own_offsets else with_own_offsets(start.fitted)
    if own is not None:
        return search(own, joint, effects, seed)
    field = replace(field, quick=not alone)
    if not alone:
        children += [*_grown(field, start, _WIDTH)[1][len(children) :], *simpler]
    best, others = _followed(field, start, children, 1 if alone else _WIDTH)
    tried = best
    best, parts = _settled(field, best)
    if len(best.terms) < len(tried.terms):  # What lost terms may leave more than what began beside it.
        first = [c for c in children if all(stands(c, t) for t in c.terms)]
        least = min(first, key=lambda c: deciding_excess(c.fitted), default=best)
        if deciding_excess(least.fitted) < deciding_excess(best.fitted):
            again = _settled(field, least)
            best, parts = min((best, parts), again, key=lambda found: deciding_excess(found[0].fitted))
    if len(best.terms) > 1 and not alone:
        last = replace(best.steps[-1], fitted=_with_corners(evidence, fit(evidence, best.fitted.model)))
        best = replace(best, steps=(*best.steps[:-1], last))
    best, parts = with_late_inputs(field, best, parts)
    return Finding(best, parts, tuple(c for c in others if c.members != best.members))


def _settled(field: Field, best: Composition) -> tuple[Composition, tuple[Part, ...]]:
    """A composition with its terms exchanged for better ones, and without those that are not certain."""
    parts: tuple[Part, ...] = ()
    for _ in range(EXCHANGES):
        swapped, parts = weighed(field, best)
        if swapped is None:
            break
        best = _followed(field, swapped, _grown(field, swapped, 1)[1], 1)[0]
    return (best, parts) if all(is_certain(best, p) for p in parts) else certain(field, best, parts)


def _with_corners(evidence: Evidence, found: Fitted) -> Fitted:
    """A composition with its corners rounded otherwise by decades, if that leaves clearly less.

    A corner that one effect had alone may be far from the one that it has beside others.
    """
    own = {name: found.joint.parameters[name] for name in named_by_role(found.joint, Role.SMOOTHING)}
    best = found
    for times in _DECADES if own else ():
        joint = moved_or_none(found.joint, {name: times * x for name, x in own.items()})
        if joint is not None:
            other = fit(evidence, replace(found.model, joint=joint), rounding=True)
            if deciding_excess(other) < _LESS * deciding_excess(best):
                best = other
    return best


def _explained(start: Composition, grown: Composition) -> float:
    return 1 - deciding_excess(grown.fitted) / deciding_excess(start.fitted)


def _followed(
    field: Field, start: Composition, beam: list[Composition], width: int
) -> tuple[Composition, list[Composition]]:
    """The best composition that grows from some, and the others that ended, best first.

    The best is the simplest of those that leave about as little as the least (less than a term has to remove apart),
    gain as much with an effect that its own contains, or need fewer terms, where the further ones remove less than
    such terms have to.
    """
    done = [] if beam else [start]
    while beam:
        grown: dict[tuple[tuple[str, str], ...], Composition] = {}
        for c in beam:
            c, children = _grown(field, c, width)
            if not children:
                done.append(c)
            for child in children:
                known = grown.get(child.members)
                if known is None or deciding_excess(child.fitted) < deciding_excess(known.fitted):
                    grown[child.members] = child
        beam = widest(grown.values(), width)
    done.sort(key=lambda c: deciding_excess(c.fitted))
    total, least = (deciding_excess(f) for f in (start.steps[0].fitted, done[0].fitted))
    near, alike = least / (1 - SHARE), least + TIE * (total - least)
    tied = [
        c
        for c in done
        if deciding_excess(c.fitted) <= max(alike if is_nested(c, done[0]) else near, least + further(c, done[0]))
    ]
    best = min(tied, key=lambda c: (c.complexity, deciding_excess(c.fitted)))
    return best, [c for c in done if c is not best]


def _grown(field: Field, c: Composition, width: int) -> tuple[Composition, list[Composition]]:
    """A composition with the contest beside it, and with each of the best effects that pass there and lower the excess
    of the whole."""
    current, rows = c.fitted, c.steps[-1].rows or field.rank(c.fitted)
    full = is_quiet(current) or len(c.terms) == _MOST_TERMS
    children = []
    for row in [] if full else leaders([r for r in rows if not is_another(r, c.terms)], width):
        assert row.entry.best.model is not None
        fitted = as_left_out(field.fit(row.entry.best.model, len(c.terms) + 1), row.entry)
        lower = deciding_excess(fitted) < deciding_excess(current) - least_gain(c, row.entry.effect)
        if lower and shown(row.entry.effect, fitted):
            term = Term(row.entry.effect, row.entry.best, row.assessment)
            here = replace(c.steps[-1], rows=settled(current, rows, row, field.store))
            children.append(Composition((*c.steps[:-1], here, Step(term, fitted)), (*c.terms, term)))
    if width > 1 and not full and len(c.terms) < _MOST_TERMS - 1:
        children += _paired(field, replace(c, steps=(*c.steps[:-1], replace(c.steps[-1], rows=rows))))
    if not children:
        rows = settled(current, rows, None, field.store)
    return replace(c, steps=(*c.steps[:-1], replace(c.steps[-1], rows=rows))), children


def _paired(field: Field, c: Composition) -> list[Composition]:
    """A composition, whose contest is known, with each of the best pairs of effects that hide one another."""
    current, rows, out = c.fitted, c.steps[-1].rows, []
    beside = [r for r in rows if not is_another(r, c.terms)]
    for pair in pairs_beside(current, beside, field.store, field.seed)[:_PAIRS]:
        fitted = field.fit(pair.model, len(c.terms) + 2)
        least = LEAST * deciding_excess(c.steps[0].fitted) if c.terms else 0.0
        lower = deciding_excess(fitted) < deciding_excess(current) - least
        if lower and all(shown(row.entry.effect, fitted) for row in pair.rows):
            three = zip(pair.rows, pair.trials, pair.found[:0:-1], strict=True)
            terms = [Term(row.entry.effect, trial, found) for row, trial, found in three]
            here = replace(c.steps[-1], rows=settled(current, rows, pair.rows[0], field.store))
            added = [Step(term, fitted, action="paired") for term in terms]
            both = Composition((*c.steps[:-1], here, *added), (*c.terms, *terms))
            out += [both] if all(stands(both, t) for t in terms) else []
    return out


def _simpler(field: Field, start: Composition, alone: Composition) -> list[Composition]:
    """In place of the one effect that explains enough, one that looks like it and has less to fit, at the shape that
    both have, with what passes beside it: the further shape, or the memory, may have stood for a second effect."""
    (term,) = alone.terms
    rows = start.steps[-1].rows
    own = next(r.entry for r in rows if (r.entry.family, r.entry.member) == (term.family, term.member))
    near = [
        row
        for row in rows
        if row.entry.physical and row.assessment.accepted and row.entry.complexity < own.complexity
        if row.entry.family in own.effect.look_alikes or own.family in row.entry.effect.look_alikes
    ]
    if is_quiet(alone.fitted) or not near:
        return []
    row = max(near, key=lambda r: r.assessment.gain)
    same = {key: term.trial.shape.get(key, value) for key, value in row.entry.best.shape.items()}
    out = []
    for trial in trials_of(row.entry.effect, [same], start.fitted, field.store):
        if trial.model is not None:
            first = Term(row.entry.effect, trial, row.assessment)
            out += _grown(field, Composition((*start.steps, Step(first, field.fit(trial.model))), (first,)), 1)[1]
    return out
