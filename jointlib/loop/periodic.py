"""Close the loop on a rig with periodic excitation, in the frequency domain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.arrays import ComplexArray
from jointlib.errors import InputError
from jointlib.io.measurement_file import read_records
from jointlib.joint import Joint
from jointlib.loop import excess, verdict
from jointlib.loop.bodies import Rig, rig_of
from jointlib.loop.catalogue import catalogue
from jointlib.loop.equations import Observed
from jointlib.loop.fitted import Fitted, fit, free_parameters, model_of
from jointlib.loop.floor import Floor, noise_floor
from jointlib.loop.naming import experiment, is_declared_pair
from jointlib.loop.pictures import pictures
from jointlib.loop.report import Candidate, Rival, Status, TraceReport, Verdict
from jointlib.loop.resimulation import compared
from jointlib.loop.search import Round, Term, prediction_error, search
from jointlib.loop.spectra import Spectra, excited_band, spectra_of
from jointlib.loop.tables import candidate_of, chosen_of, described, floor_table, left, removed, widened
from jointlib.measurement import Measurement, RecordSource


def trace_periodic(measurement: Measurement, joint: Joint, *, seed: int = 0) -> TraceReport:
    """Say whether a joint model lacks an effect, from accelerations on both sides and the force on body 1.

    m1 a1 = P − f, f = m2 a2 + m3 a3; the residuals J = m2 a2 + m3 a3 − f_model(z, ż), B = P − m1 a1 − m2 a2 − m3 a3
    and R = a2 − a3 are whitened with their propagated noise. Candidates compete by the drop of the loss of records
    left out of their fit; the sealed record is opened once, after the choice, and a term that does not lower the error
    on it is withdrawn. Nothing here is random; ``seed`` is
    noted in the report.
    """
    data, warnings = _prepared(measurement)
    start, observed = _baseline(data, joint)
    if start.held:
        names = ", ".join(start.held)
        warnings.append(f"These records cannot tell {names} from the other parameters; held at the given value.")
    effects, failed = catalogue()
    warnings += failed
    if len(observed) < 2:
        warnings.append("One record to fit: no candidate can be judged on a record left out.")
        effects = ()
    opening, terms, secondary = search(observed, start, effects)
    training = _judgement(observed, start, terms)
    rivals = _rivals(terms)
    word, explained = verdict.verdict_of(training.findings, bool(terms), len(rivals))
    named = word in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    entered = terms if named else terms[:1] if word is Verdict.PARTIAL else ()
    last = entered[-1].fitted if entered else start
    sealed, opened = _sealed(measurement, data, observed[0], warnings)
    _spent(joint, opened, warnings)
    before, after = _errors(observed, sealed, start, last, joint)
    if entered and after["relative"] >= before["relative"]:
        warnings.append(f"With {terms[0].row.score.family} the error {after['where']} does not fall; it is not added.")
        word, named, entered, last = Verdict.UNEXPLAINED, False, (), start
        before, after = _errors(observed, sealed, start, last, joint)
    mended = _noted(widened(observed, last), data, observed, opened) if entered else joint
    chosen = chosen_of(observed, last, terms[0], explained) if terms else None
    chain = tuple(
        {
            "family": t.row.score.family,
            "share": t.row.score.gain / terms[0].row.score.gain,
            "status": "accepted" if named else "hypothesis",
        }
        for t in terms[1:]
    )
    shown = sealed or observed
    levels = len({o.spectra.condition for o in observed})
    periods = min(o.spectra.periods for o in observed)
    residue = excess.judged(observed, last.joint)
    table_after = excess.localisation(observed, residue)
    first = terms[0].row.effect if terms else None
    what_next = verdict.next_experiment(word, rivals, first, training.findings)
    return TraceReport(
        route="periodic",
        verdict=word,
        sentence=verdict.sentence(word, chosen, rivals, before, after, training.findings) + f" Next: {what_next}",
        baseline=start.joint,
        mended=mended,
        chosen=chosen,
        candidates=_candidates(opening, chosen),
        rivals=rivals,
        chain=chain,
        secondary=tuple(
            {"family": r.score.family, "share": r.score.gain / terms[0].row.score.gain} for r in secondary if terms
        ),
        error_before=before,
        error_after=after,
        data={
            "records": [described(o.spectra) for o in observed],
            "sealed": [described(o.spectra) for o in sealed] or None,
            "sha256": {s.name: s.sha256 for s in (*data.training, *data.quiet, *opened)},
            "excited_band_Hz": list(data.band[1:3]),
            "joint_band_Hz": [data.band[0], data.band[3]],
            "simulated": measurement.simulated,
        },
        noise_floor=floor_table(observed, before),
        localisation=training.table,
        reduction={
            "excess_removed": removed(training.findings.before, excess.total_excess(table_after)),
            "rms_over_floor": after["joint_N"] / after["joint_floor_N"],
        },
        resimulation=compared(shown, start.joint, last.joint),
        unexplained=left(table_after, training.findings.before, excess.largest_lines(observed, residue)),
        not_decidable=verdict.not_decidable(data.rig, periods, levels, len(observed)),
        next_experiment=what_next,
        warnings=tuple(warnings),
        repro={"seed": seed, "version": version("jointlib"), "options": {}},
        plots=pictures(shown, start.joint, last.joint),
    )


@dataclass(frozen=True)
class _Data:
    """Training and quiet records as spectra, with their floors."""

    rig: Rig
    training: tuple[Spectra, ...]
    quiet: tuple[Spectra, ...]
    floors: tuple[Floor, ...]
    band: tuple[float, float, float, float]


@dataclass(frozen=True)
class _Judgement:
    table: Mapping[str, Mapping[str, Any]]
    findings: verdict.Findings


def _spectra(measurement: Measurement, sources: Sequence[RecordSource], warnings: list[str]) -> tuple[Spectra, ...]:
    out = []
    for record in read_records(measurement, sources):
        s, said = spectra_of(record, measurement)
        out.append(s)
        warnings += said
    return tuple(out)


def _prepared(measurement: Measurement) -> tuple[_Data, list[str]]:
    warnings: list[str] = []
    training = _spectra(measurement, measurement.with_role("fit"), warnings)
    quiet = _spectra(measurement, measurement.with_role("quiet"), warnings)
    floors = tuple(noise_floor(s, quiet) for s in training)
    for s, f in zip(training, floors, strict=True):
        if f.source == "quiet" and s.periods > 1:
            raised = ", ".join(f"{n} {r:.1f} times" for n, r in f.ratio.items() if r > 1.5)
            warnings.append(f"{s.name}: between the lines {raised} the quiet level; something does not repeat.")
    return _Data(rig_of(measurement), training, quiet, floors, excited_band(training, measurement.band)), warnings


def _observed(data: _Data, spectra: Spectra, floor: Floor, joint: Joint) -> Observed:
    """A record with the linear part of the joint on its own motion, which carries the noise of z."""
    bare = Observed(spectra, data.rig, floor, data.band, 0.0, 0.0)
    k, c = bare.linear_part(bare.model_force(joint))
    return replace(bare, stiffness=k, damping=c)


def _baseline(data: _Data, joint: Joint) -> tuple[Fitted, tuple[Observed, ...]]:
    """The joint refitted to the training records, twice: the noise of z depends on its stiffness."""
    fitted = Fitted(joint, (), ())
    for _ in range(2):
        observed = tuple(_observed(data, s, f, fitted.joint) for s, f in zip(data.training, data.floors, strict=True))
        for o in observed:
            if not (o.kept & o.on_period).any():
                raise InputError(f"{o.spectra.name}: the relative motion drowns in noise on every line")
        fitted = fit(observed, fitted.joint, free_parameters(joint))
    return fitted, observed


def _judgement(observed: Sequence[Observed], start: Fitted, terms: Sequence[Term]) -> _Judgement:
    table = excess.localisation(observed, excess.judged(observed, start.joint))
    before = excess.total_excess(table)
    after = before
    if terms:
        after = excess.total_excess(excess.localisation(observed, excess.judged(observed, terms[0].fitted.joint)))
    by_equation = {e: excess.total_excess(table, e) for e in table}
    return _Judgement(table, verdict.Findings(before, after, by_equation))


def _sealed(
    measurement: Measurement, data: _Data, like: Observed, warnings: list[str]
) -> tuple[tuple[Observed, ...], tuple[Spectra, ...]]:
    """Open the sealed records, after everything is decided."""
    opened = _spectra(measurement, measurement.with_role("sealed"), warnings)
    return tuple(replace(like, spectra=s, floor=noise_floor(s, data.quiet), _forces={}) for s in opened), opened


def _errors(
    observed: Sequence[Observed], sealed: Sequence[Observed], start: Fitted, last: Fitted, given: Joint
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors before and after, on the sealed record, else on records left out in turn; the in-sample ones beside."""
    out = []
    for fitted in (start, last):
        inside = excess.sizes(observed, excess.judged(observed, fitted.joint))
        heldout: dict[str, float] = {}
        if len(observed) > 1:
            left_out = excess.unreal(prediction_error(model_of(observed, fitted)), observed)
            heldout = excess.sizes(observed, left_out)
        if sealed:
            where, records, whitened = "sealed", sealed, excess.judged(sealed, fitted.joint)
        elif len(observed) > 1:
            where, records, whitened = "condition folds", observed, left_out
        else:
            where, records, whitened = "in sample", observed, excess.judged(observed, fitted.joint)
        table = excess.localisation(records, whitened)
        out.append(
            {
                **excess.sizes(records, whitened),
                "where": where,
                "in_sample": inside["relative"],
                "heldout": heldout.get("relative"),
                "heldout_condition": heldout.get("relative"),
                "per_class": excess.per_class(table),
                "per_record": [
                    {"record": o.spectra.name, **_brief(o, r)} for o, r in zip(records, whitened, strict=True)
                ],
            }
        )
    if sealed or observed:
        records = sealed or observed
        out[0]["as_given"] = excess.sizes(records, excess.judged(records, given))["relative"]
    return out[0], out[1]


