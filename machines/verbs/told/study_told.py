"""What a study amounts to: in lines, as JSON, as a report, and the best machine as a file."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointlib.cli.output import emit, table, working, wrote

if TYPE_CHECKING:
    from jointlib.arrays import Array
    from jointlib.joint import Joint

    from ...study.evaluation import Evaluation
    from ...study.findings.contrast import Contrast
    from ...study.findings.verdict import Design, Verdict
    from ...study.store import Store
    from ...study.study import Study

REPORT, BEST = "report.html", "best.toml"


def tell(study: Study, store: Store, joints: Mapping[str, Joint], output: Path, as_json: bool) -> None:
    """Print what is done; once all is, judge it and write ``results.npz``, ``report.html`` and ``best.toml``."""
    import numpy as np

    from jointlib.io.atomic import write_npz

    from ...study.evaluation import Evaluation
    from ...study.findings.verdict import judge

    done = store.total - sum(store.rows(i, i).stop - store.rows(i, i).start for i in store.missing())
    data: dict[str, Any] = {"done": done, "total": store.total, "best": None}
    lines = [f"{done} of {store.total} configurations are computed"]
    if done < store.total:
        emit(as_json, data, [*lines, "the others are still to do, by the other parts or by 'jointlib study resume'"])
        return
    results = store.results()
    write_npz(output / "results.npz", {"factors": study.numbers(), **results})
    verdict = judge(study, results)
    evaluate = Evaluation(study.source.resolve(), tuple(sorted(joints.items())), tools=study.asked_tools)
    without = np.flatnonzero(np.all([np.isnan(values) for values in results.values()], axis=0))
    refused = evaluate.refused(study.numbers()[without[0]], study.case(int(without[0]))) if len(without) else ""
    if refused:
        lines.append(f"{len(without)} of them have no results; the first: {refused}")
    with working("writing the report"):
        written = _write(study, results, verdict, joints, evaluate, lines[1:], output)
    data |= _as_json(verdict) | {"report": str(output / REPORT), "machine": None}
    if verdict.best is not None:
        data["machine"] = str(output / BEST)
    emit(as_json, data, [*lines, *_words(study, verdict), *map(wrote, (output / "results.npz", *written))])


def _write(
    study: Study,
    results: Mapping[str, Array],
    verdict: Verdict,
    joints: Mapping[str, Joint],
    evaluate: Evaluation,
    warnings: Sequence[str],
    output: Path,
) -> list[Path]:
    """The best machine, where there is one, and the report."""
    from ...report.study_report import study_page
    from ...study.findings.best import write_best
    from ...study.findings.contrast import contrast
    from ...study.findings.verdict import rivals
    from ...study.inputs import inputs
    from ...study.run import identity

    found: list[Contrast] = []
    best = None
    if verdict.best is not None:
        best = write_best(study, evaluate, joints, verdict.ranking, verdict.best, output / BEST)
        found = [contrast(study, evaluate, verdict.ranking, verdict.best, rival) for rival in rivals(study, verdict)]
    files = (study.source, *inputs(study))
    tools = ["--tool", ",".join(study.asked_tools)] if study.asked_tools else []
    command = shlex.join(["jointlib", "study", "run", str(study.source), "-o", str(output), *tools])
    page = study_page(study, results, verdict, found, best, files, identity(study), command, warnings)
    page.write(output / REPORT)
    return [output / REPORT, *([] if best is None else [best.files[0]])]


def _words(study: Study, verdict: Verdict) -> list[str]:
    from ...study import words
    from ...study.findings.answer import answer

    lines = [f"{verdict.feasible} of {verdict.designs} designs meet the constraints", answer(study, verdict)]
    shown = verdict.leading or ([] if verdict.nearest is None else [verdict.nearest])
    if shown:
        header = [*shown[0].factors, *(words.headed(q) for q in shown[0].results)]
        rows = [(*d.factors.values(), *(words.number(q, v) for q, v in d.results.items())) for d in shown]
        lines += table(header, rows)
    for quantity, effects in verdict.sensitivity.items():
        rows = [(e.factor.name, f"{e.first:.3f}", "" if e.total is None else f"{e.total:.3f}") for e in effects]
        lines += table((f"share of the variance of {words.named(quantity)}", "alone", "with interactions"), rows)
    return lines


def _as_json(verdict: Verdict) -> dict[str, Any]:
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
