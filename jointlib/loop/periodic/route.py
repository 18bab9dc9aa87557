"""Close the loop on a rig with periodic excitation, in the frequency domain."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.answer.catalogue import catalogue
from jointlib.loop.answer.naming import experiment, is_declared_pair
from jointlib.loop.answer.report import Candidate, Rival, Status, TraceReport, Verdict
from jointlib.loop.balance import excess
from jointlib.loop.balance.bench import Raw
from jointlib.loop.balance.resimulation import compared
from jointlib.loop.contest.before_after import errors
from jointlib.loop.contest.contestant import contestants
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.contest.on_input import on_inputs
from jointlib.loop.contest.rounds import Round, Row
from jointlib.loop.contest.search import Term, explained, search, together
from jointlib.loop.periodic import verdict
from jointlib.loop.periodic.mending import corrections_of, modulated, starting_point
from jointlib.loop.periodic.pictures import pictures
from jointlib.loop.periodic.readings import Readings, baseline, readings
from jointlib.loop.periodic.tables import (
    candidate_of,
    chosen_of,
    composition,
    described,
    floor_table,
    left,
    member_of,
    place_of,
    removed,
    widened,
)
from jointlib.measurement import Measurement


def trace_periodic(measurement: Measurement, joint: Joint, *, seed: int = 0) -> TraceReport:
    """Say whether a joint model or its measurement lacks an effect, from accelerations on both sides and the force.

    m1 a1 = P − f, f = m2 a2 + m3 a3; the residuals J = m2 a2 + m3 a3 − f_model(z, ż), B = P − m1 a1 − m2 a2 − m3 a3
    and R = a2 − a3 are whitened with their propagated noise. Candidates compete by the drop of the loss of records
    left out of their fit; the sealed record is opened once, after the choice, and a term that does not lower the error
    on it is withdrawn. Nothing here is random; ``seed`` is noted in the report.
    """
    data = readings(measurement)
    warnings = list(data.warnings)
    start = baseline(data.training, *starting_point(joint, data.training))
    if start.held:
        names = ", ".join(start.held)
        warnings.append(f"These records cannot tell {names} from the other parameters; held at the given value.")
    known = catalogue()
    warnings += known.failed
    field = (*contestants(known.joint, known.rig, start), *on_inputs(start))
    if len(data.training) < 2:
        warnings.append("One record to fit: no candidate can be judged on a record left out.")
        field = ()
    opening, terms, secondary = search(start, field)
    found = _judged(start, terms)
    rivals = _rivals(terms[0].round, data) if terms and found.together is None else _all_rivals(terms, data)
    word, alone = verdict.verdict_of(found, bool(terms), len(rivals))
    named = word in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    entered = terms if named else terms[:1] if word is Verdict.PARTIAL else ()
    last = entered[-1].fitted if entered else start
    sealed, unused = data.opened()
    warnings += unused
    _spent(joint, sealed, warnings)
    before, after = errors(start, sealed, joint), errors(last, sealed)
    if entered and not _lower(after, before):
        where = verdict.WHERE[after["where"]]
        warnings.append(f"With {terms[0].row.label} the error {where} does not fall; it is not added.")
        word, named, entered, last, after = verdict.verdict_of(found, False, 0)[0], False, (), start, before
    if word is Verdict.NOTHING_MISSING:
        terms, rivals = (), ()
    chosen = chosen_of(last, terms[0], alone) if terms else None
    shown_before, shown_after = (f.on(sealed) if sealed else f for f in (start, last))
    table_after = last.localised
    first = terms[0].row.contestant.effect if terms else None
    further = [chosen_of(last, t, None) for t in entered[1:]]
    told = (*rivals, *_all_rivals(terms, data)) if further else rivals
    said = verdict.sentence(word, chosen, further, told, before, after, found, last.joint)
    what_next = verdict.next_experiment(word, rivals, first, found)
    return TraceReport(
        route="periodic",
        verdict=word,
        sentence=f"{said} Next: {what_next}",
        baseline=start.joint,
        mended=_noted(modulated(widened(last), last), data, last, sealed) if entered else joint,
        chosen=chosen,
        candidates=_candidates(opening, chosen, word),
        rivals=rivals,
        composition=composition(start, terms, last) if found.together is not None and named else (),
        chain=tuple(_further(t, terms[0], data, "accepted" if named else "hypothesis") for t in terms[1:]),
        secondary=tuple(_link(r, terms[0], data) for r in secondary if terms),
        error_before=before,
        error_after=after,
        data={
            "records": [described(r.spectra) for r in data.training],
            "sealed": [described(r.spectra) for r in sealed] or None,
            "sha256": {s.name: s.sha256 for s in (*_spectra(data.training), *data.quiet, *_spectra(sealed))},
            "excited_band_Hz": list(data.band[1:3]),
            "joint_band_Hz": [data.band[0], data.band[3]],
            "simulated": measurement.simulated,
        },
        noise_floor=floor_table(start.records, before),
        localisation=found.table,
        reduction={
            "excess_removed": removed(found.before, excess.total_excess(table_after)),
            "rms_over_floor": after["joint_N"] / after["joint_floor_N"],
        },
        resimulation=compared((shown_before.records, shown_before.joint), (shown_after.records, shown_after.joint)),
        unexplained=left(table_after, found.before, last),
        not_decidable=verdict.not_decidable(data, known.rig),
        next_experiment=what_next,
        warnings=tuple(warnings),
        repro={"seed": seed, "version": version("jointlib"), "options": {}},
        corrections=corrections_of(last, data) if entered else (),
        measurement=measurement,
        plots=pictures(shown_before, shown_after),
    )


def _spectra(raws: Sequence[Raw]) -> list[Any]:
    return [r.spectra for r in raws]


def _judged(start: Fitted, terms: Sequence[Term]) -> verdict.Findings:
    table = start.localised
    before = after = excess.total_excess(table)
    if terms:
        after = excess.total_excess(terms[0].alone.localised)
    whole = explained(start, terms[-1].fitted) if together(start, terms) else None
    return verdict.Findings(table, before, after, {e: excess.total_excess(table, e) for e in table}, whole)


def _lower(after: dict[str, Any], before: dict[str, Any]) -> bool:
    """Whether the error falls: of the joint equation, or of all equations together where a fault sits elsewhere."""
    return bool(after["relative"] < before["relative"] or after["chi2"] < before["chi2"])


def _all_rivals(terms: Sequence[Term], data: Readings) -> tuple[Rival, ...]:
    """Of each term beside all others, none of which is one."""
    own = {(c.effect.family, c.site) for c in (t.row.contestant for t in terms)}
    of_each = [(t.beside if len(terms) > 1 else None) or t.round for t in terms]
    return tuple(r for held in of_each for r in _rivals(held, data, own))


def _rivals(held: Round, data: Readings, besides: Set[tuple[str, str]] = frozenset()) -> tuple[Rival, ...]:
    """Rivals of the winner of a contest besides what is told itself, by family and site."""
    chosen, out = held.winner, []
    assert chosen is not None
    for r in held.rivals:
        a, b = chosen.contestant.effect, r.contestant.effect
        if (b.family, r.contestant.site) in besides:
            continue
        channel, body = place_of(r.contestant, data.rig)
        ratio = r.score.gain / chosen.score.gain
        out.append(
            Rival(b.family, ratio, is_declared_pair(a, b), experiment(a, b), member_of(r.contestant), channel, body)
        )
    return tuple(out)


def _further(term: Term, first: Term, data: Readings, status: str) -> dict[str, Any]:
    """A further term, with its own rivals."""
    rivals = [{"family": r.family} | r.place for r in _rivals(term.beside or term.round, data)]
    return {**_link(term.row, first, data), "status": status, "rivals": rivals}


def _link(row: Row, first: Term, data: Readings) -> dict[str, Any]:
    """A further effect, with its gain as a share of the first one's."""
    channel, body = place_of(row.contestant, data.rig)
    share = row.score.gain / first.row.score.gain
    out = {"family": row.contestant.effect.family, "member": member_of(row.contestant), "share": share}
    return out | {k: v for k, v in (("channel", channel), ("body", body)) if v}


