"""What a trace found: the report, its words and its JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.loop.answer.candidate_picture import draw_candidates, shown_candidates
from jointlib.measurement import Correction, Measurement
from jointlib.shown.json_values import plain
from jointlib.shown.pictures import axes_of
from jointlib.shown.result import Columns, Shown
from jointlib.units import with_error


class Verdict(Enum):
    """How far the evidence carries; the value is the word in files."""

    IDENTIFIED = "identified"
    AMBIGUOUS = "ambiguous"
    PARTIAL = "partial"
    UNEXPLAINED = "unexplained"
    NOTHING_MISSING = "nothing_missing"


class Status(Enum):
    """What became of a candidate."""

    ACCEPTED = "accepted"
    TIED = "tied"
    REJECTED = "rejected"
    UNPHYSICAL = "unphysical"


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect with its 95 % interval."""

    value: float
    unit: str
    standard_error: float
    ci95: tuple[float, float]
    ci_kind: str = "noise"
    """"noise" where the interval is statistical, "model_form" where the shape of the law is the larger doubt."""
    biased: bool = False

    def words(self) -> str:
        """Value, half width of the 95 % interval and unit, as people read them."""
        return with_error(self.value, 1.96 * self.standard_error, self.unit)


@dataclass(frozen=True)
class Candidate:
    """One family as it fared; the best of its members and shapes."""

    family: str
    member: str
    parameters: Mapping[str, Estimate]
    gain_heldout: float
    """Drop of the held-out loss."""
    per_fold: tuple[float, ...]
    significance: Mapping[str, float]
    """z and bic (periodic route), or p_signflip and the standard error of ``share_of_current`` (path route)."""
    share_of_current: float
    """Share of the current held-out excess that the candidate removes."""
    explained: float | None
    rank: int
    status: Status
    reason: str
    channel: str | None = None
    """The sensor, where the effect sits in one."""
    body: str | None = None
    """The body, where a mass is wrong."""

    @property
    def where(self) -> str:
        """The sensor or body, or nothing."""
        return self.channel or self.body or ""


def figures(parameters: Mapping[str, Estimate]) -> str:
    """Parameters in words, without the smoothing that only rounds a corner; those of two elements side by side."""
    named: dict[str, list[str]] = {}
    for name, e in parameters.items():
        named.setdefault(name.split(".", 1)[-1].replace("_", " "), []).append(e.words())
    shown = {name: " + ".join(words) for name, words in named.items() if not name.startswith("smoothing")}
    return ", ".join(f"{name} {words}" for name, words in shown.items())


@dataclass(frozen=True)
class Rival:
    """A family that these data cannot separate from the chosen one."""

    family: str
    gain_ratio: float
    declared_pair: bool
    separating_experiment: str
    member: str = ""
    channel: str | None = None
    body: str | None = None

    @property
    def where(self) -> str:
        """The sensor or body, or nothing."""
        return self.channel or self.body or ""

    @property
    def place(self) -> dict[str, str]:
        """The same by key."""
        return {k: v for k, v in (("channel", self.channel), ("body", self.body)) if v}


@dataclass(frozen=True, repr=False)
class TraceReport(Shown):
    """The whole answer of a trace; :meth:`as_json` gives the promised keys.

    ``mended`` is the joint with the named effect, refitted, or the joint that went in where nothing is named.
    ``plots`` holds arrays for the pictures and is no part of the JSON.
    """

    route: str
    verdict: Verdict
    sentence: str
    """The finding in plain words, and what to do next."""
    baseline: Joint
    mended: Joint
    chosen: Candidate | None
    candidates: tuple[Candidate, ...]
    rivals: tuple[Rival, ...]
    chain: tuple[Mapping[str, Any], ...]
    """Further terms: {family, share, status: hypothesis}."""
    secondary: tuple[Mapping[str, Any], ...]
    error_before: Mapping[str, Any]
    error_after: Mapping[str, Any]
    data: Mapping[str, Any]
    noise_floor: Mapping[str, Any]
    localisation: Mapping[str, Any]
    reduction: Mapping[str, Any]
    resimulation: Mapping[str, Any]
    unexplained: Mapping[str, Any]
    not_decidable: tuple[Mapping[str, str], ...]
    next_experiment: str
    warnings: tuple[str, ...]
    repro: Mapping[str, Any]
    extra_baseline: Mapping[str, Estimate] = field(default_factory=dict)
    """Baseline parameters that are no part of the joint: moving mass, force offset."""
    composition: tuple[Mapping[str, Any], ...] = ()
    """Effects that explain together what none does alone, in the order of their entry."""
    corrections: tuple[Correction, ...] = ()
    """Faults of sensors, masses and rig that were named, to be undone on reading."""
    measurement: Measurement | None = None
    """What was traced."""
    plots: Mapping[str, Array] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The report as JSON values (no NaN, no arrays)."""
        chosen: dict[str, Any] | None = None
        if self.chosen is not None:
            chosen = {
                "family": self.chosen.family,
                "member": self.chosen.member,
                "channel": self.chosen.channel,
                "body": self.chosen.body,
                "params": self.chosen.parameters,
                "explained_first": self.chosen.explained,
            }
        model = [law.kind for law in self.baseline.laws]
        units = self.baseline.units
        baseline = {
            "model": model,
            "params": {k: {"value": v, "unit": units[k]} for k, v in self.baseline.parameters.items()}
            | {k: plain(v) for k, v in self.extra_baseline.items()},
        }
        named = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        for key in ("baseline", "mended", "chosen", "plots", "extra_baseline", "candidates", "measurement"):
            del named[key]
        rows = [plain(c) for c in self.candidates]
        for row in rows:
            row["params"] = row.pop("parameters")
            row.update(row.pop("significance"))
        out: dict[str, Any] = plain({**named, "baseline": baseline, "chosen": chosen})
        return {**out, "candidates": rows}

    def finding(self) -> str:
        """The finding in plain words, and the error before and after."""
        return found_words(self.verdict, self.sentence, self.error_before, self.error_after)

    def columns(self) -> Columns:
        """A row per candidate; ``share`` of the unexplained excess that it removes on what was left out of the fit."""
        return ranked_columns(self.candidates, ("family", "member", "where"))

    def plot(self, ax: Any = None) -> Any:
        """The share of the excess in % that each of the leading candidates removes."""
        axes = axes_of(ax)
        draw_candidates(axes, shown_candidates(self.candidates)[::-1])
        axes.set(ylabel="effect")
        return axes


def ranked_columns(candidates: Sequence[Any], named: Sequence[str]) -> Columns:
    """Candidates by rank: what names them, their share of the excess, what became of them and why."""
    ranked = sorted(candidates, key=lambda c: c.rank)
    columns: dict[str, tuple[Sequence[Any], str]] = {
        name: ([getattr(c, name) for c in ranked], "") for name in ("rank", *named)
    }
    return columns | {
        "share": ([c.share_of_current for c in ranked], ""),
        "status": ([c.status.value for c in ranked], ""),
        "reason": ([c.reason for c in ranked], ""),
    }


def found_words(verdict: Verdict, sentence: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """A verdict with its sentence, and the relative error before and after where both are known."""
    said = f"{verdict.value.replace('_', ' ')}. {sentence}"
    first, last = before.get("relative"), after.get("relative")
    return said if first is None or last is None else f"{said}\nerror {100 * first:.3g} % → {100 * last:.3g} %"
