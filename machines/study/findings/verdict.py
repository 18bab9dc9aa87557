"""What a finished study says: which designs are best, how sure that is, and what the answer depends on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointlib.arrays import Array
from jointlib.shown.pictures import axes_of, name_curves
from jointlib.shown.result import Columns, Shown

from .. import words
from ..study import BASE, QUANTITIES, ROUNDING, Constraint, Study
from .answer import answer
from .effects import Effect, effects
from .front_picture import draw_front, draw_ranked

_SHOWN = 5


@dataclass(frozen=True, eq=False)
class Design:
    """One choice of the design factors, with its results in the worst case, averaged over what is uncertain."""

    number: int
    factors: Mapping[str, str]
    """Values as people read them."""
    results: Mapping[str, float]
    """Means in SI (rpm for speeds); of the speed of a pocket the median."""
    spread: Mapping[str, float]
    """Standard deviations over the samples; 0 where nothing is uncertain."""


@dataclass(frozen=True, eq=False)
class Ranking:
    """Every design of a study in numbers."""

    numbers: Array
    """The plan, a row per design and a column per factor (list entries by index)."""
    worst: Mapping[str, Array]
    """Results in the worst case, (designs, samples)."""
    allowed: NDArray[np.bool_]
    """True for designs that have results and meet the constraints."""
    order: NDArray[np.intp]
    """Those designs, each once, best first."""
    broken: Mapping[str, NDArray[np.bool_]]
    """True for designs that a constraint or a missing result rules out, by the reason in words."""
    once: NDArray[np.bool_]
    """False for designs that a plan holds again: lists make a `sobol` plan repeat itself."""


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Shown):
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
    sensitivity: Mapping[str, tuple[Effect, ...]]
    """Per objective that varies: what follows from each design factor; nothing in a search."""
    ranking: Ranking
    nearest: Design | None
    """Where no design meets the constraints: the one that misses them by the smallest share."""
    study: Study
    """What was asked."""

    def finding(self) -> str:
        """The best design, what it does, and how far it is ahead."""
        return answer(self.study, self)

    def columns(self) -> Columns:
        """A row per design: its rank (0 where a constraint or a missing result rules it out), factors, and results.

        Results are those of the worst case, over the samples of what is uncertain as `Design` tells them.
        """
        count, found = len(self.ranking.numbers), self.ranking
        rank = np.zeros(count, dtype=int)
        rank[found.order] = np.arange(1, len(found.order) + 1)
        out: dict[str, Any] = {"design": (np.arange(count), ""), "rank": (rank, "")}
        for numbers, f in zip(found.numbers.T, self.study.factors, strict=True):
            if not f.uncertain:
                listed = [f.words(float(n)) for n in numbers] if f.choices else numbers
                out[f.name] = (listed, "" if f.choices else f.unit)
        results = ((q, over_samples(self.study, q, values)) for q, values in found.worst.items())
        return out | {q: (values, QUANTITIES[q][0]) for q, values in results}

    def plot(self, ax: Any = None) -> Any:
        """The first objective of all designs over the second; over their rank where there is only one."""
        axes = axes_of(ax)
        if len(self.study.objectives) > 1:
            draw_front(axes, self.study, self, self.study.objectives[1].quantity)
            name_curves(axes)
        else:
            draw_ranked(axes, self.study, self)
        return axes

    def better_than(self, study: Study, other: Design) -> float:
        """Share of the samples in which the best is better than another design."""
        assert self.best is not None
        score = self.main(study)
        return float(np.mean(score[self.best.number] > score[other.number]))

    def main(self, study: Study) -> Array:
        """The first objective of every design and sample, larger being better."""
        return scored(study, self.ranking.worst)


def judge(study: Study, results: Mapping[str, Array]) -> Verdict:
    """Rank the designs of a study by its first objective, among those that meet the constraints.

    Those that are alike in it stand in the order of the next one, so that no other design beats the best in every way.

    In every sample of what is uncertain a design counts with its worst case, and over the samples with the mean; a
    constraint must hold in every case, in the share of the samples that the study asks for. A result that does not
    exist (no pocket, no limit) meets no constraint and wins nothing; a depth without limit counts as better than any
    other.
    """
    ranking = rank(study, results)
    order, by_design = ranking.order, ranking.worst
    means = [np.mean(_score(by_design[o.quantity], o.goal), axis=1) for o in study.objectives]

    def design(row: Any) -> Design:
        return design_of(study, ranking, int(row))

    leading = tuple(design(i) for i in order[:_SHOWN])
    surer = None
    if study.uncertain and len(order) > 1:
        score = scored(study, by_design)
        surer = float(np.mean(score[order[0]] > score[order[1]]))
    front = _front(np.stack([mean[order] for mean in means], axis=1)) if len(means) > 1 else []
    nearest = None if len(order) else _nearest(study, results)
    return Verdict(
        leading[0] if leading else None,
        leading,
        tuple(design(order[i]) for i in front),
        len(order),
        int(ranking.once.sum()),
        surer,
        _sensitivity(study, ranking),
        ranking,
        None if nearest is None else design(nearest),
        study,
    )


def rank(study: Study, results: Mapping[str, Array]) -> Ranking:
    """Which designs are allowed, and in what order they stand; see `judge`."""
    by_design = worst(study, results)
    numbers = study.numbers()[:: study.repeats]
    once = _first_ones(numbers[:, [i for i, f in enumerate(study.factors) if not f.uncertain]])
    broken = {words.limit(c): ~_held(study, c, results) for c in study.constraints}
    means = [np.mean(_score(by_design[o.quantity], o.goal), axis=1) for o in study.objectives]
    for o, mean in zip(study.objectives, means, strict=True):
        if np.any(np.isnan(mean)):
            broken[words.missing(o.quantity)] = np.isnan(mean)
    allowed = ~np.any([*broken.values(), np.zeros(len(once), dtype=bool)], axis=0)
    counted = allowed & once
    order = np.flatnonzero(counted)[np.lexsort(tuple(-_rounded(np.stack(means, axis=1)[counted]).T[::-1]))]
    return Ranking(numbers, by_design, allowed, order, broken, once)


def _first_ones(rows: Array) -> NDArray[np.bool_]:
    """True for rows that no earlier one equals."""
    out = np.zeros(len(rows), dtype=bool)
    out[np.unique(rows, axis=0, return_index=True)[1] if rows.shape[1] else [0]] = True
    return out


def design_of(study: Study, ranking: Ranking, i: int) -> Design:
    """A design by its number, with means and spreads."""
    given = zip(study.factors, ranking.numbers[i], strict=True)
    shown = {f.name: f.words(float(n)) for f, n in given if not f.uncertain}
    rows = {name: values[i] for name, values in ranking.worst.items()}
    spread = {k: float(np.std(v)) if np.all(np.isfinite(v)) and np.ptp(v) > 0 else 0.0 for k, v in rows.items()}
    return Design(i, shown, {k: float(over_samples(study, k, v)) for k, v in rows.items()}, spread)


def over_samples(study: Study, quantity: str, values: Array) -> Array:
    """What is told of a quantity over the samples, its last axis: the mean, of the speed of a pocket the median.

    Samples differ in it where their worst conditions do. Between the pockets of two conditions the machine may chatter,
    so that a speed is told that one of them has.
    """
    if quantity == "pocket-speed" and all(o.quantity != quantity for o in study.objectives):
        return np.quantile(values, 0.5, axis=-1, method="inverted_cdf")
    return np.asarray(np.mean(values, axis=-1))


def rivals(study: Study, verdict: Verdict) -> tuple[Design, ...]:
    """Designs that the best is held against: the second, and the best on every other machine file."""
    found = [d.number for d in verdict.leading[1:2]]
    order, numbers = verdict.ranking.order, verdict.ranking.numbers
    for i, f in enumerate(study.factors):
        others = [value for value in np.unique(numbers[:, i]) if len(order) and value != numbers[order[0], i]]
        for value in others if f.path == BASE else ():
            found += [int(j) for j in order[numbers[order, i] == value][:1]]
    return tuple(design_of(study, verdict.ranking, i) for i in dict.fromkeys(found))


def scored(study: Study, by_design: Mapping[str, Array]) -> Array:
    """The first objective of every design and sample, larger being better."""
    return _score(by_design[study.objectives[0].quantity], study.objectives[0].goal)


def _held(study: Study, c: Constraint, results: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Whether designs meet a constraint in every case, in the share of the samples that is asked for."""
    values = study.shaped(results[c.quantity])
    held = np.all((values >= c.at_least) & (values <= c.at_most), axis=1)
    return np.asarray(np.mean(held, axis=1) >= study.confidence)


