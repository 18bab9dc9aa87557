"""The effect that a trace names, with its parameters; its rivals, what came after it, and what is undone for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from jointlib.loop.answer.naming import in_words
from jointlib.loop.answer.report import Candidate, Estimate, TraceReport, Verdict
from jointlib.units import read_as

from .page import Section, Table

_STATUS = {"hypothesis": "hypothesis", "accepted": "passed the same tests, added"}


def effect_part(report: TraceReport) -> Section:
    """The chosen effect with its parameters, its rivals and what comes after it."""
    named = report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)
    tables = []
    if report.chosen is not None and report.chosen.parameters:
        tables.append(_chosen_table(report.chosen, named))
    if report.rivals:
        tables.append(_rival_table(report))
    further = [(link, _STATUS.get(str(link.get("status")), str(link.get("status")))) for link in report.chain]
    listed = {_link_name(link) for link in report.chain}
    further += [(link, "passed, but small: not added") for link in report.secondary if _link_name(link) not in listed]
    if report.composition:
        tables.append(_composition_table(report.composition))
    elif further:
        rows = [(_link_name(link), percent(link["share"], 2), word) for link, word in further]
        of = "gain against the first" if report.route == "periodic" else "share of what was left then"
        tables.append(Table(("further effect", of, "what became of it"), rows, "After the first effect"))
    if report.corrections:
        tables.append(_correction_table(report))
    return Section("What is missing", figures=(), tables=tables)


def _composition_table(composition: Iterable[Mapping[str, Any]]) -> Table:
    """Effects in the order of their entry, with what each is worth beside all the others."""
    rows = []
    for c in composition:
        doubt = ", ".join(dict.fromkeys(c["rivals"])) or "–"
        worth = (percent(c["share"], 2), percent(c["explained"], 2), percent(c["adds"], 2))
        rows.append((str(c.get("words", _link_name(c))).removeprefix("that "), *worth, doubt))
    header = (
        "effect with its 95 % intervals",
        "share of what was left then",
        "explained so far",
        "adds to all the others",
        "or instead",
    )
    return Table(header, rows, "Together: in the order in which they entered")


def _rival_table(report: TraceReport) -> Table:
    """One row for each rival in words; members of a class that say the same stand together."""
    rows: dict[str, tuple[str, str, str, str]] = {}
    for r in report.rivals:
        words = in_words(r.family, r.where, r.member).removeprefix("that ")
        alike = "yes" if r.declared_pair else "no"
        rows.setdefault(words, (words, f"{100 * r.gain_ratio:.1f}\u00a0%", alike, r.separating_experiment))
    header = ("rival", "gain against the chosen one", "known to look alike", "experiment that separates them")
    return Table(header, list(rows.values()), "Rivals: these records cannot rule them out")


def _chosen_table(chosen: Candidate, named: bool) -> Table:
    rows: list[tuple[str, str, str, str, str]] = []
    for name, e in chosen.parameters.items():
        if name.split(".", 1)[-1].startswith("smoothing"):
            continue  # It only rounds a corner of the law.
        factor, unit = _readable(name, e)
        interval = sorted(bound * factor for bound in e.ci95)
        known = all(np.isfinite(interval)) and e.standard_error > 0
        span = f"{_cut(interval[0], interval)} to {_cut(interval[1], interval)}" if known else "not estimated"
        value = _cut(e.value * factor, interval) if known else f"{e.value * factor:.4g}"
        words = name.split(".", 1)[-1].replace("_", " ")
        words += ", second element" if any(words == row[0] for row in rows) else ""
        rows.append((words, value, span, unit, _doubt(e, known)))
    words = in_words(chosen.family, chosen.where, chosen.member).removeprefix("that ")
    caption = f"{'Chosen' if named else 'Nearest'}: {words}"
    if chosen.explained is not None:
        caption += f"; explains {percent(chosen.explained)} of the excess alone"
    return Table(("parameter", "value", "95 % interval", "unit", "what the interval covers"), rows, caption)


def _readable(name: str, e: Estimate) -> tuple[float, str]:
    """Factor and unit for the eye: a gain error in per cent."""
    if name == "gain":
        return 100.0, "%"
    return read_as(e.value, e.unit)


def _cut(value: float, interval: Iterable[float]) -> str:
    """A number with the digits that its interval leaves."""
    low, high = interval
    digits = 1 - int(np.floor(np.log10(max(high - low, 1e-300) / 2)))
    return f"{value:.{digits}f}" if 0 <= digits <= 7 and abs(value) < 1e6 else f"{value:.5g}"


def _doubt(e: Estimate, known: bool) -> str:
    said = []
    if e.ci_kind == "model_form":
        said.append("noise; the shape of the law is the larger doubt")
    elif known:
        said.append("noise and spread over the records")
    if e.biased:
        said.append("biased: the value is off by more than the interval says")
    return "; ".join(said) or "–"


def _correction_table(report: TraceReport) -> Table:
    """Faults that the mended measurement file undoes, in SI as they stand there."""
    rows = []
    for c in report.corrections:
        values = ", ".join(f"{n.replace('_', ' ')} {v:.5g}" for n, v in c.parameters.items())
        rows.append((c.family, c.site or "rig", c.record or "all", values))
    return Table(("fault", "at", "record", "undone (SI)"), rows, "Corrections in measurement.toml, undone on reading")


def _link_name(link: Mapping[str, Any]) -> str:
    return in_words(
        str(link["family"]), str(link.get("channel") or link.get("body") or ""), str(link.get("member", ""))
    )


def percent(share: float, digits: int = 3) -> str:
    """A share as people read it; what rounds to nothing says so."""
    value = 100 * share
    if 0 < abs(value) < 0.01:
        return "<\u00a00.01\u00a0%"
    told = f"{value:.{digits}g}"
    return (f"{value:.0f}" if "e" in told else told) + "\u00a0%"
