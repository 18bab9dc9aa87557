"""An offset that every record has for itself, as a nuisance: where its zero was, or what came before it."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array
from jointlib.loop.path.acceptance import SHARE
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import Fitted, fit
from jointlib.loop.path.steps import deciding_excess, is_quiet

_ONE_WAY = 0.5
"""Of its way, that a record ends away from where it began; the mean force of a motion one way is its friction."""


def with_own_offsets(start: Fitted) -> Evidence | None:
    """The evidence of a fitted model with an offset for each record, where that removes as much as an effect has to.

    A contact that was loaded from zero, or a load cell that was set to zero anew, shows so. Never where a record
    moves one way, nor of records that are about as quiet as their noise.
    """
    evidence = start.evidence
    if len(evidence.recorded) < 2 or is_quiet(start) or any(_one_way(run.path.velocity) for run in evidence.recorded):
        return None
    own = evidence.with_own_offsets()
    less = deciding_excess(fit(own, Model(start.joint))) < (1 - SHARE) * deciding_excess(start)
    return own if less else None


def _one_way(velocity: Array) -> bool:
    return bool(abs(np.mean(velocity)) > _ONE_WAY * np.mean(np.abs(velocity)))


def said(fitted: Fitted) -> str:
    """That every record has its own offset, in a sentence; nothing where they have one."""
    if not fitted.evidence.own_offsets:
        return ""
    found = fitted.evidence.offsets(fitted.joint)
    return (
        f"Each record is fitted with an offset of its own, from {found.min():.3g} to {found.max():.3g} N: its zero, or "
        "what the joint bore before."
    )
