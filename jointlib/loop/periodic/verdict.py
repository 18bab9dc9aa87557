"""The verdict of the periodic route, and its words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jointlib.effect import JointEffect
from jointlib.fault import Fault
from jointlib.joint import Joint
from jointlib.loop.answer.naming import NAMED_ON_A_RIG_FROM, NEAREST_FROM, in_words, is_of_joint, with_sizes
from jointlib.loop.answer.report import Candidate, Rival, Verdict
from jointlib.loop.periodic.readings import Readings

WHERE = {
    "sealed": "on the sealed record",
    "condition folds": "on records left out of the fit",
    "in sample": "on the records of the fit",
}
"""Where an error counts, in words."""


@dataclass(frozen=True)
class Findings:
    """What the verdict is drawn from."""

    table: Mapping[str, Mapping[str, Any]]
    """Excess by equation and class of line, before."""
    before: float
    """E before, on the training records."""
    after_first: float
    """E after the first term alone."""
    by_equation: Mapping[str, float]
    """E before, by equation."""
    together: float | None = None
    """Share of E before that all terms explain, where they are named together as none is alone."""


def verdict_of(found: Findings, term: bool, rivals: int) -> tuple[Verdict, float | None]:
    """The verdict and the share of the excess that the first term explains alone; None where there was no excess."""
    if not term:
        return (Verdict.UNEXPLAINED if found.before > 0 else Verdict.NOTHING_MISSING), None
    named = Verdict.AMBIGUOUS if rivals else Verdict.IDENTIFIED
    if found.before <= 0:
        return named, None
    explained = 1 - found.after_first / found.before
    if explained >= NAMED_ON_A_RIG_FROM or found.after_first <= 0 or found.together is not None:
        return named, explained
    return (Verdict.PARTIAL if explained >= NEAREST_FROM else Verdict.UNEXPLAINED), explained


def not_decidable(data: Readings, faults: Sequence[Fault]) -> tuple[dict[str, str], ...]:
    """Families that these channels or records cannot decide, why, and what it would need."""
    rig = data.rig
    lacking = {"P": not rig.has_balance, "a3": not rig.has_third}
    words = {"P": "force P (or the driven mass)", "a3": "acceleration a3"}
    rows = []
    for fault in faults:
        missing = [c for c in sorted(fault.needs) if lacking.get(c)]
        if missing:
            why = " and ".join(words[c] for c in missing)
            needs = f"channel {' and '.join(missing)}" + (f"; {fault.experiment}" if fault.experiment else "")
            rows.append({"family": fault.family, "why": f"no {why}", "needs": needs})
    spectra = [raw.spectra for raw in data.training]
    levels, periods = len({s.condition for s in spectra}), min(s.periods for s in spectra)
    excited = data.band[2] / data.band[1]
    if excited < 1.2:
        needs = "a multisine over at least one octave"
        rows.append(
            {
                "family": "missing-mass, suspension, gain",
                "why": "narrow band: all linear effects look alike",
                "needs": needs,
            }
        )
    if excited < 2:
        needs = "at least one octave of frequency"
        rows.append({"family": "structural-damping, relaxation", "why": "one frequency band", "needs": needs})
    if len(spectra) < 3:
        rows.append({"family": "all", "why": f"{len(spectra)} records to fit", "needs": "at least 3 records"})
    if levels < 2:
        rows.append({"family": "all", "why": "one excitation level", "needs": "at least 2, better 3 levels"})
    if periods < 3:
        rows.append({"family": "all", "why": f"{periods} periods a record", "needs": "at least 3 periods"})
    return tuple(rows)


def sentence(
    verdict: Verdict,
    chosen: Candidate | None,
    further: Sequence[Candidate],
    rivals: Sequence[Rival],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    found: Findings,
    joint: Joint,
) -> str:
    """The finding in plain words with its numbers; ``further`` entered the mended files beside the chosen one."""
    where = WHERE[before["where"]]
    drop = (
        f"The joint force residual {where} falls from {before['joint_N']:.3g} N to {after['joint_N']:.3g} N "
        f"({before['relative']:.2%} to {after['relative']:.2%} of the joint force, noise floor "
        f"{after['joint_floor_N']:.3g} N)."
    )
    elsewhere = [e for e in ("balance", "redundancy") if found.by_equation.get(e, 0.0) > 0]
    outside = ""
    if elsewhere and all(is_of_joint(c.family) for c in (chosen, *further) if c is not None):
        outside = (
            f" The residual of the {' and the '.join(elsewhere)} equation exceeds its noise: these contain no joint "
            "law, so a mass or a sensor is wrong there."
        )
    if verdict is Verdict.NOTHING_MISSING:
        return (
            f"Nothing is missing: {where} the residual is {before['joint_N']:.3g} N "
            f"({before['relative']:.2%} of the joint force), its noise {before['joint_floor_N']:.3g} N, "
            f"chi-square {before['chi2']:.2f}."
        )
    if chosen is None or verdict is Verdict.UNEXPLAINED:
        if found.by_equation.get("joint", 0.0) <= 0 and elsewhere:
            return f"The joint law leaves nothing unexplained in its own equation, but another does not close.{outside}"
        near = f" The nearest, {chosen.family}, explains {chosen.explained or 0:.0%}." if chosen is not None else ""
        return (
            f"Something is missing that no effect of the catalogue explains: {where} the joint force residual is "
            f"{before['joint_N']:.3g} N ({before['relative']:.2%} of the joint force), its noise "
            f"{before['joint_floor_N']:.3g} N.{near}{outside}"
        )
    lacks = "The joint lacks" if is_of_joint(chosen.family) else "The records show"
    named, *others_named = (with_sizes(c, joint) for c in (chosen, *further))
    others = " or ".join(dict.fromkeys(in_words(r.family, r.where, r.member) for r in rivals))
    doubt = f" These records cannot rule out {others}." if others else ""
    if found.together is not None:
        share = f"{found.together:.1%} of what was missing, the first alone {chosen.explained or 0:.0%}"
        return f"Missing are {'; '.join([named, *others_named])}. Together they explain {share}.{doubt} {drop}{outside}"
    named += "; beside it, " + "; and ".join(others_named) if others_named else ""
    if verdict is Verdict.PARTIAL:
        return (
            f"The nearest effect is {named}. It explains {chosen.explained or 0:.0%} of what was missing; "
            f"the rest has no name. {drop}{outside}"
        )
    return f"{lacks} {named}.{doubt} {drop}{outside}"


def next_experiment(
    verdict: Verdict, rivals: Sequence[Rival], chosen: JointEffect | Fault | None, found: Findings
) -> str:
    """What to do next."""
    if rivals:
        return rivals[0].separating_experiment
    if verdict is Verdict.NOTHING_MISSING:
        return "None needed at these levels; a higher level would show what these do not reach."
    if verdict is Verdict.IDENTIFIED and chosen is not None and not is_of_joint(chosen.family):
        return "Repair or calibrate it and repeat one record; until then the mended measurement file undoes it."
    outside = [e for e in ("balance", "redundancy") if found.by_equation.get(e, 0.0) > 0]
    if "balance" in outside:
        return "Weigh the bodies, calibrate the accelerometers back to back and the force sensor against a known mass."
    if outside:
        return "Put both accelerometers of the passive side on one spot and repeat: their difference must vanish."
    if verdict is Verdict.IDENTIFIED:
        return "Confirm on a new record at another level."
    if chosen is not None and chosen.look_alikes:
        return next(iter(chosen.look_alikes.values()))
    return "Record a slow loop of force over displacement: it shows the shape of the missing force directly."
