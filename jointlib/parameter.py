"""A physical parameter: one dataclass field that knows its unit, its role and its bounds."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from enum import Enum
from functools import cache
from typing import Any

import numpy as np

from jointlib.errors import InputError

_KEY = "jointlib.parameter"


class Role(Enum):
    """What a parameter does; a modulation scales parameters by role and never asks which law they belong to."""

    STIFFNESS = "stiffness"
    DAMPING = "damping"
    SLIP_FORCE = "slip force"
    CLEARANCE = "clearance"
    PRELOAD = "preload"
    SMOOTHING = "smoothing"
    """A numerical aid: it rounds a corner that records do not resolve, and no fit tells it."""
    SHAPE = "shape"


@dataclass(frozen=True)
class Parameter:
    """Unit, role and open or closed bounds of one field of a law; ``name`` is the field's name."""

    unit: str
    role: Role = Role.SHAPE
    lower: float = -np.inf
    upper: float = np.inf
    above: float = -np.inf
    """The value must lie strictly above this one."""
    table: bool = False
    """True for a rectangular table of coefficients c[i][j] of z^i ż^j or T_i T_j."""
    listed: bool = False
    """True for a list with one entry for each of several elements in parallel."""
    name: str = ""


def parameter(
    unit: str,
    *,
    role: Role = Role.SHAPE,
    lower: float = -np.inf,
    upper: float = np.inf,
    above: float = -np.inf,
    table: bool = False,
    listed: bool = False,
    default: Any = dataclasses.MISSING,
) -> Any:
    """Declare a dataclass field as a physical parameter in SI; files, fits, docs and FMUs read the unit here."""
    declared = Parameter(unit, role, lower, upper, above, table, listed)
    return dataclasses.field(default=default, metadata={_KEY: declared})


def parameters_of(law: Any) -> tuple[Parameter, ...]:
    """The parameters of a law (class or object), in the order of its fields."""
    return _declared(law if isinstance(law, type) else type(law))


@cache
def _declared(law: type) -> tuple[Parameter, ...]:
    fields: Any = dataclasses.fields(law)
    return tuple(dataclasses.replace(f.metadata[_KEY], name=f.name) for f in fields if _KEY in f.metadata)


def _within(value: float, p: Parameter) -> bool:
    return p.above < value and p.lower <= value <= p.upper


def check(law: Any, kind: str) -> None:
    """Refuse a parameter that is not finite or out of bounds, naming the law and the field."""
    for p in parameters_of(law):
        given = getattr(law, p.name)
        # A plain number within its bounds, which is what a search asks about ten thousand times.
        if type(given) is float and not (p.table or p.listed) and math.isfinite(given) and _within(given, p):
            continue
        try:
            value = np.asarray(getattr(law, p.name), dtype=float)
        except (TypeError, ValueError):
            shape = "a rectangular table of numbers" if p.table else "a list of numbers" if p.listed else "a number"
            raise InputError(f"{kind}: {p.name} is {getattr(law, p.name)!r}, expected {shape} in {p.unit}") from None
        if p.table and (value.ndim != 2 or value.size == 0):
            raise InputError(f"{kind}: {p.name} has shape {value.shape}, expected a table coefficients[i][j]")
        if p.listed and (value.ndim == 0 or value.size == 0):
            raise InputError(f"{kind}: {p.name} is {getattr(law, p.name)!r}, expected a list of numbers in {p.unit}")
        if not np.all(np.isfinite(value)):
            raise InputError(f"{kind}: {p.name} is {getattr(law, p.name)!r}, expected a finite number in {p.unit}")
        unit = "" if p.unit == "1" else f" {p.unit}"
        if np.any(value < p.lower) or np.any(value > p.upper) or np.any(value <= p.above):
            words = (("above", p.above), ("at least", p.lower), ("at most", p.upper))
            bounds = [f"{word} {limit:g}" for word, limit in words if np.isfinite(limit)]
            raise InputError(f"{kind}: {p.name} is {value}{unit}, expected {' and '.join(bounds)}{unit}")
