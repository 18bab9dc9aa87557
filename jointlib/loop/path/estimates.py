"""Parameters with their errors: of a step of the search, of a candidate, of the chosen effect."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jointlib.loop.fitted import moved_by
from jointlib.loop.path.contest import Entry
from jointlib.loop.path.evidence import Fitted
from jointlib.loop.path.search import Row, Term
from jointlib.loop.report import Candidate, Estimate

_MODEL_FORM = frozenset({"hysteresis"})
"""Families of which a member stands for the class."""


def estimates(fitted: Fitted) -> dict[str, Estimate]:
    """Mass, offset and every joint parameter of a fitted model; one that was not free has no standard error."""
    units = {"mass": "kg", "offset": "N", **fitted.joint.units}
    n = len(fitted.plant)
    values = dict(zip(fitted.names[:n], fitted.plant, strict=True)) | fitted.joint.parameters
    return {name: _estimate(fitted, name, value, units[name]) for name, value in values.items()}


def _estimate(fitted: Fitted, name: str, value: float, unit: str) -> Estimate:
    error = fitted.standard_error(name)
    wide = name in fitted.names and fitted.widened[fitted.names.index(name)]
    return Estimate(value, unit, error, (value - 1.96 * error, value + 1.96 * error), "model_form" if wide else "noise")


def candidate_of(row: Row, rank: int, current: Fitted) -> Candidate:
    """A family as it fared beside the current model."""
    found = row.assessment
    return Candidate(
        family=row.entry.effect.family,
        member=row.entry.effect.member,
        parameters=_parameters(row.entry, current),
        gain_heldout=found.gain,
        per_fold=found.per_fold,
        significance={"p_signflip": found.chance},
        share_of_current=found.share,
        explained=found.share,
        rank=rank,
        status=row.status,
        reason=row.reason,
    )


def chosen_of(row: Row, term: Term, fitted: Fitted, current: Fitted, explained: float) -> Candidate:
    """The first term with its refitted parameters."""
    candidate = candidate_of(row, 1, current)
    known = estimates(fitted)
    parameters = {n: known[n] for n in _names(term.trial.coefficients, row.entry, current) if n in known}
    if row.entry.effect.family in _MODEL_FORM:
        parameters = {
            n: Estimate(e.value, e.unit, e.standard_error, e.ci95, "model_form") for n, e in parameters.items()
        }
    return Candidate(
        **{
            **{k: getattr(candidate, k) for k in candidate.__dataclass_fields__},
            "parameters": parameters,
            "explained": explained,
        }
    )


def _names(coefficients: np.ndarray, entry: Entry, current: Fitted) -> tuple[str, ...]:
    return moved_by(entry.effect, coefficients, entry.best.shape, current.joint)


def _parameters(entry: Entry, current: Fitted) -> Mapping[str, Estimate]:
    """What the effect would add, at the linear fit; errors come with a refit only."""
    nan = float("nan")
    if entry.best.joint is None:
        values = {f"coefficient_{i}": float(c) for i, c in enumerate(entry.best.coefficients)} | dict(entry.best.shape)
        return {n: Estimate(float(v), "", nan, (nan, nan)) for n, v in values.items()}
    have, units = entry.best.joint.parameters, entry.best.joint.units
    names = [n for n in have if n not in current.joint.parameters]
    names = names or list(_names(entry.best.coefficients, entry, current))
    return {n: Estimate(have[n], units[n], nan, (nan, nan)) for n in names}
