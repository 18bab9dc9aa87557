"""The verdict of the periodic route, and its words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from jointlib.effect import JointEffect
from jointlib.loop.bodies import Rig
from jointlib.loop.naming import NAMED_FROM, NEAREST_FROM, in_words
from jointlib.loop.report import Candidate, Rival, Verdict, figures

BEYOND = {
    "missing-mass": ("P", "a body weighed anew, or a known mass added"),
    "gain": ("P", "the accelerometers back to back, on one body"),
    "delay": ("P", "channels swapped at the recorder"),
    "clipping": ("", "records with a larger range"),
    "sensor-nonlinearity": ("P", "the sensor against a reference at the top level"),
    "rocking-mode": ("a3", "a second lever arm"),
    "stiffness-drift": ("", "the same record cold and warm"),
    "position-stiffness": ("", "another feed speed"),
    "structural-damping": ("", "at least one octave of frequency"),
    "hum": ("P", "a quiet record"),
    "drift": ("P", "a quiet record"),
}
"""Families that this version does not try: the channel that would show them, and what would decide."""


@dataclass(frozen=True)
class Findings:
    """What the verdict is drawn from."""

    before: float
    """E before, on the training records."""
    after_first: float
    """E after the first term alone."""
    by_equation: Mapping[str, float]
    """E before, by equation."""


def verdict_of(found: Findings, term: bool, rivals: int) -> tuple[Verdict, float | None]:
    """The verdict and the share of the excess that the first term explains alone; None where there was no excess."""
    if not term:
        return (Verdict.UNEXPLAINED if found.before > 0 else Verdict.NOTHING_MISSING), None
    named = Verdict.AMBIGUOUS if rivals else Verdict.IDENTIFIED
    if found.before <= 0:
        return named, None
    explained = 1 - found.after_first / found.before
    if explained >= NAMED_FROM or found.after_first <= 0:
        return named, explained
    return (Verdict.PARTIAL if explained >= NEAREST_FROM else Verdict.UNEXPLAINED), explained


def not_decidable(rig: Rig, periods: int, levels: int, records: int) -> tuple[dict[str, str], ...]:
    """Families that these channels or this catalogue cannot decide, why, and what it would need."""
    missing = {"P": not rig.has_balance, "a3": not rig.has_third, "": False}
    rows = []
    for family, (channel, needs) in BEYOND.items():
        if missing[channel]:
            name = "force P (or the driven mass)" if channel == "P" else "acceleration a3"
            rows.append({"family": family, "why": f"no {name}", "needs": f"channel {channel}; {needs}"})
        else:
            rows.append({"family": family, "why": "not in the catalogue of this version", "needs": needs})
    if records < 3:
        rows.append({"family": "all", "why": f"{records} records to fit", "needs": "at least 3 records"})
    if levels < 2:
        rows.append({"family": "all", "why": "one excitation level", "needs": "at least 2, better 3 levels"})
    if periods < 3:
        rows.append({"family": "all", "why": f"{periods} periods a record", "needs": "at least 3 periods"})
    return tuple(rows)


def sentence(
    verdict: Verdict,
    chosen: Candidate | None,
    rivals: Sequence[Rival],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    found: Findings,
) -> str:
    """The finding in plain words with its numbers."""
    where = {"sealed": "on the sealed record", "condition folds": "on records left out of the fit"}.get(
        str(before["where"]), "on the records of the fit"
    )
    drop = (
        f"The joint force residual {where} falls from {before['joint_N']:.3g} N to {after['joint_N']:.3g} N "
        f"({before['relative']:.2%} to {after['relative']:.2%} of the joint force, noise floor "
        f"{after['joint_floor_N']:.3g} N)."
    )
    elsewhere = [e for e in ("balance", "redundancy") if found.by_equation.get(e, 0.0) > 0]
    outside = ""
    if elsewhere:
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
    named = f"{in_words(chosen.family)}: {figures(chosen.parameters)}"
    if verdict is Verdict.PARTIAL:
        return (
            f"The nearest effect is {named}. It explains {chosen.explained or 0:.0%} of what was missing; "
            f"the rest has no name. {drop}{outside}"
        )
    if verdict is Verdict.AMBIGUOUS:
        others = " or ".join(in_words(r.family) for r in rivals)
        return f"The joint lacks {named}. These records cannot rule out {others}. {drop}{outside}"
    return f"The joint lacks {named}. {drop}{outside}"


def next_experiment(verdict: Verdict, rivals: Sequence[Rival], chosen: JointEffect | None, found: Findings) -> str:
    """What to do next."""
    if rivals:
        return rivals[0].separating_experiment
    if verdict is Verdict.NOTHING_MISSING:
        return "None needed at these levels; a higher level would show what these do not reach."
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
