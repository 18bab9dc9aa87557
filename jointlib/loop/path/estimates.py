"""Parameters with their errors: of a step of the search, of a candidate, of the chosen effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from jointlib.loop.contestant import moved_by
from jointlib.loop.path.contest import Entry
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.search import Row, Term
from jointlib.loop.path.trials import Effect, Trial
from jointlib.loop.report import Candidate, Estimate
from jointlib.path_fault import PathFault

_MODEL_FORM = frozenset({"hysteresis"})
"""Families of which a member stands for the class."""


def estimates(fitted: Fitted) -> dict[str, Estimate]:
    """Mass, offset, parameters of faults and every joint parameter of a fitted model; one that was not free has no
    standard error."""
    units = {"mass": "kg", "offset": "N", **fitted.joint.units}
    values = dict(zip(fitted.names, fitted.plant, strict=False))
    for known in fitted.model.faults:
        prefix = known.fault.family.replace("-", "_")
        for name, value in known.parameters.items():
            values[f"{prefix}.{name}"] = value
            units[f"{prefix}.{name}"] = known.fault.parameters[name].replace("channel", "N")
    values |= fitted.joint.parameters
    return {name: _estimate(fitted, name, value, units[name]) for name, value in values.items()}


def _estimate(fitted: Fitted, name: str, value: float, unit: str) -> Estimate:
    error = fitted.standard_error(name)
    wide = name in fitted.names and fitted.widened[fitted.names.index(name)]
    return Estimate(value, unit, error, (value - 1.96 * error, value + 1.96 * error), "model_form" if wide else "noise")


def candidate_of(row: Row, rank: int, current: Fitted) -> Candidate:
    """An effect as it fared beside the current model."""
    found = row.assessment
    return Candidate(
        family=row.entry.family,
        member=row.entry.member,
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


def chosen_of(row: Row, term: Term, fitted: Fitted, current: Fitted, explained: float, channel: str) -> Candidate:
    """The first term with its refitted parameters; ``channel`` is that of the force."""
    known = estimates(fitted)
    parameters = {n: known[n] for n in _names(term.effect, term.trial, current) if n in known}
    if row.entry.family in _MODEL_FORM:
        parameters = {n: replace(e, ci_kind="model_form") for n, e in parameters.items()}
    where = channel if isinstance(term.effect, PathFault) else None
    candidate = candidate_of(row, 1, current)
    return replace(candidate, parameters=parameters, explained=explained, channel=where)


def _names(effect: Effect, trial: Trial, current: Fitted) -> tuple[str, ...]:
    """Parameters of the mended model that an effect sets."""
    if isinstance(effect, PathFault):
        return tuple(f"{effect.family.replace('-', '_')}.{name}" for name in effect.parameters)
    return moved_by(effect, trial.coefficients, trial.shape, current.joint)


def _parameters(entry: Entry, current: Fitted) -> Mapping[str, Estimate]:
    """What the effect would add, at the linear fit; errors come with a refit only."""
    nan = float("nan")
    model = entry.best.model
    if model is None:
        values = {f"coefficient_{i}": float(c) for i, c in enumerate(entry.best.coefficients)} | dict(entry.best.shape)
        return {n: Estimate(float(v), "", nan, (nan, nan)) for n, v in values.items()}
    if isinstance(entry.effect, PathFault):
        known = model.faults[-1]
        units = {n: u.replace("channel", "N") for n, u in entry.effect.parameters.items()}
        prefix = entry.family.replace("-", "_")
        return {f"{prefix}.{n}": Estimate(v, units[n], nan, (nan, nan)) for n, v in known.parameters.items()}
    have, units = model.joint.parameters, model.joint.units
    names = [n for n in have if n not in current.joint.parameters]
    names = names or list(_names(entry.effect, entry.best, current))
    return {n: Estimate(have[n], units[n], nan, (nan, nan)) for n in names if n in have}
