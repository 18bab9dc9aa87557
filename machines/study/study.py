"""A study file: ``schema = "jointlib/study/1"``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section, read_toml

from ..lobes import METHODS as LOBES
from .conditions import Case, read_cases
from .factors import IDENTIFICATION, Factor
from .sampling import METHODS, SEARCH, checked_search, plan, plan_size, refuse_many

BASE = "base"
"""Path of a factor that takes whole machine files."""
ROUNDING = 1e-9
"""Share of a result by which two that are alike may differ."""
_MOST_SPEEDS = 10_000
_TAKEN = ("design", "case", "sample")
"""Names of columns of a table beside those of the factors."""
QUANTITIES: Mapping[str, tuple[str, str]] = {
    "minimum-depth": ("m", "depth below which every speed is stable"),
    "pocket-depth": ("m", "recommended depth between the lobes"),
    "pocket-speed": ("rpm", "speed it is recommended at"),
    "removal-rate": ("m^3/s", "material removed per time there"),
    "static-compliance": ("m/N", "yield of the tool point under a constant force, the larger of x and y"),
    "peak-receptance": ("m/N", "largest receptance of the tool point, the larger of x and y"),
    "weight": ("kg", "mass of the components"),
}
"""What a configuration can be judged by, with its unit."""


@dataclass(frozen=True)
class Objective:
    """A quantity to be made large or small."""

    quantity: str
    goal: str
    """``max`` or ``min``."""


@dataclass(frozen=True)
class Constraint:
    """A quantity that must stay inside a range (in its unit)."""

    quantity: str
    at_least: float
    at_most: float


@dataclass(frozen=True, eq=False)
class Study:
    """What is varied, under which conditions, and what counts."""

    name: str
    base: Path
    factors: tuple[Factor, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    speeds: Array
    """Spindle speeds in rpm at which the lobes are computed; empty: so many over the range of the machine file."""
    speed_count: int
    amplitudes: tuple[float, ...]
    """Tool-point amplitudes in m over which the lowest limit counts."""
    lobes: str | None
    """Method of the stability lobes; None: the fast one of the process, zero order in milling."""
    method: str
    """Plan of the design factors."""
    count: int
    seed: int
    samples: int
    """Samples of the uncertain factors, the same for every design."""
    confidence: float
    """Share of the samples in which a constraint must hold."""
    cases: tuple[Case, ...]
    """Conditions, at least one, in all of which every design is computed."""
    source: Path
    population: int = 0
    """Designs in a generation of a search; 0 for other plans."""
    found: Array | None = None
    """Designs that a search has planned, as quantiles (designs, design factors)."""

    @property
    def searched(self) -> bool:
        """Whether designs are planned as the results of others are known."""
        return self.method == SEARCH

    @property
    def quantities(self) -> tuple[str, ...]:
        """What is computed of every configuration: what counts, and the speed of a recommended depth."""
        asked = [*(o.quantity for o in self.objectives), *(c.quantity for c in self.constraints)]
        speed = ["pocket-speed"] if {"pocket-depth", "removal-rate"} & set(asked) else []
        return tuple(sorted({*asked, *speed}))

    @property
    def design(self) -> tuple[Factor, ...]:
        """Factors that can be chosen."""
        return tuple(f for f in self.factors if not f.uncertain)

    @property
    def uncertain(self) -> tuple[Factor, ...]:
        """Factors that cannot."""
        return tuple(f for f in self.factors if f.uncertain)

    def numbers(self) -> Array:
        """A row per configuration with the number of every factor, in the order of `factors`.

        Every design is followed by its cases, and every case by its samples of what is uncertain; the samples are the
        same for all.
        """
        chosen = self._chosen()
        samples = np.zeros((1, 0))
        if self.uncertain:
            samples = plan(self.uncertain, "latin-hypercube", self.samples, self.seed + 1)
        rows = len(chosen) * len(self.cases)
        quantiles = {f.name: np.repeat(chosen[:, i], self.repeats) for i, f in enumerate(self.design)}
        quantiles |= {f.name: np.tile(samples[:, i], rows) for i, f in enumerate(self.uncertain)}
        return np.stack([f.numbers(quantiles[f.name]) for f in self.factors], axis=1)

    def _chosen(self) -> Array:
        if self.searched:
            return np.zeros((0, len(self.design))) if self.found is None else self.found
        return plan(self.design, self.method, self.count, self.seed) if self.design else np.zeros((1, 0))

    @property
    def total(self) -> int:
        """How many configurations there are, those a search has not planned yet included."""
        return self.repeats * (plan_size(self.design, self.method, self.count) if self.design else 1)

    @property
    def repeats(self) -> int:
        """Configurations per design: cases × samples."""
        return len(self.cases) * self._drawn

    @property
    def _drawn(self) -> int:
        return self.samples if self.uncertain else 1

    @property
    def together(self) -> int:
        """Configurations that no block may part: where a pocket counts, the samples that have its speed in common."""
        return self._drawn if "pocket-speed" in self.quantities else 1

    def case(self, row: int) -> Case:
        """The conditions of a row of the plan."""
        return self.cases[row // self._drawn % len(self.cases)]

    def shaped(self, values: Array) -> Array:
        """Results of all rows as an array (designs, cases, samples)."""
        return values.reshape(-1, len(self.cases), self._drawn)


def read_study(path: Path | str) -> Study:
    """The study in a file; the machine it starts from is only named."""
    path = Path(path)
    document = read_toml(path, "study")
    name = document.text("name", path.name.removesuffix(".toml").removesuffix(".study"))
    base = path.parent / document.text("base")
    factors = tuple(Factor.from_section(section) for section in document.sections("factor"))
    objectives = tuple(_objective(section) for section in document.sections("objective"))
    constraints = tuple(_constraint(section) for section in document.sections("constraint"))
    conditions = document.section("conditions")
    speed = conditions.numbers("speed", "rpm", None, length=2)
    count = conditions.integer("speeds", 100, lower=1)
    if count > _MOST_SPEEDS:
        raise InputError(f"{conditions.where}: speeds is {count:,}, expected at most {_MOST_SPEEDS:,}")
    amplitudes = conditions.numbers("amplitude", "m", (0.0,))
    lobes = conditions.text("lobes", None, tuple(LOBES))
    cases = read_cases(conditions)
    conditions.done()
    sampling = document.section("sampling")
    samples = sampling.integer("samples", 50 if any(f.uncertain for f in factors) else 1, lower=1)
    drawn = tuple(range(samples))
    factors = tuple(replace(f, choices=drawn) if f.path == IDENTIFICATION else f for f in factors)
    method, designs = sampling.text("method", "factorial", METHODS), sampling.integer("count", 128, lower=1)
    study = Study(
        name,
        base,
        factors,
        objectives,
        constraints,
        np.array([]) if speed is None else np.linspace(speed[0], speed[1], count),
        count,
        amplitudes,
        lobes,
        method,
        designs,
        sampling.integer("seed", 0),
        samples,
        sampling.number("confidence", "1", 0.95),
        cases,
        path,
        sampling.integer("population", max(2, math.isqrt(designs)), lower=2) if method == SEARCH else 0,
    )
    sampling.done()
    document.done()
    return _checked(study)


def _checked(study: Study) -> Study:
    where = str(study.source)
    if not study.factors:
        raise InputError(f"{where}: no [[factor]], expected at least one")
    if not study.objectives:
        raise InputError(f"{where}: no [[objective]], expected at least one of {', '.join(QUANTITIES)}")
    for key, values in (("name", [f.name for f in study.factors]), ("path", [f.path for f in study.factors])):
        for value in values:
            if values.count(value) > 1:
                raise InputError(f"{where}: two factors have the {key} {value!r}, expected different ones")
    for f in study.factors:
        if f.name in _TAKEN:
            raise InputError(f"{where}: a factor has the name {f.name!r}, a column that tables have anyway")
    if len(study.speeds) and not 0 < study.speeds[0] <= study.speeds[-1]:
        raise InputError(f"{where}: [conditions]: speed is not ascending, expected [low, high] in rpm")
    if any(A < 0 for A in study.amplitudes) or not study.amplitudes:
        raise InputError(f"{where}: [conditions]: amplitude {list(study.amplitudes)}, expected lengths of at least 0")
    if not 0 < study.confidence <= 1:
        raise InputError(
            f"{where}: [sampling]: confidence is {study.confidence:g}, expected a share above 0, at most 1"
        )
    if study.searched:
        checked_search(study.design, study.count, study.population, where)
    try:
        refuse_many(study.total, "configurations")
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    told = {path for case in study.cases for path in case.changes}
    for i, f in enumerate(study.factors):
        if f.path == BASE and not (f.choices and all(isinstance(value, str) for value in f.choices)):
            raise InputError(f"{where}: factor {f.name!r} changes the base machine, expected values = [files]")
        for path in sorted(f.paths & told):
            raise InputError(f"{where}: {path} is a factor and stands in [conditions], expected one of the two")
        for later in study.factors[i + 1 :]:
            if lost := sorted(path for path in f.paths if any(_holds(over, path) for over in later.paths)):
                raise InputError(
                    f"{where}: factor {later.name!r} puts its values over {lost[0]} of factor {f.name!r}, expected "
                    "different keys, or the factor of the whole before that of its part"
                )
    for o in study.objectives:
        if [other.quantity for other in study.objectives].count(o.quantity) > 1:
            raise InputError(f"{where}: two objectives ask for {o.quantity!r}, expected different ones")
    return study


def _holds(over: str, path: str) -> bool:
    """Whether what stands at ``over`` holds ``path``; parameters of a joint are set after all else."""
    return path == over or (path.startswith((f"{over}.", f"{over}[")) and ".joint." not in path)


def _quantity(section: Section) -> str:
    word = section.text("quantity")
    if word not in QUANTITIES:
        raise InputError(f"{section.where}: quantity is {word!r}, {nearest(word, QUANTITIES)}")
    return word


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
