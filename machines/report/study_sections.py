"""The sections of a study's report, one per question a designer asks of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array

from ..study import words
from ..study.asked import DEPTHS
from ..study.findings.best import BestMachine
from ..study.findings.contrast import Contrast
from ..study.findings.effects import matters
from ..study.findings.verdict import Design, Verdict
from ..study.study import BASE, Study
from .figures.study_figures import certainty_figure, contrast_figure, effects_figure, map_figure, pareto_figure
from .page import Figure, Section, Table

_CHOICES = 12
_SETTLED = 0.9
_SEEN = 5e-4
"""Share of a result below which its scatter is not shown."""
_MAPPED = 3
"""Designs that share a picture over the positions of one axis."""


def leading_section(study: Study, verdict: Verdict) -> Section:
    """The leading designs, and the best with every other choice."""
    tables = [_designs(verdict.leading, "The leading designs, best first")]
    alternatives = _alternatives(study, verdict)
    tables += [alternatives] if len(verdict.leading) > 1 and alternatives.rows else []
    return Section("The leading designs", [_counting(study), *_ends(study, verdict)], tables=tables)


def _ends(study: Study, verdict: Verdict) -> list[str]:
    """Where the best design stands at an end of what was looked at."""
    assert verdict.best is not None
    said = []
    for i, f in enumerate(study.factors):
        values, best = np.unique(verdict.ranking.numbers[:, i]), verdict.ranking.numbers[verdict.best.number, i]
        ordered = not f.choices or (len(f.choices) > 2 and not f.labels)
        free = not f.uncertain and ordered and matters(verdict.sensitivity, f)
        if free and len(values) > 1 and best in (values[0], values[-1]):
            ends = ("first of its list", "last of its list") if f.choices else ("lowest looked at", "highest looked at")
            said.append(f"The best {f.name}, {f.words(float(best))}, is the {ends[int(best == values[-1])]}.")
    return [f"{' '.join(said)} There may be better ones beyond."] if said else []


def _counting(study: Study) -> str:
    cases, samples = len(study.cases), study.samples if study.uncertain else 1
    said = "Each design counts"
    if cases > 1:
        said += f" with the worst of {cases} conditions"
    if samples > 1:
        said += f"{',' if cases > 1 else ''} on average over {samples} samples of what is uncertain"
    said += " as it was computed" if cases == samples == 1 else ""
    what = " and ".join(
        f"{words.named(o.quantity)} {'large' if o.goal == 'max' else 'small'}" for o in study.objectives
    )
    return f"{said}. Wanted: {what}; the order is that of the first."


def _designs(designs: Sequence[Design], caption: str) -> Table:
    first = designs[0]
    header = ["", *first.factors, *(words.headed(q) for q in first.results)]
    rows = [
        [str(place), *d.factors.values(), *(words.number(q, v) + _spread(q, d) for q, v in d.results.items())]
        for place, d in enumerate(designs, start=1)
    ]
    return Table(header, rows, caption)


def _spread(quantity: str, design: Design) -> str:
    spread = design.spread[quantity]
    seen = spread > _SEEN * abs(design.results[quantity])
    return f" ± {words.plain(spread * words.shown_unit(quantity)[1], 2)}" if seen else ""


def _alternatives(study: Study, verdict: Verdict) -> Table:
    """The best allowed design with every value of every factor, so that the price of a choice can be read."""
    ranking, main = verdict.ranking, study.objectives[0]
    mean = np.mean(ranking.worst[main.quantity], axis=1)
    best = ranking.order[0]
    rows = []
    for i, f in enumerate(study.factors):
        values = np.unique(ranking.numbers[:, i])
        if f.uncertain or len(values) > _CHOICES:
            continue
        for value in values:
            found = ranking.order[ranking.numbers[ranking.order, i] == value]
            row = ["ruled out in every design", "", ""]
            if len(found):
                j = found[0]
                others = {g.name: g.words(float(n)) for g, n in zip(study.factors, ranking.numbers[j], strict=True)}
                given = {g.name: others[g.name] for g in study.design if g.name != f.name}
                told = "the best" if j == best else words.apart(float(mean[j]), float(mean[best]))
                row = [words.number(main.quantity, float(mean[j])), told, words.chosen(given)]
            rows.append([f"{f.name} {f.words(float(value))}", *row])
    return Table(
        ["with", words.headed(main.quantity), "than the best", "and then"], rows, "The best design that has each value"
    )


def front_section(study: Study, verdict: Verdict) -> Section:
    """Several objectives against each other."""
    count = len(verdict.front)
    text = [
        f"{count} designs are beaten by no other in every objective: whoever takes another one gives something away "
        "for nothing. Which of them it should be is a question of what the objectives are worth."
        if count > 1
        else "One design is the best in every objective at once."
        if count
        else "No design meets the constraints."
    ]
    tables = [_designs(verdict.front[:_CHOICES], "Designs beaten by no other")] if count else []
    if count > _CHOICES:
        text.append(f"The table holds the first {_CHOICES} of them.")
    return Section("One objective against the other", text, [pareto_figure(study, verdict)], tables)


def effects_section(study: Study, verdict: Verdict) -> Section:
    """What the objectives depend on."""
    if study.searched:
        said = (
            "A search crowds where designs are good, so that shares of the variance over its designs would tell of the "
            "search. A 'factorial', 'latin-hypercube' or 'sobol' plan tells what the objectives depend on."
        )
        return Section("What it depends on", [said])
    text, figures = [], []
    for quantity, found in verdict.sensitivity.items():
        figures.append(effects_figure(quantity, found))
        strongest = max(found, key=lambda e: e.first if e.total is None else e.total)
        text.append(
            f"The {words.named(quantity)} depends most on {strongest.factor.name}, which alone explains "
            f"{100 * strongest.first:.0f} % of its variance over the designs."
        )
    if study.method not in ("factorial", "sobol"):
        text.append("From this plan the shares are estimated in bins; interactions need a 'sobol' or 'factorial' plan.")
    text += [
        f"The {words.named(o.quantity)} is the same in every design, or nowhere finite."
        for o in study.objectives
        if o.quantity not in verdict.sensitivity
    ]
    return Section("What it depends on", text, figures)


def contrast_section(study: Study, found: Sequence[Contrast]) -> Section:
    """What separates the best design from the second, and from the best on another machine."""
    first, *more = found
    section = _contrast("What separates the first from the second", study, first)
    return replace(section, parts=[_contrast(_other(study, c), study, c) for c in more])


def _other(study: Study, found: Contrast) -> str:
    """``The first against the best with machine B``."""
    name = next(f.name for f in study.factors if f.path == BASE)
    return f"The first against the best with {name} {found.designs[1].factors[name]}"


def _contrast(title: str, study: Study, found: Contrast) -> Section:
    q = found.objective.quantity
    unit = words.shown_unit(q)[0]
    a, b = found.designs
    rows = [(e.factor, e.first, e.second, words.change(q, e.change)) for e in found.exchanges]
    text = [
        f"The first has a {words.named(q)} of {words.with_unit(q, a.results[q])}, the other of "
        f"{words.with_unit(q, b.results[q])}."
    ]
    if len(rows) == 1:
        text.append(f"They differ in one factor only: {rows[0][0]} {rows[0][1]} and {rows[0][2]}.")
        return Section(title, text)
    text.append("Each factor of the other was put into the first by itself, everything else staying the first's.")
    rows.append(("acting together", "", "", words.change(q, found.remainder)))
    table = Table(["factor", "first", "other", f"changes the {words.named(q)} by [{unit}]"], rows)
    if found.samples < study.samples:
        text.append(f"This took {found.samples} of the {study.samples} samples of what is uncertain.")
    finite = np.isfinite([found.first, found.second, *(e.change for e in found.exchanges)])
    return Section(title, text, [contrast_figure(found)] if np.all(finite) else [], [table])


def map_section(study: Study, verdict: Verdict, by_case: dict[str, Array]) -> Section:
    """Objectives over the positions of the axes; ``by_case`` is (designs, cases, samples)."""
    assert verdict.best is not None
    moved = [a for a in study.cases[0].position if len({case.position[a] for case in study.cases}) > 1]
    rows = _worst_cases(study, verdict, by_case)
    figures: list[Figure] = []
    for o in study.objectives if moved else ():
        values = np.mean(by_case[o.quantity], axis=2)
        leading = [d.number for d in verdict.leading[: _MAPPED if len(moved) == 1 else 1]]
        if np.any(np.ptp(values[leading], axis=1) > 0) and np.all(np.isfinite(values[leading])):
            over = _over(study, values[leading], moved[:2], o.goal)
            figures.append(map_figure(study, o.quantity, moved[:2], over))
    text = []
    if len(moved) > 2:
        text.append(f"Shown over {moved[0]} and {moved[1]}; of the other axes the worst position counts.")
    text += words.conditions(study)
    if not rows:
        text.append("The study looks at one position and one material only.")
    table = [Table(["", "worst", "at", "best", "at"], rows, "The first design over the conditions")] if rows else []
    return Section("Over the working space", text, figures, table)


def _worst_cases(study: Study, verdict: Verdict, by_case: dict[str, Array]) -> list[tuple[str, ...]]:
    if len(study.cases) < 2 or verdict.best is None:
        return []
    rows = []
    for o in study.objectives:
        values = np.mean(by_case[o.quantity][verdict.best.number], axis=1)
        ends = (int(np.argmin(values)), int(np.argmax(values)))
        bad, good = ends if o.goal == "max" else ends[::-1]
        cells = [cell for i in (bad, good) for cell in (words.with_unit(o.quantity, values[i]), study.cases[i].name)]
        rows.append((words.named(o.quantity), *cells))
    return rows


def _over(study: Study, values: Array, axes: Sequence[str], goal: str) -> Array:
    """Values (designs, cases) over the positions of one or two axes, the worst of everything else."""
    places = [sorted({case.position[a] for case in study.cases}) for a in axes]
    out = np.full((len(values), *map(len, places)), np.inf if goal == "max" else -np.inf)
    worse = np.minimum if goal == "max" else np.maximum
    for i, case in enumerate(study.cases):
        at = tuple(p.index(case.position[a]) for a, p in zip(axes, places, strict=True))
        for row, value in zip(out, values[:, i], strict=True):
            row[at] = worse(row[at], value)
    return out


def certainty_section(study: Study, verdict: Verdict) -> Section:
    """How sure the order of the designs is."""
    uncertain = ", ".join(f.name for f in study.uncertain)
    samples = study.samples
    leads = _leads(study, verdict)
    rows = []
    for place, d in enumerate(verdict.leading, start=1):
        ahead = "" if place == 1 else f"{100 * verdict.better_than(study, d):.0f} %"
        rows.append((str(place), words.chosen(d.factors), f"{100 * leads[d.number]:.0f} %", ahead))
    text = [
        f"Uncertain: {uncertain}. Every design was computed over the same {samples} samples, so that what is common to "
        "them does not blur the comparison."
    ]
    if verdict.surer is not None:
        text.append(f"The first is better than the second in {100 * verdict.surer:.0f} % of the samples.")
        if verdict.surer < _SETTLED:
            text.append("The order of these two is not settled: choose by another reason, or learn what is uncertain.")
    header = ["", "design", "leads in", "the first is better in"]
    finite = all(np.all(np.isfinite(verdict.main(study)[d.number])) for d in verdict.leading)
    figures = [certainty_figure(study, verdict)] if finite else []
    return Section("How sure the ranking is", text, figures, [Table(header, rows, "Share of the samples")])


def _leads(study: Study, verdict: Verdict) -> dict[int, float]:
    """In what share of the samples each allowed design is the best of all."""
    order, score = verdict.ranking.order, verdict.main(study)
    best = np.argmax(score[order], axis=0)
    return {int(i): float(np.mean(best == k)) for k, i in enumerate(order)}


def left_out_section(study: Study, verdict: Verdict) -> Section:
    """What was ruled out and why."""
    what = "meet the constraints and have every result" if study.constraints else "have every result; no limits are set"
    text = [f"{verdict.feasible} of {verdict.designs} designs {what}."]
    if study.uncertain and study.constraints:
        text.append(f"A constraint must hold in {100 * study.confidence:g} % of the samples, and in every condition.")
    reasons = np.array(list(verdict.ranking.broken.values()), dtype=bool).reshape(-1, len(verdict.ranking.once))
    reasons = reasons & verdict.ranking.once
    alone = reasons & (reasons.sum(axis=0) == 1)
    rows = [
        (reason, str(out.sum()), str(only.sum()))
        for reason, out, only in zip(verdict.ranking.broken, reasons, alone, strict=True)
    ]
    tables = [Table(["what", "rules out", "of these, it alone"], rows, "Designs ruled out")] if rows else []
    if verdict.nearest is not None:
        text.append(f"Nearest to what is asked for comes {words.chosen(verdict.nearest.factors)}.")
        tables.append(_designs([verdict.nearest], "The nearest design"))
    return Section("What was ruled out", text, tables=tables)


def machine_section(study: Study, best: BestMachine) -> Section:
    """The machine file of the best design, and what it is worth."""
    beside = ", with what it names in the folder beside it" if len(best.files) > 1 else ""
    text = [f"{best.files[0].name} is the best design as a machine file{beside}."]
    if study.uncertain:
        text.append("What is uncertain stands at its median in it.")
    if best.case.name:
        text.append(f"It stands as in the worst condition: {best.case.name}.")
    rows = [(words.named(q), words.with_unit(q, v)) for q, v in best.results.items()]
    if DEPTHS & best.results.keys():
        text.append(f"Its lobes: {best.command}")
    if "pocket-speed" in best.results:
        text.append(
            f"The command looks at other speeds than the {study.speed_count} of this study, so that it may find its "
            "pocket a little beside."
        )
    if best.method == "zero-order":
        text.append("The depths are by zero order, a preview: without --method the exact method is taken.")
    return Section("The machine file", text, tables=[Table(["", "of this file"], rows)])
