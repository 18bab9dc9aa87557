"""What a study varies: places in the machine file, and the values they take."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.toml import Section
from jointlib.units import HUGE, number_and_unit

IDENTIFICATION = "identification"
"""Path of the factor that stands for what the identification left open: joints and measured FRFs, drawn together."""
DISTRIBUTIONS = ("uniform", "log-uniform", "normal", "log-normal")
_WIDEST = 1e-12
"""Quantiles beyond this are cut off, so that a normal value stays finite."""


@dataclass(frozen=True)
class Factor:
    """A key of the machine file, named by its path, with a list of values or a continuous range of them.

    Values are those of a machine file: numbers in SI, strings with their unit, or whatever else stands there.
    """

    name: str
    path: str
    choices: tuple[Any, ...] = ()
    """The list; empty for a continuous factor."""
    labels: tuple[str, ...] = ()
    """What people call the values of the list; empty: the values themselves."""
    distribution: str = "uniform"
    low: float = 0.0
    """Lower end of a uniform range; mean or median of a normal one."""
    high: float = 0.0
    """Upper end of a uniform range; standard deviation of a normal one (of the logarithm for log-normal)."""
    unit: str = ""
    levels: int = 0
    """Values in a full factorial plan; 0 where none was given."""
    uncertain: bool = False
    """True for what cannot be chosen: it is averaged over, never optimised."""

    def numbers(self, quantile: Array) -> Array:
        """Number in `unit`, or index into the list, at quantiles in [0, 1]."""
        u = np.asarray(quantile, dtype=float)
        if self.choices:
            return np.asarray(np.minimum(np.floor(u * len(self.choices)), len(self.choices) - 1))
        if self.distribution == "uniform":
            return self.low + u * (self.high - self.low)
        if self.distribution == "log-uniform":
            return np.asarray(self.low * (self.high / self.low) ** u)
        z = scipy.special.ndtri(np.clip(u, _WIDEST, 1 - _WIDEST))
        shifted = self.low + self.high * z if self.distribution == "normal" else self.low * np.exp(self.high * z)
        return np.asarray(shifted)

    def value(self, number: float) -> Any:
        """What stands in the machine file for a number of `numbers`."""
        if self.choices:
            return self.choices[int(number)]
        return f"{float(number)!r} {self.unit}" if self.unit else float(number)

    def words(self, number: float) -> str:
        """The value as people read it."""
        if self.labels:
            return self.labels[int(number)]
        return _told(self.value(number)) if self.choices else f"{number:.6g} {self.unit}".rstrip()

    @property
    def paths(self) -> set[str]:
        """What it sets: its path, or those of the keys of its tables."""
        tables = [value for value in self.choices if isinstance(value, dict)]
        return {f"{self.path}.{key}" for table in tables for key in table} or {self.path}

    @property
    def midpoints(self) -> Array:
        """Quantiles of a full factorial plan."""
        count = len(self.choices) or self.levels
        if self.choices:
            return (np.arange(count) + 0.5) / count
        ends = self.distribution in ("uniform", "log-uniform")
        return np.linspace(0.0, 1.0, count) if ends and count > 1 else (np.arange(count) + 0.5) / count

    @classmethod
    def from_section(cls, section: Section) -> Factor:
        """Read ``[[factor]]``: path, and one of values, range, or distribution."""
        path = section.text("path")
        name = section.text("name", path.rsplit(".", 1)[-1])
        if not name.strip():
            raise InputError(f"{section.where}: name is {name!r}, expected a word")
        uncertain = section.text("role", "design", ("design", "uncertain")) == "uncertain"
        given = [key for key in ("values", "range", "distribution") if section.has(key)]
        if path == IDENTIFICATION:
            if given or not uncertain:
                raise InputError(
                    f"{section.where}: path {path!r} draws from the covariance of the joints and the variance of the "
                    'measured FRFs, expected role = "uncertain" and no values, range or distribution'
                )
            section.done()
            return cls(name, path, uncertain=True)
        if len(given) != 1:
            said = " and ".join(given) or "no values"
            for key in ("values", "range", "distribution", "levels", "scale", "words"):
                section.take(key, None)
            section.done()
            raise InputError(f"{section.where}: {said} given, expected one of values, range, distribution")
        if given == ["values"]:
            choices, labels = _listed(section)
            section.done()
            return cls(name, path, choices, labels, uncertain=uncertain)
        levels = section.integer("levels", 0)
        if given == ["range"]:
            ends = section.take("range")
            scale = section.text("scale", "linear", ("linear", "log"))
            section.done()
            if not isinstance(ends, list) or len(ends) != 2:
                raise InputError(f"{section.where}: range is {ends!r}, expected [low, high]")
            (low, unit), (high, other) = (_number(end, f"{section.where}: range") for end in ends)
            kind = "uniform" if scale == "linear" else "log-uniform"
        else:
            table = section.section("distribution")
            kind = table.text("kind", choices=("normal", "log-normal"))
            middle = table.take("mean") if kind == "normal" else table.take("median")
            deviation = table.take("deviation")
            table.done()
            section.done()
            low, unit = _number(middle, f"{table.where}: mean or median")
            high, other = _number(deviation, f"{table.where}: deviation")
            if kind == "log-normal" and other:
                raise InputError(
                    f"{table.where}: deviation has the unit {other!r}, expected a number: it is that of the logarithm"
                )
            other = unit if kind == "log-normal" else other
        return cls(name, path, (), (), kind, low, high, _one(unit, other, section.where), levels, uncertain)._checked(
            section
        )

    def _checked(self, section: Section) -> Factor:
        ends = self.distribution in ("uniform", "log-uniform")
        if ends and not self.low < self.high:
            raise InputError(f"{section.where}: range from {self.low:g} to {self.high:g} is empty, expected low < high")
        if not ends and self.high <= 0:
            raise InputError(f"{section.where}: deviation is {self.high:g}, expected more than 0")
        if self.distribution in ("log-uniform", "log-normal") and self.low <= 0:
            raise InputError(f"{section.where}: {self.low:g} has no logarithm, expected more than 0")
        return self


def _listed(section: Section) -> tuple[tuple[Any, ...], tuple[str, ...]]:
    """The values of a list and what people call them."""
    choices = section.take("values")
    if not isinstance(choices, list) or not choices:
        raise InputError(f"{section.where}: values is {choices!r}, expected a list of at least one value")
    if not all(_finite(choice) for choice in choices):
        section.fault("values holds a number that is not finite, expected finite ones", sure=True)
    labels = section.words("words", ())
    if labels and len(labels) != len(choices):
        section.fault(f"{len(labels)} words for {len(choices)} values, expected as many")
    for key, held in (("values", choices), ("words", list(labels))):
        for i, value in enumerate(held):
            if value in held[:i]:
                section.fault(f"{key} names {value!r} twice, expected different ones")
    if section.take("levels", None) is not None:
        section.fault("levels and values given, expected levels with a range only")
    return tuple(choices), labels


def _finite(value: Any) -> bool:
    """Whether every number in nested lists and tables can be computed with."""
    if isinstance(value, list | dict):
        return all(_finite(part) for part in (value.values() if isinstance(value, dict) else value))
    return not isinstance(value, int | float) or abs(value) <= HUGE


def _told(value: Any) -> str:
    """A value of a list where no words were given for it: ``preload 1 kN, width 45 mm`` for a table."""
    return ", ".join(f"{key} {v}" for key, v in value.items()) if isinstance(value, dict) else str(value)


def _number(value: Any, where: str) -> tuple[float, str]:
    """A number and its unit, as it stands in the file."""
    parts = number_and_unit(value) if isinstance(value, str) else None
    if parts is None and isinstance(value, int | float) and not isinstance(value, bool):
        parts = (float(value) if abs(value) <= HUGE else math.inf), ""
    if parts is not None and abs(parts[0]) <= HUGE:
        return parts
    raise InputError(f"{where}: {value!r}, expected a finite number or a string with a unit")


def _one(unit: str, other: str, where: str) -> str:
    if unit != other:
        raise InputError(f"{where}: units {unit or 'none'!r} and {other or 'none'!r} differ, expected the same")
    return unit
