"""A study file: ``schema = "jointlib/study/1"``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array

from ..files.named_tools import USE
from .conditions import Case
from .factors import Factor
from .sampling import SEARCH, plan, plan_size

BASE = "base"
"""Path of a factor that takes whole machine files."""
ROUNDING = 1e-9
"""Share of a result by which two that are alike may differ."""
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
    asked_tools: tuple[str, ...] = ()
    """Tools that were asked for beside the file, in the place of those it names."""

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

    @property
    def with_tools(self) -> tuple[tuple[tuple[str, str], ...], ...]:
        """Changes of a machine file that put in each of the tools; none where it is the one that the file says."""
        return tuple(dict.fromkeys(((USE, case.tool),) if case.tool else () for case in self.cases))

    def case(self, row: int) -> Case:
        """The conditions of a row of the plan."""
        return self.cases[row // self._drawn % len(self.cases)]

    def shaped(self, values: Array) -> Array:
        """Results of all rows as an array (designs, cases, samples)."""
        return values.reshape(-1, len(self.cases), self._drawn)
