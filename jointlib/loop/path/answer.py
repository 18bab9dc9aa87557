"""From a search along a path to the report of the trace."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.naming import experiment, is_declared_pair
from jointlib.loop.answer.report import Rival, Status, TraceReport, Verdict, figures
from jointlib.loop.path import account, judgement, words
from jointlib.loop.path.acceptance import CHANCE, SHARE, TIE
from jointlib.loop.path.columns import law_forces
from jointlib.loop.path.estimates import candidate_of, chosen_of, estimates, set_by
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.forward import forward_check
from jointlib.loop.path.preparation import force_channel, prepare
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.search import Finding, Row, Term, deciding_excess, is_quiet, is_rival
from jointlib.loop.path.strokes import Division
from jointlib.measurement import Correction, Measurement, Record
from jointlib.path_fault import PathFault

_MOST_RIVALS = 8
"""Ranks among which rivals are looked for."""


@dataclass(frozen=True)
class _Named:
    """What the search amounts to: the verdict, and the model that the joint is mended with."""

    verdict: Verdict
    explained: float | None
    rows: tuple[Row, ...]
    """The contest beside the baseline; its winner is not accepted where nothing is added."""
    winner: Row | None
    rivals: tuple[Row, ...]
    after: Fitted
    terms: tuple[Term, ...]
    """Those in ``after``."""


def answer(
    measurement: Measurement,
    joint: Joint,
    records: Sequence[Record],
    evidence: Evidence,
    found: Finding,
    faults: Sequence[PathFault],
    missing: Mapping[str, str],
    seed: int,
) -> TraceReport:
    """Verdict, errors before and after, sealed records opened now, the mended joint and the corrections."""
    named = _named(found)
    channel = force_channel(measurement)
    entered = named.after is not found.before
    sealed_records = read_records(measurement, measurement.with_role("sealed"))
    spent = [r.name for r in sealed_records if f"{r.name} sha256:{r.sha256}" in joint.provenance.get("seal_opened", [])]
    warnings = words.warnings_of(
        evidence,
        measurement,
        sorted({name for r in records for name in r.ignored}),
        (*records, *sealed_records),
    )
    warnings += [f"The seal of {name} was opened in an earlier trace; it is spent." for name in spent]
    sealed = _sealed(measurement, evidence, sealed_records)
    before = judgement.errors(found.before, sealed)
    after = judgement.errors(named.after, sealed) if entered else before
    if entered and not after["relative"] < before["relative"]:
        family, where = found.terms[0].family, words.WHERE[before["where"]]
        warnings.append(f"With {family} the error {where} does not fall; it is not added.")
        named, entered, after = _withdrawn(named, found.before, where), False, before
    chosen = None
    if named.winner is not None:
        step = found.steps[1]
        chosen = chosen_of(
            named.winner, step.term or found.terms[0], step.fitted, found.before, named.explained or 0.0, channel
        )
    several = len(evidence.division.conditions) > 1
    is_named = named.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    chain = account.further(found, "accepted" if is_named else "hypothesis")
    effect = named.winner.entry.effect if named.winner else None
    rivals = tuple(_rival(r, named.winner, channel) for r in named.rivals if named.winner is not None)
    what_next = words.next_experiment(named.verdict, rivals, effect, several)
    further = found.terms[1:] if is_named else ()
    said = [f"{words.said(t.effect)}: {figures(set_by(t, named.after, found.before))}".rstrip(": ") for t in further]
    doubts = words.doubts([r.entry.effect for r in named.rivals])
    text = words.sentence(
        named.verdict,
        effect,
        chosen,
        doubts,
        said,
        before,
        after,
        account.overall_floor(evidence),
        evidence.floor.source,
    )
    return TraceReport(
        route="path",
        verdict=named.verdict,
        sentence=f"{text} Next: {what_next}",
        baseline=found.before.joint,
        mended=_mended(joint, named, evidence, records, sealed_records) if entered else joint,
        chosen=chosen,
        candidates=tuple(candidate_of(row, i + 1, found.before) for i, row in enumerate(named.rows)),
        rivals=rivals,
        chain=chain,
        secondary=chain if is_named else (),
        error_before=before,
        error_after=after,
        data=account.data(measurement, evidence, records, sealed_records, spent),
        noise_floor=account.floor(evidence),
        localisation={"blocks": judgement.blocks(found.before, named.after)},
        reduction=account.reduction(found, named.after),
        resimulation=forward_check(found.before, named.after, sealed),
        unexplained=account.unexplained(found, named.after),
        not_decidable=words.not_decidable(evidence, faults, missing),
        next_experiment=what_next,
        warnings=tuple(warnings),
        repro={
            "seed": seed,
            "version": version("jointlib"),
            "options": {"least_share": SHARE, "largest_chance": CHANCE, "tie": TIE},
        },
        extra_baseline={n: e for n, e in estimates(found.before).items() if n in ("mass", "offset")},
        corrections=tuple(Correction(k.fault.family, channel, None, k.parameters) for k in named.after.model.faults),
        measurement=measurement,
        plots=judgement.pictures(found.before, named.after),
    )


def _named(found: Finding) -> _Named:
    evidence, explained = found.before.evidence, None
    winner = next((r for r in found.rows if r.status is Status.ACCEPTED), None)
    if found.terms:
        explained = 1 - deciding_excess(found.steps[1].fitted) / deciding_excess(found.before)
        kept = {(t.family, t.member) for t in found.terms}
        own = [r for r in found.rows if r.entry.physical and (r.entry.family, r.entry.member) in kept]
        shares = [r.assessment.share for r in own]
        if found.steps[1].term not in found.terms and shares:
            explained = max(shares)
    rivals = tuple(r for r in found.rows[:_MOST_RIVALS] if winner is not None and is_rival(r))
    quiet = is_quiet(found.before)
    verdict = words.verdict_of(explained, len(rivals), quiet, len(evidence.division.conditions) > 1)
    after, terms = found.before, found.terms[:0]
    if verdict is Verdict.PARTIAL:
        after, terms = found.steps[1].fitted, found.terms[:1]
    elif verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS):
        after, terms = found.after, found.terms
    rows = found.rows
    if verdict is Verdict.UNEXPLAINED:
        rows = _refused(rows, "passes, but explains too little alone to be added")
    return _Named(verdict, explained, rows, winner if found.terms else None, rivals, after, terms)


def _withdrawn(named: _Named, before: Fitted, where: str) -> _Named:
    """Nothing is added: the error does not fall where it counts."""
    rows = _refused(named.rows, f"passes, but the error {where} does not fall with it")
    return dataclasses.replace(named, verdict=Verdict.UNEXPLAINED, rows=rows, after=before, terms=())


def _refused(rows: Sequence[Row], reason: str) -> tuple[Row, ...]:
    """Rows with the accepted one rejected."""
    return tuple(
        dataclasses.replace(r, status=Status.REJECTED, reason=reason) if r.status is Status.ACCEPTED else r
        for r in rows
    )


def _rival(row: Row, winner: Row | None, channel: str) -> Rival:
    assert winner is not None
    pair = row.entry.effect, winner.entry.effect
    return Rival(
        family=row.entry.family,
        gain_ratio=row.assessment.gain / winner.assessment.gain,
        declared_pair=is_declared_pair(*pair),
        separating_experiment=experiment(pair[1], pair[0]),
        member=row.entry.member,
        channel=channel if isinstance(row.entry.effect, PathFault) else None,
    )


def _sealed(measurement: Measurement, evidence: Evidence, records: Sequence[Record]) -> Evidence | None:
    """Sealed records prepared like the others."""
    if not records:
        return None
    runs = tuple(prepare(measurement, r, evidence.recorded[0].preparation) for r in records)
    nothing = PathFloor(np.zeros(0), "unknown", np.zeros(0, dtype=int))
    return Evidence(runs, evidence.carriage, Division((), "sealed"), nothing, law_forces(runs))


def _mended(
    joint: Joint, named: _Named, evidence: Evidence, records: Sequence[Record], sealed: Sequence[Record]
) -> Joint:
    """The joint with what was found, the range it was found on, and what it was found from."""
    paths = [run.path for run in evidence.runs]
    travels = [b.travel / 2 for b in evidence.division.blocks]
    speed = max(float(np.max(np.abs(p.velocity))) for p in paths)
    provenance = {
        **joint.provenance,
        "traced_on": [f"{r.name} sha256:{r.sha256}" for r in records],
        "effects": [t.family for t in named.terms],
        "verdict": named.verdict.value,
        "program": f"jointlib {version('jointlib')}",
    }
    if sealed:
        opened = [*joint.provenance.get("seal_opened", []), *(f"{r.name} sha256:{r.sha256}" for r in sealed)]
        provenance["seal_opened"] = list(dict.fromkeys(opened))
    validity = {**joint.validity, "amplitude": (0.0, max(travels)), "velocity": (0.0, speed)}
    return dataclasses.replace(named.after.joint, validity=validity, provenance=provenance)
