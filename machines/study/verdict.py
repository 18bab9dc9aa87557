"""What a finished study says: which designs are best, how sure that is, and what the answer depends on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array

from .sampling import sensitivities
from .study import Study

_SHOWN = 5


@dataclass(frozen=True, eq=False)
class Design:
    """One choice of the design factors, with its results in the worst case, averaged over what is uncertain."""

    number: int
    factors: Mapping[str, str]
    """Values as people read them."""
    results: Mapping[str, float]
    """Means in SI (rpm for speeds)."""
    spread: Mapping[str, float]
    """Standard deviations over the samples; 0 where nothing is uncertain."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """The answer of a study."""

    best: Design | None
    """None where no design meets the constraints."""
    leading: tuple[Design, ...]
    """The first few by the first objective."""
    front: tuple[Design, ...]
    """Designs that no other beats in every objective; only with several objectives."""
    feasible: int
    designs: int
    surer: float | None
    """Probability that the best is better than the second, over the samples of what is uncertain."""
    sensitivity: Mapping[str, Mapping[str, tuple[float, float]]]
    """Per objective and design factor: first-order and total index; only for a ``sobol`` plan."""


def judge(study: Study, results: Mapping[str, Array]) -> Verdict:
    """Rank the designs of a study by its first objective, among those that meet the constraints.

    In every sample of what is uncertain a design counts with its worst case, and over the samples with the mean; a
    constraint must hold in every case, in the share of the samples that the study asks for. A result that does not
    exist (no pocket, no limit) meets no constraint and wins nothing; a depth without limit counts as better than any
    other.
    """
    by_design = worst(study, results)
    designs = len(next(iter(by_design.values())))
    allowed = np.ones(designs, dtype=bool)
    for c in study.constraints:
        values = study.shaped(results[c.quantity])
        held = np.all((values >= c.at_least) & (values <= c.at_most), axis=1)
        allowed &= np.mean(held, axis=1) >= study.confidence
    scores = [_score(by_design[o.quantity], o.goal) for o in study.objectives]
    means = [np.mean(score, axis=1) for score in scores]
    for mean in means:
        allowed &= ~np.isnan(mean)
    order = np.flatnonzero(allowed)[np.argsort(-means[0][allowed], kind="stable")]
    numbers = study.numbers()[:: study.repeats]

    def design(row: Any) -> Design:
        i = int(row)
        shown = {f.name: f.words(float(n)) for f, n in zip(study.factors, numbers[i], strict=True) if not f.uncertain}
        rows = {name: values[i] for name, values in by_design.items()}
        spread = {k: float(np.std(v)) if np.all(np.isfinite(v)) else 0.0 for k, v in rows.items()}
        return Design(i, shown, {k: float(np.mean(v)) for k, v in rows.items()}, spread)

    surer = None
    if study.uncertain and len(order) > 1:
        surer = float(np.mean(scores[0][order[0]] > scores[0][order[1]]))
    front = _front(np.stack([mean[order] for mean in means], axis=1)) if len(means) > 1 else []
    return Verdict(
        design(order[0]) if len(order) else None,
        tuple(design(i) for i in order[:_SHOWN]),
        tuple(design(order[i]) for i in front),
        len(order),
        designs,
        surer,
        _sensitivity(study, by_design),
    )


def worst(study: Study, results: Mapping[str, Array]) -> dict[str, Array]:
    """Results in the worst case of every design and sample, (designs, samples).

    The worst is the smallest of what is to be large and the largest of what is to be small or is limited above. What
    is neither, the speed of a pocket, is taken from the case in which that pocket is worst.
    """
    goals = {c.quantity: "min" if np.isinf(c.at_least) else "max" for c in study.constraints}
    goals |= {o.quantity: o.goal for o in study.objectives}
    by_case = {name: study.shaped(values) for name, values in results.items()}
    at = {name: np.argmin(_score(by_case[name], goals[name]), axis=1) for name in by_case if name in goals}
    leading = at[next(name for name in ("removal-rate", "pocket-depth", *at) if name in at)]
    return {
        name: np.take_along_axis(values, at.get(name, leading)[:, None], axis=1)[:, 0]
        for name, values in by_case.items()
    }


def _score(values: Array, goal: str) -> Array:
    return values if goal == "max" else -values


def _front(scores: Array) -> list[int]:
    """Rows that no other row equals or exceeds in every column, exceeding it in one."""
    order = np.lexsort(tuple(-scores[:, ::-1].T))
    kept: list[int] = []
    for i in order:
        rest = scores[kept]
        if not np.any(np.all(rest >= scores[i], axis=1) & np.any(rest > scores[i], axis=1)):
            kept.append(int(i))
    return kept


def _sensitivity(study: Study, by_design: Mapping[str, Array]) -> dict[str, dict[str, tuple[float, float]]]:
    if study.method != "sobol":
        return {}
    out = {}
    for objective in study.objectives:
        mean = np.mean(by_design[objective.quantity], axis=1)
        if np.all(np.isfinite(mean)) and np.ptp(mean) > 0:
            first, total = sensitivities(mean, len(study.design))
            names = (f.name for f in study.design)
            out[objective.quantity] = {
                name: (float(a), float(b)) for name, a, b in zip(names, first, total, strict=True)
            }
    return out
