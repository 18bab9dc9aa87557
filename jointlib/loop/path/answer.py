"""From a search along a path to the report of the trace."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.naming import experiment, is_declared_pair
from jointlib.loop.path import judgement, words
from jointlib.loop.path.acceptance import CHANCE, SHARE, TIE
from jointlib.loop.path.estimates import candidate_of, chosen_of, estimates
from jointlib.loop.path.evidence import Evidence, Fitted, law_forces
from jointlib.loop.path.preparation import prepare
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.search import Finding, Step, deciding_excess, is_quiet, is_rival
from jointlib.loop.path.strokes import Division
from jointlib.loop.report import Rival, Status, TraceReport, Verdict
from jointlib.measurement import Measurement, Record


@dataclass(frozen=True)
class _Named:
    """What the search amounts to: the verdict, and the model that the joint is mended with."""

    verdict: Verdict
    explained: float | None
    rivals: tuple[Rival, ...]
    after: Fitted


def answer(
    measurement: Measurement, joint: Joint, records: Sequence[Record], evidence: Evidence, found: Finding, seed: int
) -> TraceReport:
    """Verdict, errors before and after, sealed records opened now, and the mended joint."""
    named = _named(evidence, found)
    entered = named.after is not found.before
    sealed_records = read_records(measurement, measurement.with_role("sealed"))
    warnings = words.warnings_of(
        evidence,
        [c.unit for c in measurement.channels],
        sorted({name for r in records for name in r.ignored}),
        measurement.simulated,
    )
    spent = [r.name for r in sealed_records if f"{r.name} sha256:{r.sha256}" in joint.provenance.get("seal_opened", [])]
    warnings += [f"The seal of {name} was opened in an earlier trace; it is spent." for name in spent]
    sealed = _sealed(measurement, evidence, sealed_records)
    before = judgement.errors(evidence, found.before, sealed)
    after = judgement.errors(evidence, named.after, sealed) if entered else before
    floor = float(np.sqrt(np.mean(evidence.floor.power / evidence.block_power))) if evidence.floor.known else None
    first = found.terms[0] if found.terms else None
    winner = next((r for r in found.rows if r.status is Status.ACCEPTED), None)
    chosen = None
    if first is not None and winner is not None:
        step = found.steps[1]
        chosen = chosen_of(winner, step.term or first, step.fitted, found.before, named.explained or 0.0)
    several = len(evidence.division.conditions) > 1
    is_named = named.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    further = _further(found, "accepted" if is_named else "hypothesis")
    effect = winner.entry.effect if winner else None
    what_next = words.next_experiment(named.verdict, named.rivals, effect, several)
    said = [f["family"] for f in further] if is_named else []
    text = words.sentence(named.verdict, chosen, named.rivals, said, before, after, floor)
    return TraceReport(
        route="path",
        verdict=named.verdict,
        sentence=f"{text} Next: {what_next}",
        baseline=found.before.joint,
        mended=_mended(joint, named, found, evidence, records, sealed_records) if entered else joint,
        chosen=chosen,
        candidates=tuple(candidate_of(row, i + 1, found.before) for i, row in enumerate(found.rows)),
        rivals=named.rivals,
        chain=further,
        secondary=further if is_named else (),
        error_before=before,
        error_after=after,
        data=_data(measurement, evidence, records, sealed_records, spent),
        noise_floor=_floor(evidence),
        localisation={"blocks": judgement.blocks(evidence, found.before, named.after)},
        reduction=_reduction(evidence, found, named, floor),
        resimulation={},
        unexplained=_unexplained(evidence, found, named),
        not_decidable=words.not_decidable(evidence),
        next_experiment=what_next,
        warnings=tuple(warnings),
        repro={
            "seed": seed,
            "version": version("jointlib"),
            "options": {"least_share": SHARE, "largest_chance": CHANCE, "tie": TIE},
        },
        extra_baseline={n: e for n, e in estimates(found.before).items() if n in ("mass", "offset")},
        plots=judgement.pictures(evidence, found.before, named.after),
    )


def _named(evidence: Evidence, found: Finding) -> _Named:
    explained = None
    if found.terms:
        total = deciding_excess(evidence, found.before)
        explained = 1 - deciding_excess(evidence, found.steps[1].fitted) / total
        swapped = {t.effect.family for t in found.terms}
        shares = [r.assessment.share for r in found.rows if r.entry.physical and r.entry.effect.family in swapped]
        if found.steps[1].term not in found.terms and shares:
            explained = max(shares)
    winner = next((r for r in found.rows if r.status is Status.ACCEPTED), None)
    rivals = tuple(
        Rival(
            family=r.entry.effect.family,
            gain_ratio=r.assessment.gain / winner.assessment.gain,
            declared_pair=is_declared_pair(r.entry.effect, winner.entry.effect),
            separating_experiment=experiment(winner.entry.effect, r.entry.effect),
        )
        for r in found.rows
        if winner is not None and is_rival(r)
    )
    quiet = is_quiet(found.before, evidence)
    verdict = words.verdict_of(explained, len(rivals), quiet, len(evidence.division.conditions) > 1)
    after = found.before
    if verdict is Verdict.PARTIAL:
        after = found.steps[1].fitted
    elif verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
        after = found.after
    return _Named(verdict, explained, rivals, after)


def _sealed(measurement: Measurement, evidence: Evidence, records: Sequence[Record]) -> Evidence | None:
    """Sealed records prepared like the others."""
    if not records:
        return None
    runs = tuple(prepare(measurement, r, evidence.runs[0].preparation) for r in records)
    nothing = PathFloor(np.zeros(0), "unknown", np.zeros(0, dtype=int))
    return Evidence(runs, evidence.carriage, Division((), "sealed"), nothing, law_forces(runs))


def _further(found: Finding, status: str) -> tuple[dict[str, Any], ...]:
    """Terms after the first, with the share of the excess each found when it came."""
    return tuple(
        {
            "family": t.effect.family,
            "member": t.effect.member,
            "share": t.assessment.share,
            "p_signflip": t.assessment.chance,
            "status": status,
        }
        for t in found.terms[1:]
    )


def _mended(
    joint: Joint,
    named: _Named,
    found: Finding,
    evidence: Evidence,
    records: Sequence[Record],
    sealed: Sequence[Record],
) -> Joint:
    """The joint with what was found, the range it was found on, and what it was found from."""
    paths = [run.path for run in evidence.runs]
    travels = [b.travel / 2 for b in evidence.division.blocks]
    speed = max(float(np.max(np.abs(p.velocity))) for p in paths)
    entered = found.terms if named.after is found.after else found.terms[:1]
    provenance = {
        **joint.provenance,
        "traced_on": [f"{r.name} sha256:{r.sha256}" for r in records],
        "effects": [t.effect.family for t in entered],
        "verdict": named.verdict.value,
        "program": f"jointlib {version('jointlib')}",
    }
    if sealed:
        opened = [*joint.provenance.get("seal_opened", []), *(f"{r.name} sha256:{r.sha256}" for r in sealed)]
        provenance["seal_opened"] = list(dict.fromkeys(opened))
    validity = {**joint.validity, "amplitude": (0.0, max(travels)), "velocity": (0.0, speed)}
    return dataclasses.replace(named.after.joint, validity=validity, provenance=provenance)


def _data(
    measurement: Measurement,
    evidence: Evidence,
    records: Sequence[Record],
    sealed: Sequence[Record],
    spent: Sequence[str],
) -> dict[str, Any]:
    division = evidence.division
    return {
        "records": [{"id": r.name, "condition": r.source.condition, "samples": len(r)} for r in records],
        "sealed": [r.name for r in sealed] or None,
        "sealed_spent": list(spent),
        "sha256": {r.name: r.sha256 for r in (*records, *sealed)},
        "simulated": measurement.simulated,
        "preparation": dataclasses.asdict(evidence.runs[0].preparation)
        | {"filter": "Butterworth order 4, forward and backward, on force and displacement alike"},
        "conditions": {
            "grouped_by": division.grouped_by,
            "found": {n: sum(b.condition == n for b in division.blocks) for n in division.conditions},
        },
        "blocks": len(division.blocks),
        "block_kind": "strokes" if all(b.is_stroke for b in division.blocks) else "pieces",
    }


def _floor(evidence: Evidence) -> dict[str, Any]:
    relative = np.sqrt(evidence.floor.power / evidence.block_power)
    owner = np.array([b.run for b in evidence.division.blocks])
    known = evidence.floor.known
    per_record = {
        run.name: float(np.sqrt(np.mean(relative[owner == i] ** 2))) if known and np.any(owner == i) else None
        for i, run in enumerate(evidence.runs)
    }
    return {"force_rel_per_record": per_record, "source": evidence.floor.source}


def _reduction(evidence: Evidence, found: Finding, named: _Named, floor: float | None) -> dict[str, Any]:
    total = deciding_excess(evidence, found.before)
    left = deciding_excess(evidence, named.after)
    rms = float(np.sqrt(named.after.deciding_loss.mean()))
    return {
        "excess_removed": 1 - left / total if total > 0 else None,
        "rms_over_floor": rms / floor if floor else None,
        "steps": [_step(evidence, found, step, total) for step in found.steps],
        "standard_errors": "blocks taken as independent, widened to the jackknife over condition folds",
    }


def _step(evidence: Evidence, found: Finding, step: Step, total: float) -> dict[str, Any]:
    """One accepted step with its refitted parameters, its errors and the contest that followed."""
    shown = judgement.errors(evidence, step.fitted, None)
    return {
        "family": step.term.effect.family if step.term else None,
        "action": step.action if step.term else "baseline",
        "share": step.term.assessment.share if step.term else None,
        "explained": 1 - deciding_excess(evidence, step.fitted) / total if total > 0 else None,
        "in_sample": shown["in_sample"],
        "heldout_condition": shown["heldout_condition"],
        "heldout_block": shown["heldout_block"],
        "parameters": estimates(step.fitted),
        "next": [
            {
                "family": r.entry.effect.family,
                "share": r.assessment.share,
                "p_signflip": r.assessment.chance,
                "status": r.status,
                "reason": r.reason,
            }
            for r in step.rows
        ],
    }


def _unexplained(evidence: Evidence, found: Finding, named: _Named) -> dict[str, Any]:
    """What is left, and where it is largest."""
    total = deciding_excess(evidence, found.before)
    blocks = judgement.blocks(evidence, found.before, named.after)
    return {
        "fraction": deciding_excess(evidence, named.after) / total if total > 0 else 0.0,
        "equation": "joint",
        "blocks": sorted(blocks, key=lambda b: -b["error_after"])[:5],
        "ceiling": None,
    }
