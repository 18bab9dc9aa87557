"""Which effect takes away what a joint leaves of free decays, judged on levels left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointlib.effect import JointEffect
from jointlib.loop.answer.naming import NAMED_FROM
from jointlib.loop.answer.report import Status
from jointlib.loop.decay.fitted import Fitted, Folds, with_folds
from jointlib.loop.decay.trials import SIGN, Trial, attempt
from jointlib.ringdown.evidence import Evidence

LEAST = 0.2
"""Of the excess; what removes less is refused."""
CLEAN = 4.0
"""Σ r²/n up to which nothing that is known contradicts a joint: twice the doubt of form."""
ALIKE = 3.0
"""Times what the best leaves; what leaves no more is a rival."""
_SHARE = 0.05
"""Of the excess, from which a fold must gain."""
_NEAR = 0.9
"""Of the best share in sample, from which candidates are held out."""
_PART = 0.5
"""Of what the best explains in sample, from which further members of a family are tried."""


@dataclass(frozen=True)
class Row:
    """One effect beside a joint as it fared."""

    effect: JointEffect
    fitted: Fitted | None
    share: float
    """Of the held-out excess, that it removes; in sample where it was not held out."""
    gains: tuple[float, ...]
    status: Status
    reason: str


@dataclass(frozen=True)
class Round:
    """A contest beside one joint."""

    before: Fitted
    rows: tuple[Row, ...]
    """The best first."""

    @property
    def best(self) -> Row | None:
        """The one that passed and is accepted."""
        return next((r for r in self.rows if r.status is Status.ACCEPTED), None)

    @property
    def rivals(self) -> tuple[Row, ...]:
        """Those that do as well."""
        return tuple(r for r in self.rows if r.status is Status.TIED)


def excess(loss: float, count: int) -> float:
    """What a sum of squares has beyond noise."""
    return max(loss - count, 0.0)


def is_quiet(loss: float, count: int) -> bool:
    """Whether a sum of ``count`` squares is no larger than that of noise, with six deviations and 4 % of room."""
    return bool(loss < count + 6 * np.sqrt(2 * count) + 0.04 * count)


def contest(
    evidence: Evidence, folds: Folds, before: Fitted, effects: Sequence[JointEffect], reference: float
) -> Round:
    """Every effect beside ``before``; ``reference`` is the excess that shares are of."""
    count = len(folds.masks[0])
    trials = list[Trial]()
    for e in sorted(effects, key=lambda e: not e.leads):
        if e.leads or _wanted(e.family, trials, before, count):
            trials.append(attempt(evidence, before, e))
    top = min((t.fitted.loss for t in trials if t.fitted is not None), default=np.inf)
    good = excess(before.loss, count)

    def near(loss: float, best: float) -> bool:
        return good > 0 and before.loss - loss > _NEAR * (before.loss - best)

    rows = []
    for t in trials:
        if t.fitted is None:
            status = Status.UNPHYSICAL if t.reason == SIGN else Status.REJECTED
            rows.append(Row(t.effect, None, 0.0, (), status, t.reason))
        elif not near(t.fitted.loss, top) and excess(t.fitted.loss, count) > 0.5 * good:
            share = (before.loss - t.fitted.loss) / max(good, 1e-300)
            rows.append(
                Row(t.effect, t.fitted, share, (), Status.REJECTED, "explains less than half of the excess in sample")
            )
        else:
            rows.append(_judged(evidence, folds, before, t.effect, t.fitted, t.harmonic, reference))
    return Round(before, tuple(_ranked(rows, count)))


def _wanted(family: str, trials: Sequence[Trial], before: Fitted, count: int) -> bool:
    """Whether a further member may change the answer: all that nothing speaks against miss something, and the members
    before it explain a good part of what the best of them does."""
    done = [(t.effect.family, t.fitted.loss) for t in trials if t.fitted is not None and not t.harmonic]
    own = min((loss for name, loss in done if name == family), default=np.inf)
    top = min((loss for _, loss in done), default=np.inf)
    left, there = excess(top, count), excess(before.loss, count)
    missed = top > CLEAN * count or (not is_quiet(top, count) and left > (1 - NAMED_FROM) * there)
    return missed and before.loss - own > _PART * (before.loss - top)


def _judged(
    evidence: Evidence,
    folds: Folds,
    before: Fitted,
    effect: JointEffect,
    found: Fitted,
    harmonic: str,
    reference: float,
) -> Row:
    """One effect on what was left out."""
    whole = with_folds(evidence, folds, found)
    gains = before.per_fold - whole.per_fold
    sizes = np.array([np.count_nonzero(m) for m in folds.masks])
    share = (excess(before.held_out, int(sizes.sum())) - excess(whole.held_out, int(sizes.sum()))) / max(
        reference, 1e-300
    )
    reached = np.maximum(before.per_fold - sizes, 0) > _SHARE * max(
        np.sum(np.maximum(before.per_fold - sizes, 0)), 1e-300
    )
    reason = ""
    if share < LEAST and reference == excess(before.held_out, int(sizes.sum())):
        reason = "removes too little on levels left out"
    elif np.any(gains[reached] <= 0):
        reason = "does not help every level that was left out"
    elif harmonic:
        reason = harmonic
    status = Status.REJECTED if reason else Status.ACCEPTED
    return Row(effect, whole, float(share), tuple(gains.tolist()), status, reason)


def _ranked(rows: Sequence[Row], count: int) -> list[Row]:
    """The best that passed is accepted, what does as well is tied, the rest refused."""
    passed = [r for r in rows if r.status is Status.ACCEPTED and r.fitted is not None]
    rest = sorted((r for r in rows if r.status is not Status.ACCEPTED), key=lambda r: -r.share)
    if not passed:
        return rest
    lowest = min(held_out(r) for r in passed)
    alike = [r for r in passed if held_out(r) <= max(ALIKE * lowest, CLEAN * count)]
    # An uneven spring that does as well as an even one has shown itself in no second harmonic.
    alike.sort(key=lambda r: (numbers(r), r.effect.family == "quadratic", held_out(r)))
    first = _member(alike, count)
    out = [first]
    for r in sorted(passed, key=held_out):
        if r is first:
            continue
        tied = any(r is one for one in alike)
        if tied and r.effect.family in {one.effect.family for one in out}:
            alone = r.effect.family == first.effect.family and held_out(r) > ALIKE * held_out(first)
            better = "leaves less" if alone else "does as well"
            out.append(replace(r, status=Status.REJECTED, reason=f"a member of the same family {better}"))
        elif tied:
            out.append(replace(r, status=Status.TIED, reason="does as well"))
        else:
            out.append(replace(r, status=Status.REJECTED, reason="passes, but leaves more than the best"))
    return [*out, *rest]


def _member(alike: Sequence[Row], count: int) -> Row:
    """Of the family of the simplest effect the simplest member that leaves noise, or hardly more than the best one."""
    own = [r for r in alike if r.effect.family == alike[0].effect.family]
    lowest = min(held_out(r) for r in own)
    return next(r for r in own if held_out(r) <= ALIKE * lowest or is_quiet(held_out(r), count))


def held_out(r: Row) -> float:
    """Σ r² of a row on what was left out; infinite where this was not worked out."""
    return r.fitted.held_out if r.fitted is not None and len(r.fitted.per_fold) else np.inf


def numbers(r: Row) -> int:
    """Parameters of the joint with an effect."""
    return 99 if r.fitted is None else len(r.fitted.joint.parameters)