def _candidates(opening: Round, chosen: Candidate | None, word: Verdict) -> tuple[Candidate, ...]:
    """Every family of the first contest; the best of them is not accepted where the verdict leaves it unnamed."""
    rows = [candidate_of(opening, r, i + 1) for i, r in enumerate(opening.rows)]
    out = []
    for c in rows:
        if chosen is not None and (c.family, c.where) == (chosen.family, chosen.where):
            c = replace(c, explained=chosen.explained)
            if word is Verdict.UNEXPLAINED:
                c = replace(c, status=Status.REJECTED, reason="passes, but explains too little alone to be added")
        out.append(c)
    return tuple(out)


def _spent(joint: Joint, opened: Sequence[Raw], warnings: list[str]) -> None:
    """Say which sealed records an earlier trace had opened already."""
    for s in _spectra(opened):
        if s.sha256 in joint.provenance.get("seals_opened", ()):
            warnings.append(f"{s.name}: its seal is spent, an earlier trace of this joint opened it.")


def _noted(joint: Joint, data: Readings, last: Fitted, opened: Sequence[Raw]) -> Joint:
    """The mended joint with the range it was fitted on, the hashes of that, and of the seals that were opened."""
    traced = [f"{s.name} sha256:{s.sha256}" for s in _spectra(data.training)]
    seals = dict.fromkeys([*joint.provenance.get("seals_opened", ()), *(s.sha256 for s in _spectra(opened))])
    seen = {
        "amplitude": (0.0, max(float(np.abs(o.path[0]).max()) for o in last.records)),
        "velocity": (0.0, max(float(np.abs(o.path[1]).max()) for o in last.records)),
        "frequency": (float(data.band[0]), float(data.band[3])),
    }
    return replace(
        joint,
        validity={**seen, **joint.validity},
        provenance={**joint.provenance, "traced_on": traced, "seals_opened": list(seals)},
    )
