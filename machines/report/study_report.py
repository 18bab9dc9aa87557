"""The report of a design study: one page that answers, and says how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.io.atomic import sha256

from ..cutting.amplitude.pocket import WANDER
from ..study import words
from ..study.findings.best import BestMachine
from ..study.findings.contrast import Contrast
from ..study.findings.verdict import Design, Verdict
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


def answer(study: Study, verdict: Verdict) -> str:
    """The answer in a sentence or two."""
    if verdict.best is None:
        return _nothing(study, verdict)
    best, main = verdict.best, study.objectives[0]
    take = f"Take {words.chosen(best.factors)}" if study.design else "There is nothing to choose"
    said = f"{take}: {words.does(main.quantity, best.results)}{_elsewhere(study, verdict, best)}"
    said += f"{_ahead(study, verdict)}."
    if len(study.objectives) > 1 and len(verdict.front) > 1:
        others = " and ".join(words.named(o.quantity) for o in study.objectives)
        said += f" In {others} together {len(verdict.front)} designs are beaten by no other."
    return said


def _elsewhere(study: Study, verdict: Verdict, best: Design) -> str:
    """Between which speeds the pocket lies, where the worst conditions of the samples do not agree on one."""
    if study.objectives[0].quantity not in ("pocket-depth", "removal-rate"):
        return ""
    speeds = verdict.ranking.worst["pocket-speed"][best.number]
    low, high = float(np.min(speeds)), float(np.max(speeds))
    return f" (by condition at {low:.0f} to {high:.0f} rpm)" if high - low > 2 * WANDER * low else ""


def _ahead(study: Study, verdict: Verdict) -> str:
    """How far the first is ahead of the second, and in how many samples."""
    if len(verdict.leading) < 2:
        return f" on average over {_samples(study)}" if study.uncertain else ""
    best, second = (design.results[study.objectives[0].quantity] for design in verdict.leading[:2])
    if words.alike(best, second):
        return "; the second does as well"
    said = f"; {words.apart(best, second)} than the second"
    if verdict.surer is None:
        return said
    better = round(verdict.surer * study.samples)
    return f"{said}; better in {'all' if better == study.samples else f'{better} of'} {_samples(study)}"


def _samples(study: Study) -> str:
    return f"{study.samples} sample{'s' if study.samples > 1 else ''} of what is uncertain"


def _nothing(study: Study, verdict: Verdict) -> str:
    once = verdict.ranking.once
    most = sorted(((reason, out & once) for reason, out in verdict.ranking.broken.items()), key=lambda r: -r[1].sum())
    told = [f"{reason} rules out {int(out.sum())}" for reason, out in most if out.any()]
    said = f"None of the {verdict.designs} designs meets what is asked for: {', '.join(told)}."
    if verdict.nearest is not None:
        asked = dict.fromkeys(c.quantity for c in study.constraints)
        has = " and ".join(f"{words.named(q)} {words.with_unit(q, verdict.nearest.results[q])}" for q in asked)
        said += f" Nearest comes {words.chosen(verdict.nearest.factors) or 'the machine as it is'} with {has}."
    return said


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
    method = study.lobes or "the fast one of the process (zero order in milling, a preview)"
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
