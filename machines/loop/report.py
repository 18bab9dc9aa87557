"""What a trace of a machine found: the report and its JSON."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from jointlib.arrays import Array, ComplexArray
from jointlib.loop.answer.report import Estimate, Status, Verdict, found_words, ranked_columns
from jointlib.shown.json_values import plain
from jointlib.shown.pictures import axes_of
from jointlib.shown.result import Columns, Shown

from ..model.machine import Machine
from .records import LevelFRF

_KINDS = {"stiffness": "#0b5394", "damping": "#c2410c", "amplitude": "#4d7c0f"}
_WORDS = {"amplitude": "amplitude dependence"}


@dataclass(frozen=True)
class MachineCandidate:
    """One explanation as it fared: a place, and what changes there."""

    place: str
    """Connection or bundle."""
    family: str
    """"refit" for the joint's own parameters, else the effect that its law lacks."""
    member: str
    """Kind of law, where several make one family."""
    parameters: Mapping[str, Estimate]
    """Parameters of the joint as they would become; of a bundle, those of its stiffest row."""
    shift: Mapping[str, float]
    """How far each own parameter moves, in its standard deviations, where the joint has a covariance."""
    gain_heldout: float
    """Drop of Σ abs(residual/deviation)² on what was left out of the fit."""
    per_fold: Mapping[str, float]
    share_of_current: float
    """Share of the unexplained excess that it removes on what was left out."""
    rank: int
    status: Status
    reason: str


@dataclass(frozen=True)
class MachineRival:
    """An explanation that these records cannot tell from the chosen one."""

    place: str
    family: str
    member: str
    gain_ratio: float
    separating_experiment: str
    deviations: float
    """By how many deviations of the noise the two models then differ, at the line where they differ most."""


@dataclass(frozen=True, repr=False)
class MachineTrace(Shown):
    """The whole answer; :meth:`as_json` gives the promised keys.

    ``mended`` is the machine with the named joint changed, or the one that went in where nothing is named. ``plots``
    holds arrays for the pictures and is no part of the JSON.
    """

    verdict: Verdict
    sentence: str
    """The finding in plain words, and what to do next."""
    machine: Machine
    mended: Machine
    place: str | None
    chosen: MachineCandidate | None
    candidates: tuple[MachineCandidate, ...]
    rivals: tuple[MachineRival, ...]
    pointing: Mapping[str, Mapping[str, float]]
    """Per place the share of the excess that a change of stiffness, of damping or of amplitude dependence alone
    would remove."""
    error_before: Mapping[str, Any]
    error_after: Mapping[str, Any]
    noise_floor: Mapping[str, Any]
    warnings: tuple[str, ...]
    next_experiment: str
    not_decidable: tuple[Mapping[str, str], ...]
    repro: Mapping[str, Any]
    records: tuple[LevelFRF, ...]
    plots: Mapping[str, Array | ComplexArray] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The report as JSON values (no NaN, no arrays)."""
        named = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        for key in ("machine", "mended", "plots", "records"):
            del named[key]
        named["records"] = [
            {
                "name": r.name,
                "drive": r.drive,
                "response": r.response,
                "force": r.force,
                "level": r.level,
                "lines": len(r.frequency),
                "deviation_from": r.deviation_from,
                "sealed": r.sealed,
                "sha256": r.sha256,
            }
            for r in self.records
        ]
        out: dict[str, Any] = plain(named)
        return out

    def finding(self) -> str:
        """The finding in plain words, and the error before and after."""
        return found_words(self.verdict, self.sentence, self.error_before, self.error_after)

    def columns(self) -> Columns:
        """A row per candidate; ``share`` of the unexplained excess that it removes on what was left out of the fit."""
        return ranked_columns(self.candidates, ("place", "family", "member"))

    def plot(self, ax: Any = None) -> Any:
        """To which joint the residual points: the share of the excess in % that a change there alone would remove."""
        axes = axes_of(ax)
        draw_pointing(axes, self)
        axes.set(ylabel="connection")
        if self.pointing:
            axes.legend(title="alone, in this joint")
        return axes


def draw_pointing(axes: Any, report: MachineTrace) -> None:
    """Three bars for every joint, the first one at the top."""
    places = list(report.pointing)[::-1]
    for row, place in enumerate(places):
        for k, (kind, colour) in enumerate(_KINDS.items()):
            share = 100 * report.pointing[place].get(kind, 0.0)
            y = row + 0.26 * (1 - k)
            label = _WORDS.get(kind, kind) if row == len(places) - 1 else None
            axes.barh(y, share, height=0.24, color=colour, label=label)
            axes.text(share + 1, y, f"{share:.0f}", va="center", fontsize=8)
    labels = [f"{place}, chosen" if place == report.place else place for place in places]
    axes.set_yticks(range(len(places)), labels)
    axes.tick_params(axis="y", length=0)
    axes.set(xlabel="share of the excess removed [%]", xlim=(0, 108))
    axes.grid(axis="y", visible=False)
