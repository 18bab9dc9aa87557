"""Pareto search: designs proposed generation by generation, each from what the earlier ones are worth.

The optimiser is NSGA-II (Deb et al. 2002) as pymoo has it (Blank and Deb 2020). What it proposes follows from the
study and the results told to it and from nothing else, so a search that was stopped goes on by being told them again.
"""

from __future__ import annotations

import importlib
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.units import number_and_unit

from .factors import Factor
from .findings.verdict import worst
from .sampling import plan
from .study import Study

Proposals = Generator[Array, tuple[Array, Mapping[str, Array]], None]
_ASKED = 20
"""How often the optimiser is asked for designs that are not known yet; what is still short is drawn at random."""
_FAR = 1e6
"""Violation where a result does not exist."""
_BEYOND = 1e3
"""What is unbounded counts as this many times the largest loss of the first generation."""


def optimiser() -> str:
    """Name and release of the optimiser, on which the proposals depend."""
    return f"pymoo {_pymoo('version').__version__}"


def generations(study: Study) -> Proposals:
    """Designs to compute, as quantiles (designs, design factors); none comes twice.

    Send the designs that were computed and their results to be given the next ones; it ends with the `count`-th.
    """
    problem, algorithm = _nsga2(study)
    seen: set[tuple[float, ...]] = set()
    done, cap = 0, 1.0
    while True:
        asked = (row for _ in range(_ASKED) for row in _designs(algorithm.ask(), study.design))
        random = _random(study.design, np.random.default_rng([study.seed, done]))
        designs, results = yield _new(asked, random, seen, min(study.population, study.count - done))
        done += len(designs)
        if done >= study.count:
            return
        seen |= {tuple(row) for row in designs.tolist()}
        losses, violations = marks(study, results)
        if done == len(designs):
            cap = _BEYOND * (np.max(np.abs(losses), initial=0.0, where=np.isfinite(losses)) or 1.0)
        finite = np.nan_to_num(losses, nan=0.0, posinf=cap, neginf=-cap)
        told = _population(designs, study.design)
        static = _pymoo("problems.static").StaticProblem(problem, F=finite, G=violations)
        _pymoo("core.evaluator").Evaluator().eval(static, told)
        algorithm.tell(infills=told)


def marks(study: Study, results: Mapping[str, Array]) -> tuple[Array, Array]:
    """Losses (designs, objectives), smaller is better, and violations (designs, constraints and one), 0 where kept.

    The loss is the mean over the samples of the worst case, as in `judge`. A violation is by how much, relative to
    the limit, the worst case misses it in the last of those samples in which it has to hold; the further one tells
    that an objective does not exist.
    """
    by_design = worst(study, results)
    scores = [by_design[o.quantity] * (-1.0 if o.goal == "max" else 1.0) for o in study.objectives]
    losses = np.stack([np.mean(score, axis=1) for score in scores], axis=1)
    missed = [np.where(np.any(np.isnan(losses), axis=1), _FAR, 0.0)]
    for c in study.constraints:
        values = study.shaped(results[c.quantity])
        with np.errstate(invalid="ignore"):
            below = np.where(values < c.at_least, (c.at_least - values) / (abs(c.at_least) or 1.0), 0.0)
            above = np.where(values > c.at_most, (values - c.at_most) / (abs(c.at_most) or 1.0), 0.0)
        by = np.where(np.isnan(values), _FAR, np.minimum(np.maximum(below, above), _FAR))
        samples = np.sort(np.max(by, axis=1), axis=1)
        shares = np.arange(1, samples.shape[1] + 1) / samples.shape[1]
        missed.append(samples[:, int(np.argmax(shares >= study.confidence))])
    return losses, np.stack(missed, axis=1)


