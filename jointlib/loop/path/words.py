"""What a path trace says: the verdict, the sentence, what these data cannot decide, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.joint import Joint
from jointlib.loop.answer.following import changes_in_words, unfollowed
from jointlib.loop.answer.naming import NAMED_FROM, NEAREST_FROM
from jointlib.loop.answer.report import Candidate, Estimate, Rival, Verdict, figures
from jointlib.loop.path.composed.follower import Follower
from jointlib.loop.path.evidence import Evidence
from jointlib.loop.path.strokes import FEWEST_BLOCKS
from jointlib.loop.path.trials import Effect
from jointlib.measurement import Measurement, Record
from jointlib.path_fault import PathFault

WHERE = {
    "sealed": "on the sealed record",
    "condition folds": "on conditions left out of the fit",
    "block folds": "on parts left out of the fit",
}
"""Where an error counts, in words."""
_NOISE = {"cycles": "repeated cycles differ by", "band": "above the band of the motion the force holds noise of"}
"""Where a floor comes from, in words."""


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


def said(effect: Effect) -> str:
    """An effect as it says itself in a sentence."""
    return effect.words or effect.family


def named(effect: Effect, parameters: Mapping[str, Estimate], joint: Joint | None) -> str:
    """An effect with its sizes; of a modulation in ``joint`` the change of the parameter at each value of the input."""
    changes = changes_in_words(parameters, joint) if joint is not None and isinstance(effect, Follower) else None
    return f"{said(effect)}: {changes or figures(parameters)}".rstrip(": ")


def doubts(rivals: Sequence[Effect]) -> list[str]:
    """Rivals as they are said: the first member of each family, and how many others of it."""
    out = []
    for family in dict.fromkeys(e.family for e in rivals):
        members = [e for e in rivals if e.family == family]
        others = len(members) - 1
        out.append(said(members[0]) + (f" or {others} other kind{'s' * (others > 1)} of {family}" if others else ""))
    return out


def sentence(
    verdict: Verdict,
    effect: Effect | None,
    chosen: Candidate | None,
    rivals: Sequence[str],
    further: Sequence[str],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    floor: float | None,
    source: str,
    together: float | None = None,
    joint: Joint | None = None,
) -> str:
    """The finding in plain words with its numbers; ``together`` is what ``effect`` and ``further`` explain of the
    excess where none does alone, ``joint`` is the mended one."""
    where = WHERE[before["where"]]
    noise = "its noise is unknown" if floor is None else f"{_NOISE[source]} {100 * floor:.2g}%"
    if verdict is Verdict.NOTHING_MISSING:
        return f"Nothing is missing: {where} {before['relative']:.2%} of the force is unexplained, and {noise}."
    if verdict is Verdict.UNEXPLAINED:
        near = f" The nearest, {chosen.family}, explains {chosen.explained or 0:.0%}." if chosen else ""
        return (
            f"No effect of the catalogue explains what is left: {where} {before['relative']:.2%} of the force, "
            f"and {noise}.{near}"
        )
    assert chosen is not None
    assert effect is not None
    with_sizes = named(effect, chosen.parameters, joint)
    drop = f"Unexplained {where}: {before['relative']:.2%} of the force before, {after['relative']:.2%} after; {noise}."
    doubt = f" These records cannot rule out {' or '.join(rivals)}." if rivals else ""
    if not rivals and verdict is Verdict.AMBIGUOUS:
        doubt = " One trajectory was repeated, so the shape of the effect is not tested."
    if together is not None:
        kind = "The nearest effects are" if verdict is Verdict.PARTIAL else "Missing are"
        listed = "; ".join([with_sizes, *further])
        share = f"{together:.0%} of what was missing, the first alone {chosen.explained or 0:.0%}"
        return f"{kind} {listed}. Together they explain {share}.{doubt} {drop}"
    if verdict is Verdict.PARTIAL:
        share = f"{chosen.explained or 0:.0%} of what was missing"
        return f"The nearest effect is {with_sizes}. It explains {share}.{doubt} {drop}"
    also = f" With it, {' and '.join(further)}." if further else ""
    begin = "The records show" if isinstance(effect, PathFault) else "The joint lacks"
    return f"{begin} {with_sizes}.{also}{doubt} {drop}"


def next_experiment(verdict: Verdict, rivals: Sequence[Rival], chosen: Effect | None, several: bool) -> str:
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


def not_decidable(
    evidence: Evidence, faults: Sequence[PathFault], missing: Mapping[str, str]
) -> tuple[dict[str, str], ...]:
    """Families that a force along this path cannot show; ``missing`` says what faults ask for in vain."""
    absorbed = "the joint's parameters absorb it"
    rows = [
        {"family": "gain", "why": absorbed, "needs": "sensors calibrated against a known load and length"},
        {"family": "structural-damping", "why": "it has no force in time", "needs": "a rig with periodic excitation"},
    ]
    if evidence.carriage is not None:
        needs = "the carriage weighed, or a known mass added"
        rows.insert(1, {"family": "missing-mass", "why": absorbed, "needs": needs})
    rows += [
        {"family": f.family, "why": missing[f.requires], "needs": f.experiment} for f in faults if f.requires in missing
    ]
    if not evidence.floor.known:
        rows.append({"family": "all", "why": "noise floor unknown", "needs": "at least 3 repetitions of a cycle"})
    if len(evidence.division.conditions) < 2:
        rows.append({"family": "all", "why": "one trajectory", "needs": "at least 2, better 3 speeds or levels"})
    if len(evidence.rows) < FEWEST_BLOCKS:
        why = f"{len(evidence.rows)} blocks to hold out, so chance cannot be ruled out to 1 %"
        rows.append({"family": "all", "why": why, "needs": f"at least {FEWEST_BLOCKS} strokes, periods or records"})
    return tuple(rows)


def volts(measurement: Measurement) -> list[str]:
    """That a motion or force is in volts; a control voltage takes no part in the balance of forces."""
    quantities = sorted({c.quantity for c in measurement.channels if c.unit == "V" and c.quantity != "voltage"})
    if not quantities:
        return []
    return [f"Channels are in volts: {' and '.join(quantities)}; parameters are in units of the circuit."]


def warnings_of(
    evidence: Evidence, measurement: Measurement, ignored: Sequence[str], records: Sequence[Record]
) -> list[str]:
    """What a reader must know about these data."""
    out = []
    if len(evidence.division.conditions) < 2:
        out.append("shape_not_tested: one trajectory is repeated, so hold-out tests the noise but not the shape.")
    if len(evidence.rows) < FEWEST_BLOCKS:
        out.append(f"Only {len(evidence.rows)} blocks to hold out; a chance of 1 % cannot be shown with so few.")
    if not evidence.floor.known:
        p = evidence.runs[0].preparation
        out.append(
            "The noise floor is unknown (no cycle is repeated three times within a record, the "
            f"{p.edge / p.sample_rate:.2g} s at either end left out, which the filter takes): "
            "everything unexplained counts."
        )
    out += volts(measurement)
    for r in records:
        for c in measurement.channels:
            if count := c.at_full_scale(r.channels[c.name]):
                out.append(f"{r.name}: {count} samples of {c.name} are at the end of its range; they may be clipped.")
    out += unfollowed(measurement.channels)
    if ignored:
        out.append(f"Columns not used: {', '.join(ignored)}.")
    if measurement.simulated:
        out.append("The records are simulated.")
    return out
