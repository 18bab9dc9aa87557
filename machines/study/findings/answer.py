"""What a finished study says, in a sentence or two."""

from __future__ import annotations

from collections.abc import Set
from typing import TYPE_CHECKING

import numpy as np

from ...cutting.amplitude.pocket import WANDER
from ...cutting.rest.together import preview
from ...model.named_files import read
from .. import words
from ..asked import DEPTHS
from ..study import Study

if TYPE_CHECKING:
    from .verdict import Design, Verdict


def answer(study: Study, verdict: Verdict) -> str:
    """The answer in a sentence or two."""
    if verdict.best is None:
        return _nothing(study, verdict)
    best, main = verdict.best, study.objectives[0]
    take = f"Take {words.chosen(best.factors)}" if study.design else "There is nothing to choose"
    said = f"{take}: {words.does(main.quantity, best.results)}"
    beside = [_elsewhere(study, verdict, best), _preview(study, {main.quantity})]
    said += f" ({'; '.join(filter(None, beside))})" if any(beside) else ""
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
    return f"by condition at {low:.0f} to {high:.0f} rpm" if high - low > 2 * WANDER * low else ""


def _preview(study: Study, quantities: Set[str]) -> str:
    """What the depths are by, where it is no exact method."""
    process = read(study.base).get("cutting", {}).get("process", "") if study.lobes is None else ""
    zero = (study.lobes or preview(process)) == "zero-order"
    return "by zero order, a preview" if zero and quantities & DEPTHS else ""


def _ahead(study: Study, verdict: Verdict) -> str:
    """How far the first is ahead of the second, and in how many samples."""
    if len(verdict.leading) < 2:
        return f" on average over {_samples(study)}" if study.uncertain else ""
    best, second = (design.results[study.objectives[0].quantity] for design in verdict.leading[:2])
    if words.alike(best, second):
        pairs = ([design.results[o.quantity] for design in verdict.leading[:2]] for o in study.objectives)
        return "; the second does as well" + ("" if all(words.alike(*pair) for pair in pairs) else " in that")
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
        by = f" ({said_by})" if (said_by := _preview(study, asked.keys())) else ""
        said += f" Nearest comes {words.chosen(verdict.nearest.factors) or 'the machine as it is'} with {has}{by}."
    return said
