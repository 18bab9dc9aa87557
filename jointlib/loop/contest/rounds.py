"""One round of the search: every contestant against one model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

from jointlib.arrays import Array
from jointlib.fault import Shape
from jointlib.loop.answer.naming import NAMED_FROM
from jointlib.loop.answer.report import Status
from jointlib.loop.contest.contestant import Contestant, InJoint, InRig, tried
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.contest.model import Model, prediction_error
from jointlib.loop.contest.rivals import Score, refined, rivals_of, score, simplest_of_ties
from jointlib.loop.contest.trial import Trial, prediction

_REFINED = 6
WORTH_REFINING = 2.0
"""z of a held-out gain that is more than noise."""
WORSENS = "makes a left-out record worse"
_FORM = 10.0
_PROMISING = 0.3
"""Of the excess: where the best of all explains less, no further member of its family will explain half of it."""
_MOST = 0.5
"""Of the excess in balance and redundancy."""
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


class _Contest:
    """One round: trials of every contestant against one model."""

    def __init__(self, fitted: Fitted, field: Sequence[Contestant], least_gain: float, chosen: str | None) -> None:
        self.fitted, self.field, self.least_gain, self.chosen = fitted, field, least_gain, chosen
        self.model = fitted.model
        self.families = len({c.label for c in field})
        self.predictions: dict[int, Array] = {}

    def trials(self, c: Contestant, shapes: Sequence[Shape], physical: bool = False) -> tuple[Trial, ...]:
        """The contestant at each shape that the model cannot imitate."""
        found = tried(c, self.fitted, shapes)
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
            reason = WORSENS
        elif s.gain < self.least_gain and not self._closes_an_equation(c, s):
            reason = "less than a twentieth of the first term's gain"
        else:
            reason = ""
        return Row(c, s, Status.REJECTED, reason)

    def _closes_an_equation(self, c: Contestant, s: Score) -> bool:
        """A fault that explains most of what is left in balance and redundancy, however large the first term was."""
        return is_outside_joint(c) and 0 < _MOST * self.model.excess_outside_joint < s.gain

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
            found = self.trials(c, c.shapes(self.fitted))
            if not found:
                return
            physical = tuple(t for t in found if self.admissible(c, t))
            row = self.judged(c, physical or found, bool(physical))
            known = rows.get(c.label)
            if known is None or (row.status is not Status.UNPHYSICAL, row.score.gain) > (
                known.status is not Status.UNPHYSICAL,
                known.score.gain,
            ):
                rows[c.label], pools[c.label] = row, physical

        for c in self.field:
            (enter if _leads(c) else later.append)(c)
        leader = max((r.score.gain for r in rows.values()), default=0.0)
        near = {label for label, r in rows.items() if r.score.gain > _NEAR * leader and r.score.z > WORTH_REFINING}
        near -= self._present()
        if leader < _PROMISING * (self.model.loss - self.model.entries):
            near = set()
        for c in later:
            if c.label in near:
                enter(c)
        order = sorted(rows.values(), key=lambda r: -r.score.gain)
        worth = [r for r in order if r.status is not Status.UNPHYSICAL and r.score.z > WORTH_REFINING]
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


def is_outside_joint(c: Contestant) -> bool:
    """True for what is wrong with a sensor, a body or the rig."""
    return isinstance(c, InRig) and c.fault.on != "joint"


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
