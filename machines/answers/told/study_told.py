"""What a study amounts to: in lines, as JSON, as a report, and the best machine as a file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointlib.shown.text import table

from ...study.words import conditions, limit, wanted

if TYPE_CHECKING:
    from jointlib.arrays import Array
    from jointlib.joint import Joint

    from ...study.evaluation import Evaluation
    from ...study.factors import Factor
    from ...study.findings.contrast import Contrast
    from ...study.findings.verdict import Design, Verdict
    from ...study.study import Study

REPORT, BEST = "report.html", "best.toml"


def write_findings(
    study: Study,
    results: Mapping[str, Array],
    verdict: Verdict,
    joints: Mapping[str, Joint],
    evaluate: Evaluation,
    warnings: Sequence[str],
    output: Path,
) -> tuple[list[Path], str]:
    """The best machine, where there is one, and the report: what was written, and what the exact method says of it."""
    from ...report.study_report import study_page
    from ...study.findings.best import write_best
    from ...study.findings.checked import checked
    from ...study.findings.contrast import contrast
    from ...study.findings.verdict import rivals
    from ...study.inputs import inputs
    from ...study.run import identity

    found: list[Contrast] = []
    best, exact = None, ""
    if verdict.best is not None:
        best = write_best(study, evaluate, joints, verdict.ranking, verdict.best, output / BEST)
        exact = checked(best)
        found = [contrast(study, evaluate, verdict.ranking, verdict.best, rival) for rival in rivals(study, verdict)]
    files = (study.source, *inputs(study))
    tools = ["--tool", ",".join(study.asked_tools)] if study.asked_tools else []
    command = shlex.join(["jointlib", "study", "run", str(study.source), "-o", str(output), *tools])
    page = study_page(
        study, results, verdict, found, best, files, identity(study), command, [*filter(None, [exact]), *warnings]
    )
    page.write(output / REPORT)
    return [output / REPORT, *([] if best is None else [best.files[0]])], exact


def words_of(study: Study, verdict: Verdict, exact: str = "") -> list[str]:
    """In lines, with what the exact method says of the best beside the answer."""
    from ...study import words
    from ...study.findings.answer import answer

    lines = [f"{verdict.feasible} of {verdict.designs} designs meet the constraints", answer(study, verdict)]
    lines += filter(None, [exact])
    shown = verdict.leading or ([] if verdict.nearest is None else [verdict.nearest])
    if shown:
        header = [*shown[0].factors, *(words.headed(q) for q in shown[0].results)]
        rows = [(*d.factors.values(), *(words.number(q, v) for q, v in d.results.items())) for d in shown]
        lines += table(header, rows)
    for quantity, effects in verdict.sensitivity.items():
        rows = [(e.factor.name, f"{e.first:.3f}", "" if e.total is None else f"{e.total:.3f}") for e in effects]
        lines += table((f"share of the variance of {words.named(quantity)}", "alone", "with interactions"), rows)
    return lines


def as_json(verdict: Verdict) -> dict[str, Any]:
    data: dict[str, Any] = {"best": None if verdict.best is None else _design(verdict.best)}
    if verdict.surer is not None:
        data["probability"] = verdict.surer
    if verdict.front:
        data["front"] = [_design(d) for d in verdict.front]
    if verdict.nearest is not None:
        data["nearest"] = _design(verdict.nearest)
    if verdict.sensitivity:
        data["sensitivity"] = {
            quantity: {e.factor.name: [e.first, e.total] for e in effects}
            for quantity, effects in verdict.sensitivity.items()
        }
    return data


def _design(design: Design) -> dict[str, Any]:
    return {"configuration": design.number, "factors": dict(design.factors), "results": dict(design.results)}


def asked_lines(study: Study) -> list[str]:
    """What a study file asks for: its machine, what is varied, what counts, how many configurations that makes."""
    lines = [f"study {study.name!r} of {study.base.name}: {study.total} configurations, {study.method}"]
    rows = []
    for factor in study.factors:
        given = ", ".join(map(factor.words, range(len(factor.choices)))) if factor.choices else _range(factor)
        rows.append((factor.name, factor.path, given, "uncertain" if factor.uncertain else ""))
    lines += table(("factor", "key of the machine file", "values", ""), rows)
    lines += [f"wanted: {wanted(study.objectives)}"] if study.objectives else []
    lines += [f"needed: {', '.join(map(limit, study.constraints))}"] if study.constraints else []
    return [*lines, *conditions(study)]


def _range(factor: Factor) -> str:
    low, high = factor.words(factor.low), factor.words(factor.high)
    if factor.distribution == "normal":
        return f"about {low}, standard deviation {high}"
    if factor.distribution == "log-normal":
        return f"about {low}, standard deviation of the logarithm {factor.high:.3g}"
    return f"{low} to {high}" if factor.high > factor.low else "as in the machine file"
