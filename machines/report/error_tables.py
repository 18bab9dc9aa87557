"""How large the error is before and after: equation by equation beside the noise, run forward, record by record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointlib.loop.answer.report import TraceReport, figures

from .effect_tables import percent
from .figures.residual_figures import where_words
from .page import Section, Table
from .parameter_table import parameter_table


def error_part(report: TraceReport) -> Section:
    """Error per equation before, after and of the noise; the rig run forward; term by term."""
    before, after = report.error_before, report.error_after
    rows: list[tuple[str, ...]] = []
    hidden: list[tuple[str, ...]] = []
    floors = {**after, "chi2_floor": 1.0, "relative_floor": _force_floor(report)}
    for name, key, floor in (
        ("joint law, rms [N]", "joint_N", "joint_floor_N"),
        ("force balance, rms [N]", "balance_N", "balance_floor_N"),
        ("a2 against a3, rms [m/s²]", "redundancy_ms2", "redundancy_floor_ms2"),
        ("chi-square", "chi2", "chi2_floor"),
        ("error relative to the force", "relative", "relative_floor"),
        ("… of the joint as given", "as_given", None),
        ("… in sample", "in_sample", None),
        ("… held out by condition", "heldout_condition", None),
        ("… held out by block", "heldout_block", None),
    ):
        old, new = before.get(key), after.get(key)
        if old is None:
            continue
        write = percent if key in ("relative", "in_sample", "as_given") or key.startswith("heldout") else _plain
        noise = floors.get(floor) if floor else None
        (hidden if key == "chi2" else rows).append(
            (name, write(old), *("–" if v is None else write(v) for v in (new, noise)))
        )
    header = ("", "before", "after", "noise floor")
    tables = [Table(header, rows, f"Error {where_words(before)}")]
    if hidden:
        tables.append(Table(header, hidden, "Squares of the whitened residual, over their number", "Chi-square"))
    known = [(k, r) for k, r in report.resimulation.items() if isinstance(r, Mapping)]
    if known:
        lines = [(k, *(_percent_or(r.get(w)) for w in ("before", "after")), str(r.get("reason", ""))) for k, r in known]
        caption = "Simulated again under the measured force: error"
        tables.append(Table(("channel", "before", "after", ""), lines, caption))
    tables += [t for t in (_record_table(before, after), step_table(report)) if t is not None]
    tables.append(parameter_table(report.mended, "The joint that is written"))
    return Section("How large is the error, before and after?", tables=tables)


def _force_floor(report: TraceReport) -> float | None:
    """Noise over force: of the joint equation of a rig, or from repeated cycles along a path."""
    after = report.error_after
    if after.get("joint_force_N"):
        return float(after["joint_floor_N"] / after["joint_force_N"])
    known = [f for f in report.noise_floor.get("force_rel_per_record", {}).values() if f is not None]
    return float(np.sqrt(np.mean(np.square(known)))) if known else None


def _record_table(before: Mapping[str, Any], after: Mapping[str, Any]) -> Table | None:
    key = "per_sealed_record" if before.get("per_sealed_record") else "per_record"
    pairs = list(zip(before.get(key, ()), after.get(key, ()), strict=False))
    rows = [(str(b["record"]), percent(b["relative"]), percent(a["relative"])) for b, a in pairs]
    return Table(("record", "before", "after"), rows, "Relative error record by record") if len(rows) > 1 else None


def step_table(report: TraceReport) -> Table | None:
    """How the error fell term by term, where the route tells it."""
    rows = []
    for step in report.reduction.get("steps", ()):
        errors = (_percent_or(step[k]) for k in ("in_sample", "heldout_condition", "heldout_block"))
        rows.append(
            (f"+ {step['family']}" if step["family"] else "model as given", *errors, figures(step["parameters"]))
        )
    header = ("step", "in sample", "held out by condition", "by block", "parameters then, with 95 % intervals")
    return Table(header, rows, "Term by term") if rows else None


def _percent_or(value: float | None) -> str:
    return "–" if value is None else percent(value)


def _plain(value: float) -> str:
    return f"{value:.4g}"