def _nearest(study: Study, results: Mapping[str, Array]) -> int | None:
    """The design whose worst miss, as a share of the limit, in the share of the samples asked for, is smallest."""
    misses = []
    for c in study.constraints:
        values = study.shaped(results[c.quantity])
        below = np.max((c.at_least - values) / abs(c.at_least or 1.0), axis=1) if np.isfinite(c.at_least) else -np.inf
        above = np.max((values - c.at_most) / abs(c.at_most or 1.0), axis=1) if np.isfinite(c.at_most) else -np.inf
        by_sample = np.nan_to_num(np.maximum(below, above), nan=np.inf)
        misses.append(np.sort(by_sample, axis=1)[:, int(np.ceil(study.confidence * by_sample.shape[1])) - 1])
    miss = np.max(misses, axis=0) if misses else np.array([np.inf])
    return int(np.argmin(miss)) if np.any(np.isfinite(miss)) else None


def worst(study: Study, results: Mapping[str, Array]) -> dict[str, Array]:
    """Results in the worst case of every design and sample, (designs, samples); see `worst_of`."""
    by_case = {name: study.shaped(values) for name, values in results.items()}
    at = worst_of(study, by_case)
    return {name: np.take_along_axis(values, at[name][:, None], axis=1)[:, 0] for name, values in by_case.items()}


