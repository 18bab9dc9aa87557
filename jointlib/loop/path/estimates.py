"""Parameters with their errors: of a step of the search, of a candidate, of the chosen effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from jointlib.effect import JointEffect, Scale
from jointlib.joint import Joint
from jointlib.loop.answer.report import Candidate, Estimate
from jointlib.loop.contest.contestant import bare, moved_by
from jointlib.loop.path.composed.along_input import AlongInput
from jointlib.loop.path.contest import Entry
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.steps import Row, Term
from jointlib.loop.path.trials import Effect, Trial
from jointlib.modulation import factors_of, lag_name, lags_of
from jointlib.path_fault import PathFault

_MODEL_FORM = frozenset({"hysteresis"})
"""Families of which a member stands for the class."""


def estimates(fitted: Fitted) -> dict[str, Estimate]:
    """Mass, offset (where records have one in common), parameters of faults and every joint parameter of a fitted
    model; one that was not free has no standard error."""
    units = {"mass": "kg", "offset": "N", **fitted.joint.units}
    values = dict(zip(fitted.names, fitted.plant, strict=False))
    if fitted.evidence.own_offsets:
        del values["offset"]
    for known in fitted.model.faults:
        prefix = known.fault.family.replace("-", "_")
        for name, value in known.parameters.items():
            values[f"{prefix}.{name}"] = value
            units[f"{prefix}.{name}"] = known.fault.parameters[name].replace("channel", "N")
    for m in fitted.joint.modulations:
        steps = factors_of(m)
        values |= steps
        units |= dict.fromkeys(steps, "1")
    for condition, lag in lags_of(fitted.joint.modulations).items():
        values[lag_name(condition)], units[lag_name(condition)] = lag, "s"
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
        significance={"p_signflip": found.chance, "share_error": found.share_error},
        share_of_current=found.share,
        explained=found.share,
        rank=rank,
        status=row.status,
        reason=row.reason,
    )


def chosen_of(row: Row, term: Term, fitted: Fitted, current: Fitted, explained: float, channel: str) -> Candidate:
    """The first term with its refitted parameters; ``channel`` is that of the force."""
    parameters = set_by(term, fitted, current)
    if row.entry.family in _MODEL_FORM:
        parameters = {n: replace(e, ci_kind="model_form") for n, e in parameters.items()}
    where = channel if isinstance(term.effect, PathFault) else None
    candidate = candidate_of(row, 1, current)
    return replace(candidate, parameters=parameters, explained=explained, channel=where)


def set_by(term: Term, fitted: Fitted, current: Fitted) -> dict[str, Estimate]:
    """Parameters of the mended model that a term sets, refitted."""
    known = estimates(fitted)
    return {n: known[n] for n in _names(term.effect, term.trial, current) if n in known}


def _names(effect: Effect, trial: Trial, current: Fitted) -> tuple[str, ...]:
    """Parameters of the mended model that an effect sets."""
    if isinstance(effect, AlongInput):
        return tuple(effect.sizes(0 * trial.coefficients, trial.shape, current.joint))
    if isinstance(effect, PathFault):
        return tuple(f"{effect.family.replace('-', '_')}.{name}" for name in effect.parameters)
    return moved_by(effect, trial.coefficients, trial.shape, current.joint)


def _parameters(entry: Entry, current: Fitted) -> Mapping[str, Estimate]:
    """What the effect would add, at the linear fit; errors come with a refit only."""
    best, effect = entry.best, entry.effect
    if isinstance(effect, PathFault):
        found = effect.correction(best.coefficients, best.shape) or {}
        prefix = entry.family.replace("-", "_")
        return {f"{prefix}.{n}": bare(v, effect.parameters[n].replace("channel", "N")) for n, v in found.items()}
    if best.model is None:
        coefficients = {f"coefficient_{i}": bare(c, "") for i, c in enumerate(best.coefficients.tolist())}
        units = shape_units(effect, current.joint)
        return coefficients | {n: bare(v, units[n]) for n, v in best.shape.items()}
    if isinstance(effect, AlongInput):
        modulations = best.model.joint.modulations
        sizes = {n: v for m in modulations for n, v in factors_of(m).items()}
        sizes |= {lag_name(condition): lag for condition, lag in lags_of(modulations).items()}
        return {n: bare(sizes[n], effect.unit) for n in _names(effect, best, current) if n in sizes}
    have, units = best.model.joint.parameters, best.model.joint.units
    names = [n for n in have if n not in current.joint.parameters]
    names = names or list(_names(effect, best, current))
    return {n: bare(have[n], units[n]) for n in names if n in have}


def shape_units(effect: JointEffect, joint: Joint) -> dict[str, str]:
    """Units of the shape parameters, told by how their grid goes with the motion and its speed; else none."""
    once, longer, faster = (effect.shapes(Scale(z, v, 1.0), joint) for z, v in ((1.0, 1.0), (2.0, 1.0), (1.0, 2.0)))

    def unit(name: str) -> str:
        here, *others = (np.array([shape[name] for shape in grid]) for grid in (once, longer, faster))
        for word, powers in {"m": (1, 0), "m/s": (0, 1), "s": (1, -1)}.items():
            if all(np.allclose(there, 2.0**n * here, rtol=1e-9) for there, n in zip(others, powers, strict=True)):
                return word
        return ""

    return {name: unit(name) for name in once[0]}