def _brief(o: Observed, whitened: ComplexArray) -> dict[str, float]:
    sizes = excess.sizes([o], [whitened])
    return {k: sizes[k] for k in ("relative", "joint_N", "chi2")}


def _rivals(terms: Sequence[Term]) -> tuple[Rival, ...]:
    if not terms:
        return ()
    chosen = terms[0].row
    return tuple(
        Rival(
            r.score.family,
            r.score.gain / chosen.score.gain,
            is_declared_pair(chosen.effect, r.effect),
            experiment(chosen.effect, r.effect),
        )
        for r in terms[0].round.rivals
    )


def _candidates(opening: Round, chosen: Candidate | None) -> tuple[Candidate, ...]:
    rows = [candidate_of(opening, r, i + 1) for i, r in enumerate(opening.rows)]
    return tuple(
        replace(c, explained=chosen.explained)
        if chosen is not None and c.family == chosen.family and c.status is Status.ACCEPTED
        else c
        for c in rows
    )


def _spent(joint: Joint, opened: Sequence[Spectra], warnings: list[str]) -> None:
    """Say which sealed records an earlier trace had opened already."""
    for s in opened:
        if s.sha256 in joint.provenance.get("seals_opened", ()):
            warnings.append(f"{s.name}: its seal is spent, an earlier trace of this joint opened it.")


def _noted(joint: Joint, data: _Data, observed: Sequence[Observed], opened: Sequence[Spectra]) -> Joint:
    """The mended joint with the range it was fitted on, the hashes of that, and of the seals that were opened."""
    traced = [f"{s.name} sha256:{s.sha256}" for s in data.training]
    seals = [*joint.provenance.get("seals_opened", ()), *(s.sha256 for s in opened)]
    seen = {
        "amplitude": (0.0, max(float(np.abs(o.path[0]).max()) for o in observed)),
        "velocity": (0.0, max(float(np.abs(o.path[1]).max()) for o in observed)),
        "frequency": (float(data.band[0]), float(data.band[3])),
    }
    return replace(
        joint,
        validity={**seen, **joint.validity},
        provenance={**joint.provenance, "traced_on": traced, "seals_opened": seals},
    )
