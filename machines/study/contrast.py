"""What separates two designs of a study: their factors exchanged one at a time, evaluated from the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jointlib.arrays import Array

from .evaluation import Evaluation
from .study import Objective, Study
from .verdict import Design, worst_of

_MOST = 2000
"""Configurations that a contrast may compute; beyond that the samples are thinned."""
_ROUNDING = 1e-9


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
        return left if abs(left) > _ROUNDING * max(abs(self.first), abs(self.second)) else 0.0


def contrast(study: Study, evaluate: Evaluation, best: Design, other: Design) -> Contrast:
    """Exchange every factor in which two designs differ.

    All are computed anew with the same samples, so that the differences have no noise.
    """
    rows = study.shaped(np.arange(len(study.numbers()), dtype=float)).astype(int)
    plan = study.numbers()
    a, b = plan[rows[best.number, 0]], plan[rows[other.number, 0]]  # (samples, factors): cases do not change factors
    different = [i for i, f in enumerate(study.factors) if not f.uncertain and a[0, i] != b[0, i]]
    per_sample = (len(different) + 2) * len(study.cases)
    kept = max(1, min(len(a), _MOST // per_sample))
    a, b = a[:kept], b[:kept]
    swapped = []
    for i in different:
        mixed = a.copy()
        mixed[:, i] = b[:, i]
        swapped.append(mixed)
    objective = study.objectives[0]
    before, after, *singly = _means(study, evaluate, objective.quantity, [a, b, *swapped])
    words = [(study.factors[i], a[0, i], b[0, i]) for i in different]
    exchanges = tuple(
        Exchange(f.name, f.words(float(one)), f.words(float(other)), value - before)
        for (f, one, other), value in zip(words, singly, strict=True)
    )
    return Contrast(objective, (best, other), exchanges, before, after, kept)


def _means(study: Study, evaluate: Evaluation, quantity: str, designs: Sequence[Array]) -> list[float]:
    """The quantity of designs given by their rows (samples, factors): worst over the cases, mean over the samples."""
    asked = [(row, case) for design in designs for case in study.cases for row in design]
    found = evaluate.each(asked)
    values = found[quantity].reshape(len(designs), len(study.cases), -1)
    at = worst_of(study, {quantity: values})[quantity]
    return [float(v) for v in np.mean(np.take_along_axis(values, at[:, None], axis=1)[:, 0], axis=1)]