def worst_of(study: Study, by_case: Mapping[str, Array]) -> dict[str, NDArray[np.intp]]:
    """The worst case of every quantity, by design and sample, from arrays (designs, cases, samples).

    The worst is the smallest of what is to be large and the largest of what is to be small or is limited above. What
    is neither, the speed of a pocket, is taken from the case in which that pocket is worst.
    """
    goals = {c.quantity: "min" if np.isinf(c.at_least) else "max" for c in study.constraints}
    goals |= {o.quantity: o.goal for o in study.objectives}
    at = {name: np.argmin(_score(by_case[name], goals[name]), axis=1) for name in by_case if name in goals}
    leading = at[next(name for name in ("removal-rate", "pocket-depth", *at) if name in at)]
    return {name: at.get(name, leading) for name in by_case}


def _score(values: Array, goal: str) -> Array:
    return values if goal == "max" else -values


def _rounded(scores: Array) -> Array:
    """Scores, (designs, objectives), such that those which differ by rounding alone are equal."""
    largest = np.max(np.abs(scores), axis=0, initial=0.0, where=np.isfinite(scores))
    return np.asarray(np.round(scores / np.where(largest > 0, ROUNDING * largest, 1.0)))


def _front(scores: Array) -> list[int]:
    """Rows that no other row equals or exceeds in every column, exceeding it in one; rounding beats nothing."""
    scores = _rounded(scores)
    order = np.lexsort(tuple(-scores[:, ::-1].T))
    kept: list[int] = []
    for i in order:
        rest = scores[kept]
        if not np.any(np.all(rest >= scores[i], axis=1) & np.any(rest > scores[i], axis=1)):
            kept.append(int(i))
    return kept


def _sensitivity(study: Study, ranking: Ranking) -> dict[str, tuple[Effect, ...]]:
    """Effects by objective; of a search none, whose designs crowd where they are good."""
    design = [i for i, f in enumerate(study.factors) if not f.uncertain]
    out: dict[str, tuple[Effect, ...]] = {}
    if study.searched:
        return out
    for objective in study.objectives:
        mean = np.mean(ranking.worst[objective.quantity], axis=1)
        found = effects([study.factors[i] for i in design], ranking.numbers[:, design], mean, study.method)
        if found:
            out[objective.quantity] = tuple(found)
    return out
