"""What test cuts say of a machine: the report, its JSON, its words and its picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.cuts.tried_cut import TriedCut
from jointlib.loop.answer.report import Status, Verdict
from jointlib.shown.json_values import plain
from jointlib.shown.pictures import AFTER, axes_of
from jointlib.shown.result import Columns, Shown
from jointlib.shown.tried_cuts import draw_cuts

from ..model.machine import Machine
from .advice import Advice


@dataclass(frozen=True)
class CutCandidate:
    """A suspect as it fared on cuts held out."""

    family: str
    member: str
    parameters: Mapping[str, Mapping[str, Any]]
    """By name: value, unit, and ci95, the 95 % interval."""
    gain_heldout: float
    """Nats over the machine as it is."""
    gain: float
    """ln of how much likelier it makes all cuts than the machine as it is, its prior counted."""
    per_fold: tuple[float, ...]
    effective_size: float
    rank: int
    status: Status
    reason: str
    words: str


@dataclass(frozen=True)
class CutRival:
    """A family that these cuts cannot tell from the chosen one."""

    family: str
    member: str
    behind: float
    """Nats of evidence; below 0 where it leads on too few effective draws."""
    effective_size: float
    words: str

    def apart(self) -> str:
        """How far from the chosen one, in words."""
        if self.behind >= 0:
            return f"{self.behind:.1f} nats behind"
        return f"{-self.behind:.1f} nats ahead on too few draws ({self.effective_size:.0f})"


@dataclass(frozen=True)
class CutTold:
    """A cut with the probabilities that it is stable, from all other cuts: ``before`` the finding and ``after``."""

    name: str
    speed: float
    depth: float
    verdict: str
    chatter_frequency: float | None
    before: float
    after: float
    unexplained: bool
    """Whether its verdict stays improbable before the finding."""


ENTRY = "enter with less feed: large chatter may last below the border, which is that of small vibrations"
"""What is to be said beside a cut that is called safe: the bifurcation is subcritical where teeth leave the work."""


@dataclass(frozen=True, eq=False, repr=False)
class CutTrace(Shown):
    """The whole answer; `as_json` gives the promised keys."""

    verdict: Verdict
    sentence: str
    machine: Machine
    chosen: CutCandidate | None
    candidates: tuple[CutCandidate, ...]
    rivals: tuple[CutRival, ...]
    left_open: tuple[CutRival, ...]
    """Where nothing is named: what the cuts cannot rule out beside the machine as it is."""
    odds: float
    """ln of the odds of all suspects together against the machine as it is."""
    error_before: Mapping[str, Any]
    error_after: Mapping[str, Any]
    next_cut: Advice
    safe_cut: Advice | None
    safe: float
    """Probability that was asked of the safe cut."""
    effective_size: Mapping[str, float]
    """``before`` of the machine as it is, ``after`` of what is named; of ``draws``."""
    strain: Mapping[str, float]
    """Standard errors by which the cuts pull the modes, ``before`` and ``after``."""
    cuts: tuple[CutTold, ...]
    tried: tuple[TriedCut, ...]
    speed: Array
    band_before: Array
    band_after: Array
    depth: Array
    probability: Array
    """Of being stable with the cuts, as is every shallower cut at that speed, (speeds, depths)."""
    asked: float | None
    """Probability that the cut that was asked for is stable; None where none was."""
    warnings: tuple[str, ...]
    not_decidable: tuple[Mapping[str, str], ...]
    repro: Mapping[str, Any]
    changes: Mapping[str, Any]
    """Of the machine file, by path."""

    def as_json(self) -> dict[str, Any]:
        """What ``jointlib trace --json`` prints of cuts."""
        named = {
            name: getattr(self, name)
            for name in (
                *("verdict", "sentence", "chosen", "candidates", "rivals", "left_open", "odds"),
                *("error_before", "error_after", "next_cut"),
                *(
                    "safe_cut",
                    "safe",
                    "effective_size",
                    "strain",
                    "cuts",
                    "warnings",
                    "not_decidable",
                    "repro",
                    "changes",
                ),
            )
        }
        band = {"speed": self.speed, "share": (0.05, 0.5, 0.95), "before": self.band_before, "after": self.band_after}
        chance = {"speed": self.speed, "depth": self.depth, "stable": self.probability}
        out: dict[str, Any] = plain({**named, "band": band, "probability": chance})
        return out

    def finding(self) -> str:
        """The finding in plain words, and the errors on cuts held out."""
        before, after = self.error_before, self.error_after
        said = f"{self.verdict.value.replace('_', ' ')}. {self.sentence}"
        return f"{said}\nright of held-out cuts {100 * before['right']:.0f} % → {100 * after['right']:.0f} %"

    def next_words(self) -> str:
        """The cut to make next, as a sentence."""
        n = self.next_cut
        return (
            f"Cut next at {n.speed:g} rpm and {1e3 * n.depth:.3g} mm: it is stable with probability "
            f"{n.probability:.2f}, and its verdict tells most."
        )

    def words(self) -> list[str]:
        """What ``jointlib trace`` prints of cuts."""
        before, after = self.error_before, self.error_after
        lines = [f"{self.verdict.value}: {self.sentence}"]
        lines.append(
            f"held-out cuts classified rightly: before {100 * before['right']:.0f} %, after "
            f"{100 * after['right']:.0f} %; log score {before['log_score']:.2f}, {after['log_score']:.2f}"
        )
        size = self.effective_size
        lines.append(
            f"effective draws: {size['before']:.0f} of {size['draws']:.0f} before, {size['after']:.0f} after; modes "
            f"pulled by {self.strain['before']:.1f} and {self.strain['after']:.1f} standard errors"
        )
        lines += [f"rival: {r.family} ({r.words}), {r.apart()}" for r in self.rivals]
        if self.left_open:
            families = ", ".join(r.family for r in self.left_open)
            lines.append(f"not ruled out by these cuts: {families}; odds of all suspects {np.exp(self.odds):.2g} to 1")
        lines += [
            f"not explained by the machine as it is: {cut.name}, {cut.verdict}, held to be stable with {cut.before:.2f}"
            for cut in self.cuts
            if cut.unexplained
        ]
        n = self.next_cut
        lines.append(
            f"tells most: {n.speed:g} rpm, {1e3 * n.depth:.3g} mm (stable with probability {n.probability:.2f}, "
            f"{n.bits:.2f} bits)"
        )
        s = self.safe_cut
        lines.append(
            self.none_safe
            if s is None
            else f"most productive at a probability of {self.safe:g}: {s.speed:g} rpm, {1e3 * s.depth:.3g} mm; {ENTRY}"
        )
        return [*lines, *(f"warning: {w}" for w in self.warnings)]

    @property
    def none_safe(self) -> str:
        """Why no cut is told to be safe, where none is."""
        if self.verdict is Verdict.UNEXPLAINED:
            return "no cut is told to be safe: draws that do not explain the cuts tell no probability"
        return f"no cut is stable with a probability of {self.safe:g}"

    def columns(self) -> Columns:
        """A row per candidate."""
        ranked = sorted(self.candidates, key=lambda c: c.rank)
        return {
            "rank": ([c.rank for c in ranked], ""),
            "family": ([c.family for c in ranked], ""),
            "member": ([c.member for c in ranked], ""),
            "gain": ([c.gain for c in ranked], ""),
            "gain_heldout": ([c.gain_heldout for c in ranked], ""),
            "effective_size": ([c.effective_size for c in ranked], ""),
            "status": ([c.status.value for c in ranked], ""),
        }

    def plot(self, ax: Any = None) -> Any:
        """Borders in mm over rpm, 5 to 95 % before and after the cuts, with the cuts as marks and the next one."""
        axes = axes_of(ax)
        for band, colour, name in ((self.band_before, "#9ca3af", "inputs"), (self.band_after, AFTER, "with the cuts")):
            depth = np.where(np.isfinite(band), 1e3 * band, np.nan)
            axes.fill_between(self.speed, depth[0], depth[2], color=colour, alpha=0.25, linewidth=0)
            axes.plot(self.speed, depth[1], color=colour, label=name)
        axes.plot(self.next_cut.speed, 1e3 * self.next_cut.depth, "*", color="black", markersize=10, label="cut next")
        draw_cuts(axes, self.tried)
        return axes
