"""What a search for compositions works with: the records, the joint, the catalogue; and how a model is refitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from jointlib.joint import Joint
from jointlib.loop.path.columns import ColumnStore
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, drives, fit
from jointlib.loop.path.steps import Row, Term, rank
from jointlib.loop.path.trials import Effect, trials_of
from jointlib.parameter import Role, parameters_of


@dataclass(frozen=True)
class Field:
    """What a search has to do with."""

    evidence: Evidence
    joint: Joint
    effects: tuple[Effect, ...]
    store: ColumnStore
    seed: int
    quick: bool = True
    """Whether fits end early, as they may where many compositions are compared."""

    def fit(self, model: Model, terms: int = 1) -> Fitted:
        """A model refitted; with several terms corners are rounded anew, as the first was where others were missing."""
        corners = terms > 1 and any(p.role is Role.SMOOTHING for law in model.joint.laws for p in parameters_of(law))
        return fit(self.evidence, model, quick=self.quick, rounding=corners)

    def rank(self, current: Fitted) -> tuple[Row, ...]:
        return rank(current, self.effects, self.store, self.seed)

    def replayed(self, terms: Sequence[Term], of: Model) -> Fitted | None:
        """The baseline with some of the terms of a model, refitted; None where one is not physical without the others.

        A fault of the force begins as the model has it: to first order a late force may be none without the others.
        Corners are rounded anew as they were in the model.
        """
        fitted = fit(self.evidence, Model(self.joint))
        for count, term in enumerate(terms, 1):
            rounding = count if count == len(terms) else 1
            known = [k for k in of.faults if k.fault is term.effect]
            if known:
                fitted = self.fit(replace(fitted.model, faults=(*fitted.model.faults, *known)), rounding)
                if drives(fitted):
                    return None
                continue
            found = trials_of(term.effect, [term.trial.shape], fitted, self.store)
            if not found or found[0].model is None:
                return None
            fitted = self.fit(found[0].model, rounding)
        return fitted
