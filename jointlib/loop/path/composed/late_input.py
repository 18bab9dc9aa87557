"""Whether parameters follow their input late, judged at the moments at which that shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.acceptance import assess
from jointlib.loop.path.composed.choice import stands
from jointlib.loop.path.composed.field import Field
from jointlib.loop.path.composed.input_lag import InputLag
from jointlib.loop.path.fitted import fit
from jointlib.loop.path.regression import Index
from jointlib.loop.path.steps import Composition, Part, Step, Term
from jointlib.loop.path.trials import shapes_of, trials_of

_ACTS = 0.1
"""Of the largest force that a lag takes from the model, from which on it acts."""
_FEWEST_STEPS = 2.0
"""Samples of the record; a shorter lag may be in how the input was sampled."""


def with_late_inputs(field: Field, best: Composition, parts: Sequence[Part]) -> tuple[Composition, tuple[Part, ...]]:
    """A composition in which parameters follow an input, with the lag of that input where it is shown.

    After a step of the input a lag acts for a few times its length and nowhere else, so that it removes little of all
    that is left. It is part of how the parameters follow, and no further effect: it passes the tests of one where it
    acts, and has to be told from none and from two samples.
    """
    for effect in (e for e in field.effects if isinstance(e, InputLag)):
        current = best.fitted
        evidence = current.evidence
        tried = [t for t in trials_of(effect, shapes_of(effect, current), current, field.store) if t.model is not None]
        if not tried:
            continue
        trial = min(tried, key=lambda t: t.training)
        assert trial.model is not None
        fitted = fit(field.evidence, trial.model, quick=True)
        acts = np.abs(effect.along(evidence, trial.shape, current.joint)[0])
        where = [rows[acts[rows] > _ACTS * acts.max()] for rows in evidence.rows]
        seen = [b for b, rows in enumerate(where) if len(rows)]
        floor, folds = evidence.floor.power / evidence.block_power, evidence.deciding_folds
        power, own_rows = evidence.block_power[seen], [where[b] for b in seen]
        before, after = (_local(r, own_rows) / power for r in (current.residual, fitted.residual))
        number = np.unique(folds[seen], return_inverse=True)[1]
        local = assess(before, after, floor[seen], number, field.seed)
        own = assess(current.deciding_loss, fitted.deciding_loss, floor, folds, field.seed)
        term = Term(effect, trial, own)
        late = Composition((*best.steps, Step(term, fitted)), (*best.terms, term))
        lag = max(m.lag for m in fitted.joint.modulations if m.condition == effect.condition)
        if local.accepted and stands(late, term) and lag > _FEWEST_STEPS * evidence.runs[0].path.time_step:
            best, parts = late, (*parts, Part(term, own, ()))
    return best, tuple(parts)


def _local(residual: Array, where: Sequence[Index]) -> Array:
    """Mean square in some samples of every block, N²."""
    return np.array([float(np.mean(residual[rows] ** 2)) for rows in where])
