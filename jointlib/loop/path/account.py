"""The tables of a path trace: what was read, its floor, every step of the search, what is left."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from jointlib.loop.path import judgement
from jointlib.loop.path.estimates import estimates, set_by
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.steps import Finding, Step, deciding_excess, is_rival
from jointlib.loop.path.words import named
from jointlib.measurement import Measurement, Record


def data(
    measurement: Measurement,
    evidence: Evidence,
    records: Sequence[Record],
    sealed: Sequence[Record],
    spent: Sequence[str],
) -> dict[str, Any]:
    """The records, how they were prepared and cut up."""
    division, preparation = evidence.division, evidence.recorded[0].preparation
    strokes = all(b.is_stroke for b in division.blocks)
    whole = len(division.blocks) == len(records) >= 8
    return {
        "records": [{"id": r.name, "condition": r.source.condition, "samples": len(r)} for r in records],
        "sealed": [r.name for r in sealed] or None,
        "sealed_spent": list(spent),
        "sha256": {r.name: r.sha256 for r in (*records, *sealed)},
        "simulated": measurement.simulated,
        "preparation": dataclasses.asdict(preparation) | {"filter": preparation.filter},
        "conditions": {
            "grouped_by": division.grouped_by,
            "found": {n: sum(b.condition == n for b in division.blocks) for n in division.conditions},
        },
        "blocks": len(division.blocks),
        "block_kind": "strokes" if strokes else "records" if whole else "pieces",
    }


def floor(evidence: Evidence) -> dict[str, Any]:
    """Noise over rms of F, per record."""
    relative = np.sqrt(evidence.floor.power / evidence.block_power)
    owner = np.array([b.run for b in evidence.division.blocks])
    known = evidence.floor.known
    per_record = {
        run.name: float(np.sqrt(np.mean(relative[owner == i] ** 2))) if known and np.any(owner == i) else None
        for i, run in enumerate(evidence.runs)
    }
    return {"force_rel_per_record": per_record, "source": evidence.floor.source}


def overall_floor(evidence: Evidence) -> float | None:
    """Noise over rms of F over all blocks; None where unknown."""
    return float(np.sqrt(np.mean(evidence.floor.power / evidence.block_power))) if evidence.floor.known else None


def further(found: Finding, status: str) -> tuple[dict[str, Any], ...]:
    """Terms after the first, with the share of the excess each found when it came."""
    return tuple(
        {
            "family": t.family,
            "member": t.member,
            "share": t.assessment.share,
            "p_signflip": t.assessment.chance,
            "status": status,
        }
        for t in found.terms[1:]
    )


def composition(found: Finding) -> tuple[dict[str, Any], ...]:
    """The terms of the best composition in the order of their entry, and what each is worth in the whole.

    ``share`` of the excess that it removed when it came; ``adds``, the share of what all the others leave without it;
    ``explained`` by it and those before it; ``per_fold``, what it adds on each fold that was left out; ``words``, what
    it is with its sizes.
    """
    total, rows = deciding_excess(found.before), []
    entered = {id(s.term): 1 - deciding_excess(s.fitted) / total for s in found.steps if s.term}
    for part in found.parts:
        term = part.term
        sizes = set_by(term, found.after, found.before)
        rows.append(
            {
                "family": term.family,
                "member": term.member,
                "share": term.assessment.share,
                "explained": entered.get(id(term)),
                "adds": part.adds.share,
                "per_fold": part.adds.per_fold,
                "p_signflip": part.adds.chance,
                "rivals": [r.entry.member for r in part.rows if is_rival(r)],
                "parameters": sizes,
                "words": named(term.effect, sizes, found.after.joint),
            }
        )
    return tuple(rows)


def compositions(found: Finding) -> list[dict[str, Any]]:
    """The best composition and those that were followed beside it, best first."""
    total = deciding_excess(found.before)
    return [
        {"members": [t.member for t in c.terms], "explained": 1 - deciding_excess(c.fitted) / total}
        for c in (found.best, *found.others)
        if c.terms
    ]


def reduction(found: Finding, after: Fitted) -> dict[str, Any]:
    """How far the excess went down, and how: step by step with the contest that followed each."""
    total, left = deciding_excess(found.before), deciding_excess(after)
    noise = overall_floor(after.evidence)
    return {
        "excess_removed": 1 - left / total if total > 0 else None,
        "rms_over_floor": float(np.sqrt(after.deciding_loss.mean())) / noise if noise else None,
        "steps": [_step(step, total) for step in found.steps],
        "compositions": compositions(found),
        "standard_errors": "blocks taken as independent, widened to the jackknife over condition folds",
    }


def _step(step: Step, total: float) -> dict[str, Any]:
    """One accepted step with its refitted parameters, its errors and the contest that followed."""
    shown = judgement.errors(step.fitted, None)
    return {
        "family": step.term.family if step.term else None,
        "member": step.term.member if step.term else None,
        "action": step.action if step.term else "baseline",
        "share": step.term.assessment.share if step.term else None,
        "explained": 1 - deciding_excess(step.fitted) / total if total > 0 else None,
        "in_sample": shown["in_sample"],
        "heldout_condition": shown["heldout_condition"],
        "heldout_block": shown["heldout_block"],
        "parameters": estimates(step.fitted),
        "next": [
            {
                "family": r.entry.family,
                "member": r.entry.member,
                "share": r.assessment.share,
                "p_signflip": r.assessment.chance,
                "status": r.status,
                "reason": r.reason,
            }
            for r in step.rows
        ],
    }


def unexplained(found: Finding, after: Fitted) -> dict[str, Any]:
    """What is left, and where it is largest."""
    total = deciding_excess(found.before)
    blocks = judgement.blocks(found.before, after)
    return {
        "fraction": deciding_excess(after) / total if total > 0 else 0.0,
        "equation": "joint",
        "blocks": sorted(blocks, key=lambda b: -b["error_after"])[:5],
        "ceiling": None,
    }
