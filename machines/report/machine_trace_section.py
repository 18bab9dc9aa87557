"""What a trace of a machine found, in the order of a reader's questions."""

from __future__ import annotations

import numpy as np

from jointlib.joint import Joint
from jointlib.loop.answer.report import Verdict, figures
from jointlib.units import rounded, shown

from ..components.connection import Connection
from ..loop.report import MachineCandidate, MachineTrace
from .effect_tables import percent
from .figures.machine_trace_figures import pointing_figure, residual_maps, response_figures
from .page import Figure, Section, Table

_MEANING = {
    Verdict.IDENTIFIED: "Identified: a change of one joint explains the excess, and no other does as well.",
    Verdict.AMBIGUOUS: "Ambiguous: a change of one joint explains the excess, but these records cannot tell it from "
    "its rivals.",
    Verdict.PARTIAL: "Partial: one joint explains a good part, the rest has no name; take it for a hypothesis.",
    Verdict.UNEXPLAINED: "Unexplained: something is missing, and no single joint explains it. The machine is "
    "unchanged.",
    Verdict.NOTHING_MISSING: "Nothing missing: what the machine leaves of these responses is noise.",
}
_MOST = 10


def machine_trace_section(report: MachineTrace) -> Section:
    """Where the responses of the machine differ from the measured ones, which joint that points to, what is left."""
    parts = [_joint(report), _fit(report), _place(report), _contest(report), _errors(report), _limits(report)]
    return Section(
        "Closing the loop", [_MEANING[report.verdict]], parts=[p for p in parts if p.text or p.figures or p.tables]
    )


def _joint(report: MachineTrace) -> Section:
    """The named joint before and after, and its rivals."""
    tables = []
    if report.place is not None:
        both = [
            (new, old)
            for new, old in zip(report.mended.flexible, report.machine.flexible, strict=True)
            if new.joint is not old.joint
        ]
        first = {new.rotates: (new, old) for new, old in reversed(both)}
        for new, old in first.values():
            if new.joint is not None and old.joint is not None:
                of = report.place if len(both) == 1 else f"{new.name}, the first of {len(both)} rows"
                tables.append(_mended_table(old.joint, new.joint, of, new))
    if report.rivals:
        header = ("rival", "change", "gain against the chosen one", "measurement that separates them")
        listed = [(r.place, r.family, percent(r.gain_ratio), r.separating_experiment) for r in report.rivals]
        tables.append(Table(header, listed, "Rivals: these records cannot rule them out"))
    return Section("Which joint, and what changes in it", tables=tables)


def _mended_table(old: Joint, new: Joint, of: str, at: Connection) -> Table:
    """Parameters of a joint before and after, in the units people read."""
    rows, before, units = [], old.parameters, new.units
    for name, value in new.parameters.items():
        factor, unit = shown(at.own_unit(units[name]))
        error = new.covariance.standard_error(name) if new.covariance else np.nan
        was = f"{before[name] * factor:.6g}" if name in before else "–"
        told, spread = rounded(value * factor, error * factor, 6)
        rows.append((name, was, told, spread or ("as before" if name in before else "–"), unit))
    return Table(("parameter", "before", "after", "standard error", "unit"), rows, f"The mended joint of {of}")


def _fit(report: MachineTrace) -> Section:
    return Section("Does the machine follow the measurement?", figures=response_figures(report))


def _place(report: MachineTrace) -> Section:
    maps = residual_maps(report)
    return Section("Where does the residual sit, and where does it point?", figures=[*maps, *_pointing(report)])


def _pointing(report: MachineTrace) -> list[Figure]:
    return [pointing_figure(report)] if report.pointing else []


def _contest(report: MachineTrace) -> Section:
    """The leading candidates in order."""
    ranked = sorted(report.candidates, key=lambda c: c.rank)
    rows = [_row(c) for c in ranked[:_MOST]]
    if not rows:
        return Section("How the candidates fared")
    rest = len(ranked) - len(rows)
    caption = "Gain: share of the excess removed on what was left out of the fit."
    caption += f" {rest} more are in trace.json." if rest > 0 else ""
    header = ("", "joint", "change", "parameters", "gain", "status", "why")
    return Section("How the candidates fared", tables=[Table(header, rows, caption)])


def _row(c: MachineCandidate) -> tuple[str, ...]:
    change = "its own parameters" if c.family == "refit" else c.family
    gain = percent(c.share_of_current) if c.share_of_current > 0 else "none"
    return str(c.rank), c.place, change, figures(c.parameters), gain, c.status.value, c.reason


def _errors(report: MachineTrace) -> Section:
    """Error before and after, over all and record by record."""
    before, after, floor = report.error_before, report.error_after, report.noise_floor
    rows = [(f"error, {before['where']}", percent(before["relative"]), percent(after["relative"]))]
    rows.append(("error in sample", percent(before["in_sample"]), percent(after["in_sample"])))
    rows.append(("chi-square (1 is noise)", f"{before['chi2']:.4g}", f"{after['chi2']:.4g}"))
    if "relative" in floor:
        rows.append(("noise of the records", percent(floor["relative"]), ""))
    tables = [Table(("", "before", "after"), rows, "Rms of the residual over rms of the measured response")]
    then = {r["name"]: r for r in after["per_record"]}
    lines = []
    for r in before["per_record"]:
        now = then.get(r["name"], r)
        sizes = (percent(r["relative"]), percent(now["relative"]), f"{r['chi2']:.4g}", f"{now['chi2']:.4g}")
        lines.append((r["name"], f"{r['force']:.4g}", *sizes))
    header = ("record", "force [N]", "error before", "error after", "chi-square before", "chi-square after")
    tables.append(Table(header, lines, f"Record by record, {before['where']}"))
    if floor.get("drift"):
        drift = [(r["name"], f"{100 * r['frequency']:+.3f} %", f"{100 * r['level']:+.2f} %") for r in floor["drift"]]
        said = "What differs from one record to the next beside the others, and is taken for no effect"
        tables.append(Table(("record", "natural frequencies", "level"), drift, said))
    return Section("How large is the error, before and after?", tables=tables)


def _limits(report: MachineTrace) -> Section:
    """What these records cannot decide, and what to measure next."""
    text = [f"Next: {report.next_experiment}"] if report.next_experiment else []
    rows = [(n["family"], n["why"], n["needs"]) for n in report.not_decidable]
    tables = [Table(("effect", "why it cannot be seen", "what would show it"), rows)] if rows else []
    return Section("What these records cannot decide", text, tables=tables)
