"""Which effects and compositions a search goes on with, and what a term must be worth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from jointlib.effect import JointEffect
from jointlib.loop.answer.naming import is_declared_pair
from jointlib.loop.path.acceptance import excess
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.contest import Entry
from jointlib.loop.path.estimates import set_by
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.steps import Composition, Part, Row, Term, deciding_excess, winner_of
from jointlib.loop.path.trials import Effect
from jointlib.path_fault import PathFault

LEAST, LEAST_ALIKE = 0.01, 0.05
"""Of the excess there was at first, that a further term must remove, and one that looks like a term before: what is
smaller is the form of that one."""
_AWAY = 0.5
"""Of what a refitted model leaves by its tangents where they are not believed."""
_NEARLY = 0.05
"""Members of a family that gain so much less than its best are followed in its stead if they are simpler."""


def widest(grown: Iterable[Composition], width: int) -> list[Composition]:
    """Of every number of terms the best few, and the best of further families until so many sets of these are in.

    Members of one family do nearly as well as each other and would leave no place for another effect; more terms
    always explain more.
    """
    ranked = sorted(grown, key=lambda c: deciding_excess(c.fitted))
    kept = []
    for count in sorted({len(c.terms) for c in ranked}):
        families = set[tuple[str, ...]]()
        for place, c in enumerate(c for c in ranked if len(c.terms) == count):
            own = tuple(sorted(t.family for t in c.terms))
            if place < width or (own not in families and len(families) < width):
                kept.append(c)
                families.add(own)
    return kept


def shown(effect: Effect, fitted: Fitted) -> bool:
    """Whether an effect is still what its name says after a refit that moved its shape."""
    return not isinstance(effect, JointEffect) or effect.shows(fitted.joint)


def as_left_out(fitted: Fitted, entry: Entry) -> Fitted:
    """A refitted model, judged by what its last effect left in the contest where that is less than half.

    There every fold chose its shape among all, and here it goes along the tangents of the whole: from small motions
    to the largest, which nothing else holds, these run away (how hard a contact slips that small motions do not slip).
    """
    evidence = fitted.evidence
    floor = evidence.floor.power / evidence.block_power
    if excess(entry.deciding_loss, floor) >= _AWAY * deciding_excess(fitted):
        return fitted
    if fitted.condition_loss is None:
        return replace(fitted, block_loss=entry.deciding_loss)
    return replace(fitted, condition_loss=entry.deciding_loss)


def stands(c: Composition, term: Term) -> bool:
    """Whether a size that a term of a composition has is told from nothing by more than its 95 % interval.

    Sizes of which none has an error do nothing to the force: a spring that a refit sent to 0 N/m. Lengths, speeds and
    whatever else shapes it are no sizes: an effect of size 0 may have any.
    """
    known = set_by(term, c.fitted, c.steps[0].fitted)
    sizes = [e for name, e in known.items() if name.rpartition(".")[2] not in term.trial.shape]
    idle = all(np.isnan(e.standard_error) for e in sizes)
    return not sizes or not (idle or all(abs(e.value) < 1.96 * e.standard_error for e in sizes))


def is_nested(c: Composition, best: Composition) -> bool:
    """True if two compositions differ in one effect each, which ordinary records hardly tell apart."""
    new = [t for t in c.terms if t.family not in {b.family for b in best.terms}]
    old = [t for t in best.terms if t.family not in {o.family for o in c.terms}]
    return len(new) == len(old) == 1 and is_declared_pair(new[0].effect, old[0].effect)


def further(c: Composition, best: Composition) -> float:
    """Excess that the terms which another composition has more than this one have to remove."""
    return max(0, len(best.terms) - len(c.terms)) * LEAST * deciding_excess(c.steps[0].fitted)


def least_gain(c: Composition, effect: Effect) -> float:
    """Excess that an effect has to remove beside the terms of a composition."""
    others = [t.effect for t in c.terms if t.effect is not effect]
    if not others:
        return 0.0
    alike = any(_may_be_form(effect, o, c) for o in others)
    return (LEAST_ALIKE if alike else LEAST) * deciding_excess(c.steps[0].fitted)


def _may_be_form(effect: Effect, other: Effect, c: Composition) -> bool:
    """Whether what one effect removes beside another may be the form of that one: they look alike.

    The loop that a late record opens is the form of no law without memory, nor is what it does where an input changes
    that parameters follow.
    """
    alike = effect.family in other.look_alikes or other.family in effect.look_alikes
    recorded = isinstance(effect, PathFault) or isinstance(other, PathFault)
    joint = c.fitted.joint
    return alike and not (recorded and (joint.modulations or not joint.states))


def pays(c: Composition, part: Part) -> bool:
    """True where a term passes every test over all the others, and by enough, or the others are nothing without it."""
    if not part.rows:
        return True
    left = deciding_excess(c.fitted)
    return part.adds.accepted and left * part.adds.share / max(1 - part.adds.share, 1e-300) >= least_gain(
        c, part.term.effect
    )


def is_another(row: Row, terms: Sequence[Term]) -> bool:
    """True for a second element of an effect that a composition holds: of its family, or one that contains the other.

    No contact has the corner of a formula; what a second element gains there is no second effect.
    """
    return any(
        row.entry.family == t.family or is_declared_pair(row.entry.effect, t.effect)
        for t in terms
        if not isinstance(t.effect, AlongInput)
    )


def leaders(rows: Sequence[Row], width: int) -> list[Row]:
    """The winner, and the best of other families that pass; of each the simplest member that does nearly as well."""
    winner = winner_of(rows)
    if winner is None:
        return []
    passed = [r for r in rows if r.entry.physical and r.assessment.accepted]
    best = {winner.entry.family: winner}
    for family in dict.fromkeys(r.entry.family for r in sorted(passed, key=lambda r: -r.assessment.gain)):
        own = [r for r in passed if r.entry.family == family]
        enough = (1 - _NEARLY) * max(r.assessment.gain for r in own)
        near = [r for r in own if r.assessment.gain >= enough]
        best.setdefault(family, min(near, key=lambda r: (r.entry.complexity, -r.assessment.gain)))
    return list(best.values())[:width]
