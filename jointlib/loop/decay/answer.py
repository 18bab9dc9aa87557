"""From a contest over free decays to the report of the trace."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.answer.naming import NAMED_FROM, NEAREST_FROM, experiment, is_declared_pair
from jointlib.loop.answer.report import Candidate, Estimate, Rival, Status, TraceReport, Verdict
from jointlib.loop.decay.contest import LEAST, Row, is_quiet
from jointlib.loop.decay.fitted import Fitted, Folds
from jointlib.loop.decay.rerun import pictures, run_again
from jointlib.loop.decay.search import Search
from jointlib.loop.decay.sentence import sentence_of
from jointlib.measurement import Measurement, Record
from jointlib.ringdown.evidence import DRIFT, FORM, Evidence

_LINEAR = {
    "family": "structural-damping, relaxation",
    "why": "at one frequency they look like stiffness and damping",
    "needs": "a second mode, or a forced test over an octave",
}
_SIGN = {
    "family": "quadratic",
    "why": "its sign does not show in frequency and damping",
    "needs": "the mean of the displacement, or a static test",
}
_MEAN = "Measure the mean of the displacement, or a static curve: an uneven spring moves the mean."
_UNNAMED = "power-of-amplitude"
_SPEEDS = "Measure the force along a path at several speeds and strokes, or decays of a second mode."
_DISPLACED = {
    "family": "damping by displacement",
    "why": "at one frequency |z|·ż damps as drag does, and z²·ż as ż³",
    "needs": "a second mode, or the force along a path at several speeds and strokes",
}
_BODIES = {
    "family": "missing-mass, gain, delay",
    "why": "stiffness, damping and forces scale with the modal mass",
    "needs": "a rig with known bodies",
}


@dataclasses.dataclass(frozen=True)
class Sealed:
    """Decays that were opened last."""

    evidence: Evidence
    records: tuple[Record, ...]


def verdict_of(found: Search, folds: Folds) -> Verdict:
    """How far the evidence carries."""
    if is_quiet(found.before.loss, found.count):
        return Verdict.NOTHING_MISSING
    if not found.terms or found.explained < NEAREST_FROM:
        return Verdict.UNEXPLAINED
    stands_in = found.rounded is not None or (found.unnamed is not None and found.unnamed.clear)
    if found.explained < NAMED_FROM or not found.clean or stands_in:
        return Verdict.PARTIAL
    if found.unnamed is not None:
        return Verdict.AMBIGUOUS
    return Verdict.AMBIGUOUS if found.rivals or not folds.several else Verdict.IDENTIFIED


def report_of(
    measurement: Measurement,
    joint: Joint,
    records: Sequence[Record],
    evidence: Evidence,
    folds: Folds,
    found: Search,
    sealed: Sealed | None,
    messages: Sequence[str],
    seed: int,
) -> TraceReport:
    """Verdict, errors before and after, and the mended joint."""
    verdict = verdict_of(found, folds)
    added = verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS, Verdict.PARTIAL)
    after = found.after if added else found.before
    where = "sealed" if sealed else "folds" if folds.several else "block_folds"
    before_error, after_error = (_error(one, evidence, sealed, where) for one in (found.before, after))
    warnings = list(messages)
    if added and not after_error["relative"] < before_error["relative"]:
        warnings.append(
            f"With {found.terms[0].effect.family} the error on {_WHERE[where]} does not fall; it is not added."
        )
        verdict, added, after, after_error = Verdict.UNEXPLAINED, False, found.before, before_error
    quiet = verdict is Verdict.NOTHING_MISSING
    candidates = tuple(_candidate(r, i + 1, found) for i, r in enumerate(_shown(found, added, quiet)))
    terms = found.terms if added else ()
    chosen = next(
        (c for c in candidates if terms and c.family == terms[0].effect.family and c.status is Status.ACCEPTED), None
    )
    if chosen is not None:
        chosen = dataclasses.replace(chosen, parameters=_estimates(after, joint), explained=found.explained)
    rivals = tuple(_rival(r, found) for r in found.rivals) if added else ()
    if added and found.unnamed is not None:
        ratio = found.unnamed.joint / max(found.unnamed.lost, 1e-300)
        rivals += (Rival(_UNNAMED, ratio, False, _SPEEDS, found.unnamed.words),)
    if added and not evidence.alone:
        rivals += _of_unseen_harmonics(found)
        verdict = Verdict.AMBIGUOUS if rivals and verdict is Verdict.IDENTIFIED else verdict
    text, what_next = sentence_of(verdict, found, chosen, rivals, folds, after_error["relative"])
    spent = (
        [r.name for r in sealed.records if f"{r.name} sha256:{r.sha256}" in joint.provenance.get("seal_opened", [])]
        if sealed
        else []
    )
    warnings += [f"The seal of {name} was opened in an earlier trace; it is spent." for name in spent]
    return TraceReport(
        route="ringdown",
        verdict=verdict,
        sentence=f"{text} Next: {what_next}",
        baseline=found.before.joint,
        mended=_mended(joint, after, found, verdict, evidence, records, sealed) if added else joint,
        chosen=chosen,
        candidates=candidates,
        rivals=rivals,
        chain=(),
        secondary=(),
        composition=_composition(found) if len(terms) > 1 else (),
        error_before=before_error,
        error_after=after_error,
        data={
            "records": [{"name": r.name, "sha256": r.sha256, "role": r.source.role} for r in records],
            "simulated": measurement.simulated,
            "modal_mass": evidence.modal_mass,
            "pieces": [len(b) for b in evidence.backbones],
            "sealed": [r.name for r in sealed.records] if sealed else [],
        },
        noise_floor={
            "source": "what the cosines leave of each piece, and the spectrum",
            "frequency": [float(np.median(b.omega_error / b.omega)) for b in evidence.backbones],
            "damping_ratio": [float(np.median(b.ratio_error)) for b in evidence.backbones],
            "drift": DRIFT,
            "form": FORM,
        },
        localisation={},
        reduction={"misfit_before": found.before.held_out / found.count, "misfit_after": after.held_out / found.count},
        resimulation=run_again(evidence, found.before, after),
        unexplained={"fraction": 0.0 if quiet else max(0.0, 1 - found.explained) if added else 1.0},
        not_decidable=(_LINEAR, _SIGN, _DISPLACED, _BODIES),
        next_experiment=what_next,
        warnings=tuple(warnings),
        repro={"seed": seed, "version": version("jointlib"), "options": {"least_share": LEAST}},
        measurement=measurement,
        plots=pictures(evidence, found.before, after),
    )


_WHERE = {"sealed": "the sealed records", "folds": "levels left out", "block_folds": "parts of the amplitude left out"}


def _error(one: Fitted, evidence: Evidence, sealed: Sealed | None, where: str) -> dict[str, Any]:
    relative = one.share if sealed is None else sealed.evidence.share(one.joint)
    return {"relative": relative, "where": where, "in_sample": evidence.share(one.joint)}


def _shown(found: Search, added: bool, quiet: bool) -> list[Row]:
    """The contest beside the joint as it came, with what was added accepted and nothing else."""
    terms, rivals = ({r.effect.family for r in some} for some in (found.terms, found.rivals))
    first = found.terms[0].effect if found.terms else None
    out = []
    for r in found.first.rows:
        if r.status is Status.ACCEPTED and not added:
            word = "nothing is missing" if quiet else "passes, but explains too little to be added"
            r = dataclasses.replace(r, status=Status.REJECTED, reason=word)
        elif added and len(found.terms) > 1 and r.effect is first:
            r = dataclasses.replace(r, status=Status.ACCEPTED, reason="with another effect beside it")
        elif r.status is Status.ACCEPTED and r.effect.family in rivals:
            r = dataclasses.replace(r, status=Status.TIED, reason="does as well as two effects with fewer numbers")
        elif r.status is Status.ACCEPTED and r.effect.family not in terms:
            r = dataclasses.replace(r, status=Status.REJECTED, reason="came first, and another took its place")
        out.append(r)
    return out


def _candidate(r: Row, rank: int, found: Search) -> Candidate:
    fitted = r.fitted
    parameters = {} if fitted is None else _estimates(fitted, found.before.joint)
    share = float(np.clip(r.share, -9.0, 1.0))
    significance = {"loss": float("nan") if fitted is None else fitted.held_out or fitted.loss}
    return Candidate(
        r.effect.family,
        r.effect.member,
        parameters,
        float(sum(r.gains)),
        r.gains,
        significance,
        share,
        None,
        rank,
        r.status,
        r.reason,
    )


def _estimates(fitted: Fitted, before: Joint) -> dict[str, Estimate]:
    """Parameters that a joint has beyond another."""
    joint, known = fitted.joint, set(before.parameters)
    out = {}
    for name, value in joint.parameters.items():
        if name in known:
            continue
        error = joint.covariance.standard_error(name) if joint.covariance is not None else float("nan")
        half = 1.96 * error
        out[name] = Estimate(value, joint.units[name], error, (value - half, value + half))
    return out


def _rival(r: Row, found: Search) -> Rival:
    last = found.terms[-1]
    own = next((t for t in found.terms if t.effect.family in r.effect.look_alikes), last)
    ratio = r.share / last.share if last.share else 1.0
    springs = {own.effect.family, r.effect.family} == {"cubic", "quadratic"}
    told = _MEAN if springs else experiment(own.effect, r.effect)
    return Rival(r.effect.family, ratio, is_declared_pair(own.effect, r.effect), told, r.effect.member)


def _of_unseen_harmonics(found: Search) -> tuple[Rival, ...]:
    """A bent spring that other modes answer at twice the frequency may soften or stiffen with the square of the
    amplitude, like a cubic one; a filter that separates the modes hides what would tell them apart."""
    told = {r.effect.family for r in (*found.terms, *found.rivals)}
    if "cubic" not in told or "quadratic" in told:
        return ()
    return (Rival("quadratic", 1.0, False, _MEAN, "quadratic"),)


def _composition(found: Search) -> tuple[Mapping[str, Any], ...]:
    """Two effects in the order of their entry; what does as well as the last one is its rival."""
    one, two = found.terms
    alone = max((r.share for r in found.first.rows if r.effect.family == two.effect.family), default=0.0)
    further, rivals = found.explained - one.share, [r.effect.family for r in found.rivals]
    return (
        {
            **_named(one),
            "share": one.share,
            "explained": one.share,
            "adds": found.explained - max(alone, 0.0),
            "rivals": [],
        },
        {**_named(two), "share": further, "explained": found.explained, "adds": further, "rivals": rivals},
    )


def _named(r: Row) -> dict[str, str]:
    return {"family": r.effect.family, "member": r.effect.member}


def _mended(
    joint: Joint,
    after: Fitted,
    found: Search,
    verdict: Verdict,
    evidence: Evidence,
    records: Sequence[Record],
    sealed: Sealed | None,
) -> Joint:
    """The joint with what was found, the range it was found on, and what it was found from."""
    provenance = {
        **joint.provenance,
        "traced_on": [f"{r.name} sha256:{r.sha256}" for r in records],
        "effects": [t.effect.family for t in found.terms],
        "verdict": verdict.value,
        "program": f"jointlib {version('jointlib')}",
    }
    if sealed:
        opened = [*joint.provenance.get("seal_opened", []), *(f"{r.name} sha256:{r.sha256}" for r in sealed.records)]
        provenance["seal_opened"] = list(dict.fromkeys(opened))
    omega = evidence.omegas / (2 * np.pi)
    validity = {
        **joint.validity,
        "amplitude": (0.0, float(max(b.amplitude[0] for b in evidence.backbones))),
        "frequency": (float(np.min(omega)), float(np.max(omega))),
    }
    return dataclasses.replace(after.joint, validity=validity, provenance=provenance)
