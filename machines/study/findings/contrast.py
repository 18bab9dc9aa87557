"""What separates two designs of a study: their factors exchanged one at a time, evaluated from the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError

from ..evaluation import Evaluation
from ..study import ROUNDING, Objective, Study
from .verdict import Design, Ranking, worst_of

_MOST = 2000
"""Configurations that a contrast may compute; beyond that the samples are thinned."""


@dataclass(frozen=True)
class Exchange:
    """A factor of the first design taken from the second, everything else being the first's."""

    factor: str
    first: str
    """Values as people read them."""
    second: str
    change: float
    """Of the objective, in its SI unit: mean over the samples, each in its worst case."""


@dataclass(frozen=True)
class Contrast:
    """How the objective gets from the first design to the second."""

    objective: Objective
    designs: tuple[Design, Design]
    exchanges: tuple[Exchange, ...]
    first: float
    """The objective of the first design, SI."""
    second: float
    samples: int
    """Samples of what is uncertain that were computed."""

    @property
    def remainder(self) -> float:
        """What the exchanges one at a time do not add up to: the factors acting together."""
        left = self.second - self.first - sum(e.change for e in self.exchanges)
        return left if abs(left) > ROUNDING * max(abs(self.first), abs(self.second)) else 0.0


def contrast(study: Study, evaluate: Evaluation, ranking: Ranking, best: Design, other: Design) -> Contrast:
    """Exchange every factor in which two designs differ.

    What the plan does not hold is computed, with the same samples, so that the differences have no noise.
    """
    a, b = ranking.numbers[best.number], ranking.numbers[other.number]
    different = [i for i, f in enumerate(study.factors) if not f.uncertain and a[i] != b[i]]
    swapped = [np.where(np.arange(len(a)) == i, b, a) for i in different]
    known = [_known(study, ranking, design) for design in swapped]
    samples = ranking.worst[study.objectives[0].quantity].shape[1]
    computed = len(study.cases) * sum(i is None for i in known)
    kept = samples
    if computed * samples > _MOST:  # all designs are computed again over fewer samples
        kept, known = max(1, _MOST // (len(study.cases) * (len(known) + 2))), [None] * len(known)
    values = [_mean(study, evaluate, ranking, d, i, kept) for d, i in zip(swapped, known, strict=True)]
    ends = [None, None] if kept < samples else [best.number, other.number]
    before, after = (_mean(study, evaluate, ranking, d, i, kept) for d, i in zip((a, b), ends, strict=True))
    exchanges = []
    for i, value in zip(different, values, strict=True):
        f = study.factors[i]
        exchanges.append(Exchange(f.name, f.words(float(a[i])), f.words(float(b[i])), value - before))
    return Contrast(study.objectives[0], (best, other), tuple(exchanges), before, after, kept)


def _known(study: Study, ranking: Ranking, design: Array) -> int | None:
    """The number of a design that the plan holds."""
    chosen = [i for i, f in enumerate(study.factors) if not f.uncertain]
    found = np.flatnonzero(np.all(ranking.numbers[:, chosen] == design[chosen], axis=1))
    return int(found[0]) if len(found) else None


def _mean(study: Study, evaluate: Evaluation, ranking: Ranking, design: Array, known: int | None, kept: int) -> float:
    """The first objective of a design: worst over the cases, mean over the first samples."""
    quantity = study.objectives[0].quantity
    if known is not None:
        return float(np.mean(ranking.worst[quantity][known, :kept]))
    rows = study.numbers()[: study.repeats][:kept]  # the first case of the first design, for its samples
    uncertain = np.array([f.uncertain for f in study.factors])
    drawn = np.where(uncertain, rows, design)
    try:
        found = evaluate.each([(row, case) for case in study.cases for row in drawn])
    except (CheckFailed, InputError):  # the best with one value of the other may be no machine at all
        return np.nan
    values = found[quantity].reshape(1, len(study.cases), kept)
    at = worst_of(study, {quantity: values})[quantity]
    return float(np.mean(np.take_along_axis(values, at[:, None], axis=1)))
