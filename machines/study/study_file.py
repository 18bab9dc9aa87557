"""Study files: ``schema = "jointlib/study/1"``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, together
from jointlib.io.mistakes import Lost, Mistakes, all_at_once
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml

from ..cutting.process.chart import METHODS as LOBES
from ..files.named_tools import USE
from .conditions import Case, read_cases
from .factors import IDENTIFICATION, Factor
from .sampling import METHODS, SEARCH, checked_search, refuse_many
from .study import BASE, QUANTITIES, Constraint, Objective, Study

_MOST_SPEEDS = 10_000
_MOST = 1_000_000
_TAKEN = ("design", "case", "sample")
"""Names of columns of a table beside those of the factors."""


def read_study(path: Path | str, tools: Sequence[str] = ()) -> Study:
    """The study in a file; the machine it starts from is only named.

    Every design is judged with each of these ``tools`` of the machine, by default those that the file names.
    """
    path = Path(path)

    def read(mistakes: Mistakes) -> Study:
        study = read_toml(path, "study", mistakes).read(lambda document: _study(path, document, tuple(tools)))
        if study is None:
            raise Lost
        return study

    return all_at_once(read)


def _study(path: Path, document: Section, tools: tuple[str, ...]) -> Study:
    name = document.text("name", path.name.removesuffix(".toml").removesuffix(".study"))
    base = path.parent / document.text("base")
    factors, lost = document.each("factor", Factor.from_section, needed=True)
    objectives, unread = document.each("objective", _objective)
    if not objectives and not unread:
        document.fault(f"no [[objective]], expected at least one of {', '.join(QUANTITIES)}")
    constraints, _ = document.each("constraint", _constraint)
    conditions = document.section("conditions").read(lambda table: _conditions(table, tools))
    sampled = document.section("sampling").read(lambda table: _sampling(table, factors))
    document.done()
    if conditions is None or sampled is None or lost or not objectives:
        together(*_apart(str(path), factors, objectives))
        raise Lost
    speeds, speed_count, amplitudes, lobes, cases = conditions
    method, count, seed, samples, confidence, population = sampled
    drawn = tuple(range(samples))
    study = Study(
        name,
        base,
        tuple(replace(f, choices=drawn) if f.path == IDENTIFICATION else f for f in factors),
        tuple(objectives),
        tuple(constraints),
        speeds,
        speed_count,
        amplitudes,
        lobes,
        method,
        count,
        seed,
        samples,
        confidence,
        cases,
        path,
        population,
        asked_tools=tools,
    )
    together(*_apart(str(path), factors, objectives), partial(_check_plan, study), partial(_check_told, study))
    return study


def _conditions(
    table: Section, tools: Sequence[str]
) -> tuple[Array, int, tuple[float, ...], str | None, tuple[Case, ...]]:
    """Speeds in rpm and how many, amplitudes in m, method of the lobes, and the cases."""
    speed = table.numbers("speed", "rpm", None, length=2)
    if speed is not None and not 0 < speed[0] <= speed[1]:
        table.fault("speed is not ascending, expected [low, high] in rpm")
    count = table.integer("speeds", 100, lower=1)
    if count > _MOST_SPEEDS:
        table.fault(f"speeds is {count:,}, expected at most {_MOST_SPEEDS:,}")
    amplitudes = table.numbers("amplitude", "m", (0.0,))
    if any(A < 0 for A in amplitudes) or not amplitudes:
        table.fault(f"amplitude is {list(amplitudes)}, expected lengths of at least 0")
    lobes = table.text("lobes", None, tuple(LOBES))
    cases = read_cases(table, tools)
    table.done()
    speeds = np.array([]) if speed is None else np.linspace(speed[0], speed[1], min(count, _MOST_SPEEDS))
    return speeds, count, amplitudes, lobes, cases


def _sampling(table: Section, factors: Sequence[Factor]) -> tuple[str, int, int, int, float, int]:
    """Plan, designs, seed, samples, confidence, and designs in a generation of a search (0 for other plans)."""
    samples = table.integer("samples", 50 if any(f.uncertain for f in factors) else 1, lower=1, upper=_MOST)
    method, designs = table.text("method", "factorial", METHODS), table.integer("count", 128, lower=1, upper=_MOST)
    seed, confidence = table.integer("seed", 0), table.number("confidence", "1", 0.95)
    if not 0 < confidence <= 1:
        table.fault(f"confidence is {confidence:g}, expected a share above 0, at most 1")
    population = 0
    if method == SEARCH:
        population = table.integer("population", max(2, math.isqrt(designs)), lower=2)
    table.done()
    return method, designs, seed, samples, confidence, population


def _apart(where: str, factors: Sequence[Factor], objectives: Sequence[Objective]) -> Iterator[Callable[[], object]]:
    """Checks that what is varied and what counts can be told apart."""

    def different(key: str, values: Sequence[str]) -> None:
        twice = dict.fromkeys(value for value in values if values.count(value) > 1)
        if twice:
            said = (f"two factors have the {key} {value!r}, expected different ones" for value in twice)
            raise InputError(*(f"{where}: {each}" for each in said))

    def taken(name: str) -> None:
        if name in _TAKEN:
            raise InputError(f"{where}: a factor has the name {name!r}, a column that tables have anyway")

    def once(quantity: str) -> None:
        if [other.quantity for other in objectives].count(quantity) > 1:
            raise InputError(f"{where}: two objectives ask for {quantity!r}, expected different ones")

    yield partial(different, "name", [f.name for f in factors])
    yield partial(different, "path", [f.path for f in factors])
    yield from (partial(taken, f.name) for f in factors)
    yield from (partial(once, o.quantity) for o in objectives)


def _check_plan(study: Study) -> None:
    where = str(study.source)
    if study.searched:
        checked_search(study.design, study.count, study.population, where)
    try:
        refuse_many(study.total, "configurations")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _check_told(study: Study) -> None:
    """No place of the machine file may be told twice."""
    where = str(study.source)
    told = {path for case in study.cases for path in case.changes}
    for i, f in enumerate(study.factors):
        if f.path == BASE and not (f.choices and all(isinstance(value, str) for value in f.choices)):
            raise InputError(f"{where}: factor {f.name!r} changes the base machine, expected values = [files]")
        for path in sorted(f.paths & told):
            other = "is given by --tool" if path == USE and study.asked_tools else "stands in [conditions]"
            raise InputError(f"{where}: {path} is a factor and {other}, expected one of the two")
        for later in study.factors[i + 1 :]:
            if lost := sorted(path for path in f.paths if any(_holds(over, path) for over in later.paths)):
                raise InputError(
                    f"{where}: factor {later.name!r} puts its values over {lost[0]} of factor {f.name!r}, expected "
                    "different keys, or the factor of the whole before that of its part"
                )


def _holds(over: str, path: str) -> bool:
    """Whether what stands at ``over`` holds ``path``; parameters of a joint are set after all else."""
    return path == over or (path.startswith((f"{over}.", f"{over}[")) and ".joint." not in path)


def _quantity(section: Section) -> str:
    return section.text("quantity", choices=tuple(QUANTITIES))


def _objective(section: Section) -> Objective:
    found = Objective(_quantity(section), section.text("goal", choices=("max", "min")))
    section.done()
    return found


def _constraint(section: Section) -> Constraint:
    quantity = _quantity(section)
    unit = QUANTITIES[quantity][0]
    found = Constraint(quantity, section.number("at_least", unit, -np.inf), section.number("at_most", unit, np.inf))
    section.done()
    if found.at_least > found.at_most:
        raise InputError(
            f"{section.where}: at_least is {found.at_least:g} and at_most {found.at_most:g} {unit}, "
            "expected at_least below at_most"
        )
    if np.isinf(found.at_least) and np.isinf(found.at_most):
        raise InputError(f"{section.where}: no limit given, expected at_least or at_most")
    return found
