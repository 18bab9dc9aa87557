"""From a search along a path to the report of the trace."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop.answer.naming import NAMED_FROM, experiment, is_declared_pair
from jointlib.loop.answer.report import Rival, Status, TraceReport, Verdict
from jointlib.loop.path import account, judgement, words
from jointlib.loop.path.acceptance import CHANCE, SHARE, TIE
from jointlib.loop.path.columns import law_forces
from jointlib.loop.path.composed import own_offsets
from jointlib.loop.path.composed import remains as composed_remains
from jointlib.loop.path.composed.same_law import without_itself
from jointlib.loop.path.estimates import candidate_of, chosen_of, estimates, set_by
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.fitted import Fitted
from jointlib.loop.path.forward import forward_check
from jointlib.loop.path.preparation import force_channel, prepare
from jointlib.loop.path.repeats import PathFloor
from jointlib.loop.path.steps import Composition, Finding, Part, Row, Term, deciding_excess, is_quiet, is_rival
from jointlib.loop.path.strokes import Division
from jointlib.loop.path.trials import Effect, member_of
from jointlib.measurement import Correction, Measurement, Record
from jointlib.path_fault import PathFault

_MOST_RIVALS = 8
"""Ranks among which rivals are looked for."""


@dataclass(frozen=True)
class _Rivalry:
    """An effect that would do as well in the place of a term."""

    effect: Effect
    gain_ratio: float
    term: Term


@dataclass(frozen=True)
class _Named:
    """What the search amounts to: the verdict, and the model that the joint is mended with."""

    verdict: Verdict
    explained: float | None
    rows: tuple[Row, ...]
    """The contest beside the baseline; its winner is not accepted where nothing is added."""
    winner: Row | None
    rivals: tuple[_Rivalry, ...]
    after: Fitted
    terms: tuple[Term, ...]
    """Those in ``after``."""
    together: float | None = None
    """Share of the excess that a composition explains where none of its effects does alone."""


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
        later = named.together is not None or not _entered_first(found)
        fitted = found.after if later else found.steps[1].fitted
        chosen = chosen_of(named.winner, found.terms[0], fitted, found.before, named.explained or 0.0, channel)
    several = len(evidence.division.conditions) > 1
    is_named = named.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    whole = entered and len(named.terms) > 1
    chain = account.further(found, "accepted" if is_named or whole else "hypothesis")
    effect = named.winner.entry.effect if named.winner else None
    rivals = tuple(_rival(r, channel) for r in named.rivals)
    what_next = words.next_experiment(named.verdict, rivals, effect, several)
    further = found.terms[1:] if is_named or whole else ()
    mended = named.after.joint
    said = [words.named(t.effect, set_by(t, named.after, found.before), mended) for t in further]
    doubts = words.doubts([r.effect for r in named.rivals])
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
        named.together if whole else None,
        mended,
    )
    left = composed_remains.remains(named.after)
    if measurement.carriage is None and named.after.evidence.mass is None:
        text = " ".join([text, *(t.effect.of_joint for t in named.terms if isinstance(t.effect, PathFault))]).rstrip()
    text = " ".join([text, own_offsets.said(named.after)]).rstrip()
    if entered and named.verdict is Verdict.PARTIAL:
        text = " ".join([text, composed_remains.said(left)]).rstrip()
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
        composition=account.composition(found) if whole else (),
        error_before=before,
        error_after=after,
        data=account.data(measurement, evidence, records, sealed_records, spent),
        noise_floor=account.floor(evidence),
        localisation={"blocks": judgement.blocks(found.before, named.after)},
        reduction=account.reduction(found, named.after),
        resimulation=forward_check(found.before, named.after, sealed),
        unexplained=account.unexplained(found, named.after) | {"where": left},
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
    evidence, rows = found.before.evidence, found.rows
    total = 1 - deciding_excess(found.after) / max(deciding_excess(found.before), 1e-300)
    alone, winner, rivals = None, None, list[_Rivalry]()
    after, terms = found.after, found.terms
    if terms:
        rows = _marked(rows, terms)
        own = {(r.entry.family, r.entry.member): r for r in rows}
        winner = own.get((terms[0].family, terms[0].member), found.parts[0].row)
        if _entered_first(found):
            alone = 1 - deciding_excess(found.steps[1].fitted) / deciding_excess(found.before)
        else:
            shares = [own[name].assessment.share for t in terms if (name := (t.family, t.member)) in own]
            alone = max([0.0, *shares]) if len(terms) > 1 else total
    composed = alone is not None and alone < NAMED_FROM and len(terms) > 1
    if composed:
        rivals = [_rivalry(r, p) for p in found.parts for r in p.rows if is_rival(r) and p.row is not None]
        known = {r.effect.family for r in rivals}
        rivals += [r for c in found.others if (r := _beside(found, c)) is not None and r.effect.family not in known]
    elif found.parts:
        rivals = [_rivalry(r, found.parts[0]) for r in found.rows[:_MOST_RIVALS] if is_rival(r)]
    if terms and not composed:
        rows, same = without_itself(rows, found)
        rivals = [rival for rival in rivals if rival.effect not in same]
    several = len(evidence.division.conditions) > 1
    verdict = words.verdict_of(total if composed else alone, len(rivals), is_quiet(found.before), several)
    if verdict in (Verdict.UNEXPLAINED, Verdict.NOTHING_MISSING):
        after, terms = found.before, ()
    elif verdict is Verdict.PARTIAL and not composed and _entered_first(found):
        after, terms = found.steps[1].fitted, terms[:1]
    if verdict is Verdict.UNEXPLAINED:
        rows = _refused(rows, "passes, but explains too little to be added")
    together = total if composed else None
    return _Named(verdict, alone, rows, winner, tuple(rivals), after, terms, together)


def _entered_first(found: Finding) -> bool:
    """True where the first term entered alone, and was neither exchanged nor one of a pair."""
    return found.steps[1].action == "added" and found.steps[1].term is found.terms[0]


def _marked(rows: Sequence[Row], terms: Sequence[Term]) -> tuple[Row, ...]:
    """The contest beside the baseline, with the terms of the best model accepted and no others."""
    number = {(t.family, t.member): i + 1 for i, t in enumerate(terms)}
    out = []
    for r in rows:
        at = number.get((r.entry.family, r.entry.member))
        if at is not None and (len(terms) > 1 or r.status is not Status.ACCEPTED):
            reason = f"number {at} of what passes together" if len(terms) > 1 else "takes the place of what came first"
            r = dataclasses.replace(r, status=Status.ACCEPTED, reason=reason)
        elif at is None and r.status is Status.ACCEPTED:
            r = dataclasses.replace(r, status=Status.REJECTED, reason="came first, and another took its place")
        out.append(r)
    return tuple(out)


def _withdrawn(named: _Named, before: Fitted, where: str) -> _Named:
    """Nothing is added: the error does not fall where it counts."""
    rows = _refused(named.rows, f"passes, but the error {where} does not fall with it")
    return dataclasses.replace(named, verdict=Verdict.UNEXPLAINED, rows=rows, after=before, terms=(), together=None)


def _refused(rows: Sequence[Row], reason: str) -> tuple[Row, ...]:
    """Rows with the accepted one rejected."""
    return tuple(
        dataclasses.replace(r, status=Status.REJECTED, reason=reason) if r.status is Status.ACCEPTED else r
        for r in rows
    )


def _rivalry(row: Row, part: Part) -> _Rivalry:
    own = part.row.assessment.gain if part.row else part.adds.gain
    return _Rivalry(row.entry.effect, row.assessment.gain / own, part.term)


def _beside(found: Finding, other: Composition) -> _Rivalry | None:
    """The one effect in which another composition that gains as much differs from the best; None otherwise."""
    total, best = deciding_excess(found.before), deciding_excess(found.after)
    ratio = (total - deciding_excess(other.fitted)) / max(total - best, 1e-300)
    new = [t for t in other.terms if t.family not in {b.family for b in found.terms}]
    old = [t for t in found.terms if t.family not in {o.family for o in other.terms}]
    if ratio < 1 - TIE or len(new) != 1 or len(old) != 1 or len(other.terms) != len(found.terms):
        return None
    return _Rivalry(new[0].effect, ratio, old[0])


def _rival(rivalry: _Rivalry, channel: str) -> Rival:
    effect, own = rivalry.effect, rivalry.term.effect
    return Rival(
        family=effect.family,
        gain_ratio=rivalry.gain_ratio,
        declared_pair=is_declared_pair(effect, own),
        separating_experiment=experiment(own, effect),
        member=member_of(effect),
        channel=channel if isinstance(effect, PathFault) else None,
    )


def _sealed(measurement: Measurement, evidence: Evidence, records: Sequence[Record]) -> Evidence | None:
    """Sealed records prepared like the others."""
    if not records:
        return None
    runs = tuple(prepare(measurement, r, evidence.recorded[0].preparation) for r in records)
    nothing = PathFloor(np.zeros(0), "unknown", np.zeros(0, dtype=int))
    division, own = Division((), "sealed"), evidence.own_offsets
    return Evidence(runs, evidence.carriage, division, nothing, law_forces(runs), own_offsets=own)


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
