"""The report of a design study: one page that answers, and says how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

from jointlib.arrays import Array
from jointlib.io.atomic import sha256

from ..study import words
from ..study.findings.answer import answer
from ..study.findings.best import BestMachine
from ..study.findings.contrast import Contrast
from ..study.findings.verdict import Verdict
from ..study.study import Study
from .page import Page, Section
from .study_sections import (
    certainty_section,
    contrast_section,
    effects_section,
    front_section,
    leading_section,
    left_out_section,
    machine_section,
    map_section,
)


def study_page(
    study: Study,
    results: Mapping[str, Array],
    verdict: Verdict,
    found: Sequence[Contrast],
    best: BestMachine | None,
    inputs: tuple[Path, ...],
    identity: Mapping[str, object],
    command: str,
    warnings: Sequence[str] = (),
) -> Page:
    """The whole report; ``found`` holds the best against others, ``best`` its machine file if there is one."""
    sections: list[Section] = []
    if verdict.best is not None:
        sections.append(leading_section(study, verdict))
    else:
        sections.append(left_out_section(study, verdict))
    if len(study.objectives) > 1:
        sections.append(front_section(study, verdict))
    sections.append(effects_section(study, verdict))
    if found:
        sections.append(contrast_section(study, found))
    if verdict.best is not None:
        sections.append(map_section(study, verdict, {q: study.shaped(v) for q, v in results.items()}))
        if study.uncertain:
            sections.append(certainty_section(study, verdict))
        sections.append(left_out_section(study, verdict))
    if best is not None:
        sections.append(machine_section(study, best))
    return Page(
        title=f"Design study: {study.name}",
        finding=answer(study, verdict),
        numbers=_numbers(study, verdict),
        sections=sections,
        inputs=[(path.name, sha256(path)) for path in inputs],
        assumptions=_assumptions(study),
        warnings=list(warnings),
        command=command,
        version=f"{identity.get('program', version('jointlib'))}, numpy {version('numpy')}, scipy {version('scipy')}",
    )


def _numbers(study: Study, verdict: Verdict) -> list[tuple[str, str]]:
    told = [("designs", str(verdict.designs)), ("meet the constraints", str(verdict.feasible))]
    if verdict.best is not None:
        told += [
            (words.named(o.quantity), words.with_unit(o.quantity, verdict.best.results[o.quantity]))
            for o in study.objectives
        ]
    if verdict.surer is not None:
        told.append(("better than the second in", f"{100 * verdict.surer:.0f} % of {study.samples} samples"))
    return told


def _assumptions(study: Study) -> list[str]:
    method = study.lobes or "that of turning, or in milling zero order, a preview"
    plan = f"Plan: {study.method}, seed {study.seed}"
    said = [f"{plan}; {len(study.numbers())} configurations.", f"Method of the stability lobes: {method}."]
    amplitudes = ", ".join(f"{A * 1e6:g} µm" if A else "vanishing" for A in study.amplitudes)
    said.append(f"Tool-point amplitudes: {amplitudes}; the lowest limit counts.")
    if "pocket-speed" in study.quantities:
        said.append("A pocket stays stable when the speed is off by 2 %, and is 10 % below the limit there.")
        if len(study.cases) > 1:
            said.append("Every condition has a pocket of its own.")
        if study.uncertain:
            said.append(
                "Its speed is one for all samples of what is uncertain, as nobody knows which of them the machine is: "
                "that at which most is removed on average."
            )
    return said
