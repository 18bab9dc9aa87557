"""What a path trace says: the verdict, the sentence, what these data cannot decide, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.effect import JointEffect
from jointlib.loop.naming import NAMED_FROM, NEAREST_FROM, in_words
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.report import Candidate, Rival, Verdict, figures


def verdict_of(explained: float | None, rivals: int, quiet: bool, several_conditions: bool) -> Verdict:
    """The verdict; ``explained`` is the share of the excess that the first term removes alone, None without one.

    One trajectory repeated never shows a shape, so the best it allows is ``ambiguous``.
    """
    if explained is None:
        return Verdict.NOTHING_MISSING if quiet else Verdict.UNEXPLAINED
    if explained < NEAREST_FROM:
        return Verdict.UNEXPLAINED
    if explained < NAMED_FROM:
        return Verdict.PARTIAL
    return Verdict.IDENTIFIED if several_conditions and not rivals else Verdict.AMBIGUOUS


def sentence(
    verdict: Verdict,
    chosen: Candidate | None,
    rivals: Sequence[Rival],
    further: Sequence[str],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    floor: float | None,
) -> str:
    """The finding in plain words with its numbers."""
    where = {
        "sealed": "on the sealed record",
        "condition folds": "on conditions left out of the fit",
        "block folds": "on parts left out of the fit",
    }[before["where"]]
    noise = "its noise is unknown" if floor is None else f"repeated cycles differ by {floor:.2%}"
    if verdict is Verdict.NOTHING_MISSING:
        return f"Nothing is missing: {where} {before['relative']:.2%} of the force is unexplained, and {noise}."
    if verdict is Verdict.UNEXPLAINED:
        near = f" The nearest, {chosen.family}, explains {chosen.explained or 0:.0%}." if chosen else ""
        return (
            f"No effect of the catalogue explains what is left: {where} {before['relative']:.2%} of the force, "
            f"and {noise}.{near}"
        )
    assert chosen is not None
    named = f"{in_words(chosen.family)}: {figures(chosen.parameters)}"
    drop = f"Unexplained {where}: {before['relative']:.2%} of the force before, {after['relative']:.2%} after; {noise}."
    if verdict is Verdict.PARTIAL:
        share = f"{chosen.explained or 0:.0%} of what was missing"
        return f"The nearest effect is {named}. It explains {share}. {drop}"
    also = f" With it, {' and '.join(in_words(f) for f in further)}." if further else ""
    doubt = ""
    if rivals:
        doubt = f" These records cannot rule out {' or '.join(in_words(r.family) for r in rivals)}."
    elif verdict is Verdict.AMBIGUOUS:
        doubt = " One trajectory was repeated, so the shape of the effect is not tested."
    return f"The joint lacks {named}.{also}{doubt} {drop}"


def next_experiment(verdict: Verdict, rivals: Sequence[Rival], chosen: JointEffect | None, several: bool) -> str:
    """What to do next."""
    if rivals:
        return rivals[0].separating_experiment
    if not several:
        return "Repeat at two more speeds or amplitudes, so that the shape of an effect can be tested."
    if verdict is Verdict.NOTHING_MISSING:
        return "None needed at these speeds and levels; others would show what these do not reach."
    if verdict is Verdict.IDENTIFIED:
        return "Confirm on a new record at another speed or level."
    if chosen is not None and chosen.look_alikes:
        return next(iter(chosen.look_alikes.values()))
    return "Record a slow loop of force over displacement: it shows the shape of the missing force directly."


def not_decidable(evidence: Evidence) -> tuple[dict[str, str], ...]:
    """Families that a force along a path cannot show, or that this version does not try."""
    absorbed = "the joint's parameters absorb it"
    rows = [
        {"family": "gain", "why": absorbed, "needs": "sensors calibrated against a known load and length"},
        {"family": "missing-mass", "why": absorbed, "needs": "the carriage weighed, or a known mass added"},
    ]
    rows += [
        {"family": family, "why": "not in the catalogue of this version", "needs": needs}
        for family, needs in (
            ("lag", "two speeds, and the delay of the force channel"),
            ("drift", "the same record at the start and the end of a session"),
            ("position-stiffness", "the same cycle at another place of the travel"),
        )
    ]
    if not evidence.floor.known:
        rows.append({"family": "all", "why": "noise floor unknown", "needs": "at least 3 repetitions of a cycle"})
    if len(evidence.division.conditions) < 2:
        rows.append({"family": "all", "why": "one trajectory", "needs": "at least 2, better 3 speeds or levels"})
    return tuple(rows)


def warnings_of(evidence: Evidence, units: Sequence[str], ignored: Sequence[str], simulated: bool) -> list[str]:
    """What a reader must know about these data."""
    out = []
    if len(evidence.division.conditions) < 2:
        out.append("shape_not_tested: one trajectory is repeated, so hold-out tests the noise but not the shape.")
    if len(evidence.rows) < 8:
        out.append(f"Only {len(evidence.rows)} blocks to hold out; a chance of 1 % cannot be shown with so few.")
    if not evidence.floor.known:
        out.append("The noise floor is unknown (no cycle is repeated three times): everything unexplained counts.")
    if "V" in units:
        out.append("Channels are in volts: displacement, force and parameters are in units of the circuit.")
    if ignored:
        out.append(f"Columns not used: {', '.join(ignored)}.")
    if simulated:
        out.append("The records are simulated.")
    return out
