"""Rows of the report: candidates and the chosen effect with its parameters and their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.answer.naming import with_sizes
from jointlib.loop.answer.report import Candidate, Estimate, Status
from jointlib.loop.balance.bodies import Rig
from jointlib.loop.balance.ceiling import ceiling
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.excess import largest_lines, total_excess
from jointlib.loop.balance.spectra import Spectra
from jointlib.loop.contest.contestant import Contestant, InJoint, InRig, channel_unit, fault_estimates
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.contest.on_input import OnInput
from jointlib.loop.contest.rounds import Round, Row
from jointlib.loop.contest.search import Term, adds, explained
from jointlib.loop.periodic.whereabouts import by_amplitude, by_time
from jointlib.modulation import factors_of

_MODEL_FORM = frozenset({"hysteresis"})
"""Families of which a member stands for the class: the shape of the law is a larger doubt than the noise."""
_BIASED = frozenset({"quadratic"})
"""The mean of z is not seen by accelerometers, which biases a stiffness between the directions by a few per cent."""


def candidate_of(round: Round, row: Row, rank: int) -> Candidate:
    """A family as it fared in a round."""
    s, c = row.score, row.contestant
    current = max(round.held_out_excess, 1e-300)
    channel, body = place_of(c, round.fitted.raws[0].rig)
    return Candidate(
        family=c.effect.family,
        member=member_of(c),
        parameters=c.parameters(s.best.coefficients, s.best.shape, round.fitted),
        gain_heldout=s.gain,
        per_fold=s.per_fold,
        significance={"z": float(s.z), "bic": float(s.bic)},
        share_of_current=s.gain / current,
        explained=None,
        rank=rank,
        status=row.status,
        reason=row.reason,
        channel=channel,
        body=body,
    )


def member_of(c: Contestant) -> str:
    """The law that an effect adds; a fault is its own member."""
    return c.joint_effect.member if isinstance(c, InJoint) else c.effect.family


def place_of(c: Contestant, rig: Rig) -> tuple[str | None, str | None]:
    """Channel and body of a fault; a body is named after what its accelerometer sits on."""
    if not isinstance(c, InRig) or not c.site:
        return None, None
    return (None, rig.bodies.get(c.site, c.site)) if c.fault.on == "body" else (c.site, None)


def chosen_of(last: Fitted, term: Term, explained: float | None) -> Candidate:
    """The chosen effect with the parameters of the refitted model.

    Standard errors are those of the fit, (Re XᴴX)⁻¹/2·max(1, χ²), or the spread over fits with one record left
    out (jackknife), whichever is larger.
    """
    rank = next(i for i, r in enumerate(term.round.rows) if r.label == term.row.label) + 1
    linear = candidate_of(term.round, term.row, rank)
    estimates = next((e for f in (last, term.fitted) for of in (_of_fault, _of_input) if (e := of(f, term))), None)
    if estimates is None:
        brought = set(term.fitted.free) - term.round.fitted.joint.parameters.keys()
        names = [n for n in term.fitted.joint.parameters if n in brought or n in linear.parameters]
        where = last if set(names) <= set(last.joint.parameters) else term.fitted
        estimates = _of_joint(where, names, linear.family)
    return replace(linear, parameters=estimates, explained=explained, status=Status.ACCEPTED, reason="")


def composition(start: Fitted, terms: Sequence[Term], last: Fitted) -> tuple[dict[str, Any], ...]:
    """Effects that are named together, in the order of their entry, and what each is worth in the whole.

    ``share`` of the excess that it removed when it came; ``adds``, the share of what all the others leave without it;
    ``explained`` by it and those before it; ``per_fold``, what it adds on each record left out; ``words``, what it is
    with its sizes.
    """
    rows, before = [], start
    for term in terms:
        c = chosen_of(last, term, None)
        assert term.beside is not None
        assert term.beside.winner is not None
        rows.append(
            {
                "family": c.family,
                "member": c.member,
                "share": explained(before, term.fitted),
                "explained": explained(start, term.fitted),
                "adds": adds(term, terms),
                "per_fold": term.beside.winner.score.per_fold,
                "rivals": [member_of(r.contestant) for r in term.beside.rivals],
                "parameters": c.parameters,
                "words": with_sizes(c, last.joint),
            }
        )
        before = term.fitted
    return tuple(rows)


def _of_fault(fitted: Fitted, term: Term) -> dict[str, Estimate] | None:
    for found, errors in zip(fitted.found, fitted.errors, strict=False):
        if found.label == term.row.label:
            return fault_estimates(found, errors, channel_unit(found.site))
    return None


def _of_input(fitted: Fitted, term: Term) -> dict[str, Estimate] | None:
    if not isinstance(term.row.contestant, OnInput):
        return None
    effect, spread = term.row.contestant.joint_effect, jackknife(fitted)
    for m in fitted.joint.modulations:
        if (m.role, m.condition) == (effect.role, effect.condition):
            errors = {n: max(e, spread.get(n, 0.0)) for n, e in fitted.followed_errors.items()}
            return {
                n: Estimate(v, effect.unit, e, (v - 1.96 * e, v + 1.96 * e))
                for n, v in factors_of(m).items()
                for e in (errors.get(n, float("nan")),)
            }
    return None


def _of_joint(fitted: Fitted, names: Sequence[str], family: str) -> dict[str, Estimate]:
    joint = widened(fitted)
    values, units = joint.parameters, joint.units
    estimates = {}
    for name in names:
        se = joint.covariance.standard_error(name) if joint.covariance is not None else float("nan")
        value = values[name]
        kind = "model_form" if family in _MODEL_FORM else "noise"
        interval = (value - 1.96 * se, value + 1.96 * se)
        estimates[name] = Estimate(value, units[name], se, interval, kind, family in _BIASED)
    return estimates


def widened(fitted: Fitted) -> Joint:
    """The fitted joint, its standard errors no smaller than the spread over fits with one record left out."""
    joint = fitted.joint
    if joint.covariance is None:
        return joint
    return replace(joint, covariance=joint.covariance.widened(jackknife(fitted)))


def jackknife(fitted: Fitted) -> dict[str, float]:
    """Standard error of each free joint parameter, and of coefficients of its modulations, from linearised fits with
    one record left out in turn."""
    model, R = fitted.model, len(fitted.raws)
    names = (*fitted.free, *fitted.followed)
    if R < 2 or not names:
        return {}
    size = np.linalg.norm(model.columns, axis=1)
    moving = size > 0
    size = size[moving]
    X = model.columns[moving] / size[:, None]
    gram = np.array([X[:, s] @ X[:, s].T for s in model.records])
    moment = np.array([X[:, s] @ model.y[s] for s in model.records])
    moves = []
    for h in range(R):
        others = [r for r in range(R) if r != h]
        G, b = gram[others].sum(axis=0), moment[others].sum(axis=0)
        moves.append(np.linalg.lstsq(G, b, rcond=1e-13)[0] / size)
    deviation = np.array(moves) - np.mean(moves, axis=0)
    spread = np.sqrt((R - 1) / R * np.sum(deviation**2, axis=0))
    at = dict(zip(np.flatnonzero(moving).tolist(), spread.tolist(), strict=True))
    return {name: at[i] for i, name in enumerate(names) if i in at}


def described(s: Spectra) -> dict[str, Any]:
    """What a record is."""
    return {"id": s.name, "condition": s.condition, "level": s.condition, "periods": s.periods, "samples": s.samples}


def floor_table(observed: Sequence[Observed], before: Mapping[str, Any]) -> dict[str, Any]:
    """The floors of the residuals and where they come from."""
    ratios = [r for o in observed for r in o.floor.ratio.values()]
    return {
        "joint_N": before["joint_floor_N"],
        "balance_N": before.get("balance_floor_N"),
        "redundancy_ms2": before.get("redundancy_floor_ms2"),
        "source": "quiet" if any(o.floor.source == "quiet" for o in observed) else "between_lines",
        "quiet_ratio": max(ratios) if ratios else None,
        "nonperiodic_effect": any(r > 1.5 for r in ratios),
    }


def removed(before: float, after: float) -> float | None:
    """Share of the excess that is gone; None where there was none."""
    return 1 - after / before if before > 0 else None


def left(table: Mapping[str, Mapping[str, Any]], before: float, last: Fitted) -> dict[str, Any]:
    """What is left after mending: its share, where it sits, the lines that stand out, and the ceiling.

    The ceiling is the share of the joint's excess that a flexible fit of motion would take: much of it means that
    the catalogue lacks an effect, little that noise or another kind of disturbance is left. It names nothing.
    """
    cells = [
        (cell["excess"] - cell["threshold"], equation, name)
        for equation, row in table.items()
        for name, cell in row.items()
    ]
    most = max(cells, default=(0.0, "", ""))
    left = total_excess(table)
    whitened = last.whitened()
    return {
        "fraction": left / before if before > 0 else 0.0,
        "equation": most[1] if most[0] > 0 else None,
        "line_class": most[2] if most[0] > 0 else None,
        "largest_lines": largest_lines(last.records, whitened),
        "by_amplitude": by_amplitude(last.records, [o.residuals(last.joint) for o in last.records]),
        "by_time": by_time(last.layout, whitened, last.raws[0].spectra.sample_rate),
        "ceiling": ceiling(last.records, whitened) if total_excess(table, "joint") > 0 else None,
    }