def _nsga2(study: Study) -> tuple[Any, Any]:
    """The problem and the algorithm, whose first generation is an even spread."""
    nsga2, mixed = _pymoo("algorithms.moo.nsga2"), _pymoo("core.mixed")
    problem = _pymoo("core.problem").Problem(
        vars={str(i): variable for i, f in enumerate(study.design) if (variable := _variable(f)) is not None},
        n_obj=len(study.objectives),
        n_ieq_constr=len(study.constraints) + 1,
    )
    once = mixed.MixedVariableDuplicateElimination()
    tournament = _pymoo("operators.selection.tournament").TournamentSelection(func_comp=nsga2.binary_tournament)
    algorithm = nsga2.NSGA2(
        pop_size=study.population,
        sampling=_population(plan(study.design, "latin-hypercube", study.population, study.seed), study.design),
        mating=mixed.MixedVariableMating(selection=tournament, eliminate_duplicates=once),
        eliminate_duplicates=once,
    )
    never = _pymoo("core.termination").NoTermination()
    algorithm.setup(problem, seed=study.seed, termination=never, verbose=False)
    return problem, algorithm


def _variable(factor: Factor) -> Any:
    """How the optimiser varies a factor: a quantile, the place in an ordered list, or an entry of any other list."""
    variable, last = _pymoo("core.variable"), len(factor.choices) - 1
    if not factor.choices:
        return variable.Real(bounds=(0.0, 1.0))
    if last == 0:
        return None
    return variable.Integer(bounds=(0, last)) if _ordered(factor) else variable.Choice(options=list(range(last + 1)))


def _ordered(factor: Factor) -> bool:
    """Whether a list holds numbers, of one unit, that rise or fall throughout."""
    parts = [number_and_unit(v) if isinstance(v, str) else (v, "") for v in factor.choices]
    numbers = [p[0] for p in parts if p is not None and isinstance(p[0], int | float)]
    if len(numbers) < len(parts) or len({p[1] for p in parts if p is not None}) > 1:
        return False
    return len({b > a for a, b in pairwise(numbers) if b != a}) == 1 and len(set(numbers)) == len(numbers)


def _population(designs: Array, factors: Sequence[Factor]) -> Any:
    """Designs as the optimiser has them; entries of lists by number."""
    rows = [
        {
            str(i): int(f.numbers(u)) if f.choices else float(u)
            for i, (f, u) in enumerate(zip(factors, row, strict=True))
            if len(f.choices) != 1
        }
        for row in designs
    ]
    return _pymoo("core.population").Population.new(X=rows)


def _designs(population: Any, factors: Sequence[Factor]) -> Iterator[tuple[float, ...]]:
    for entry in population.get("X"):
        yield tuple(_quantile(f, entry.get(str(i), 0)) for i, f in enumerate(factors))


def _quantile(factor: Factor, value: float) -> float:
    """A quantile; the middle of its share for an entry of a list."""
    return (int(value) + 0.5) / len(factor.choices) if factor.choices else float(value)


def _random(factors: Sequence[Factor], rng: np.random.Generator) -> Iterator[tuple[float, ...]]:
    while True:
        row = rng.random(len(factors))
        yield tuple(_quantile(f, float(f.numbers(u)) if f.choices else u) for f, u in zip(factors, row, strict=True))


def _new(
    asked: Iterable[tuple[float, ...]],
    random: Iterator[tuple[float, ...]],
    seen: set[tuple[float, ...]],
    count: int,
) -> Array:
    """So many different designs that were not seen before: those asked for, then random ones."""
    found: dict[tuple[float, ...], None] = {}
    for source in (asked, random):
        for row in source:
            if row not in seen:
                found[row] = None
            if len(found) == count:
                return np.array(list(found))
    raise AssertionError("random designs do not end")


def _pymoo(module: str) -> Any:
    try:
        return importlib.import_module(f"pymoo.{module}")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "pymoo":
            raise
        raise InputError(
            "method = \"pareto\": pymoo is not installed, expected pip install 'jointlib[optimise]'"
        ) from None
