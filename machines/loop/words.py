"""The finding in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.loop.answer.report import Verdict, figures

from .fallback import FAMILY
from .judge import Judgement
from .report import MachineCandidate, MachineRival

_WHERE = {
    "sealed": "on the sealed record",
    "levels left out": "on levels left out of the fit",
    "lines left out": "on lines left out of the fit",
}
NOT_DECIDABLE = (
    {
        "family": "quadratic, viscous-by-direction",
        "why": "their first harmonic about a zero mean is that of no effect, or of a viscous damper",
        "needs": "second harmonics, or the mean displacement, beside the FRFs",
    },
    {
        "family": "contact-loss: on which side; gap or a one-sided stop",
        "why": "the first harmonic about a zero mean is the same",
        "needs": "second harmonics, or the mean displacement, beside the FRFs",
    },
    {
        "family": "gain, delay, missing-mass, rocking-mode",
        "why": "an FRF alone does not tell its sensors and the parts of the machine from their calibration",
        "needs": "a calibration mass under the same sensors, and a weighing of the parts",
    },
    {
        "family": "stiffness-drift, position-stiffness",
        "why": "an FRF is an average over its time and place",
        "needs": "repeated records in a known order, and at several positions",
    },
)
"""Families that FRFs of the first harmonic cannot decide."""


def change(candidate: MachineCandidate) -> str:
    """A candidate in words."""
    what = f"{candidate.family} ({candidate.member})" if candidate.member not in ("", candidate.family) else ""
    what = what or candidate.family
    if candidate.family == "refit":
        return f"its own parameters: {figures(candidate.parameters)}"
    last = candidate.member.replace("-", "_") or candidate.family.replace("-", "_")
    added = {k: v for k, v in candidate.parameters.items() if k.split(".")[0].startswith(last)}
    return f"{what}: {figures(added)}"


def sentence(
    verdict: Verdict,
    chosen: MachineCandidate | None,
    rivals: Sequence[MachineRival],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    judgement: Judgement,
    vetoed: bool = False,
) -> str:
    """What was found, with its numbers."""
    where = _WHERE[before["where"]]
    share = f"{judgement.explained or 0:.0%}"
    if judgement.beyond is not None:
        share += f" of what was missing, {judgement.beyond:.0%} of what other parameters of that joint would leave"
    else:
        share += " of what was missing"
    if verdict is Verdict.NOTHING_MISSING:
        return (
            f"Nothing is missing: {where} the FRFs differ from the machine's by {before['relative']:.2%}, "
            f"chi-square {before['chi2']:.2f}."
        )
    if chosen is None or verdict is Verdict.UNEXPLAINED:
        near = f" The nearest, {chosen.place}, explains {share}." if chosen is not None else ""
        near += " It does not hold on the sealed record and is withdrawn." if vetoed else ""
        return (
            f"Something is missing that no single joint of the machine explains: {where} the FRFs differ from the "
            f"machine's by {before['relative']:.2%}, chi-square {before['chi2']:.2f}.{near}"
        )
    goes = "falls" if after["relative"] < before["relative"] else "goes"
    drop = (
        f"The error {where} {goes} from {before['relative']:.2%} to {after['relative']:.2%} "
        f"(chi-square {before['chi2']:.1f} to {after['chi2']:.2f})."
    )
    named = f"connection {chosen.place}, {change(chosen)}"
    far = {k: v for k, v in chosen.shift.items() if abs(v) > 3}
    beyond = ""
    if chosen.shift:
        worst = max(chosen.shift.values(), key=abs)
        beyond = (
            f" Its parameters leave the range they were identified in ({worst:+.1f} standard deviations at most)."
            if far
            else f" They stay within the covariance they were identified with ({worst:+.1f} standard deviations)."
        )
    alike = " or ".join(f"{r.place} ({r.member or r.family})" for r in rivals)
    others = f" These records cannot rule out {alike}." if rivals else ""
    if chosen.family == FAMILY:
        near = ""
        if judgement.nearest is not None:
            law, part = judgement.nearest
            near = f" The nearest law, {law.family}, would explain {part:.0%} of what was missing."
        return (
            f"The FRFs point to connection {chosen.place}, and no law of the catalogue fits: its stiffness and damping "
            f"over amplitude are given by table, without a cause. The table explains {share}.{near} {drop}{beyond}"
        )
    if verdict is Verdict.PARTIAL:
        return f"The FRFs point to {named}. It explains {share}; the rest has no name.{others} {drop}{beyond}"
    return f"The FRFs point to {named}.{others} {drop}{beyond}"
