"""What of a machine can be changed while one looks at it: numbers with bounds, as people read them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from jointlib.errors import InputError, nearest
from jointlib.units import number_and_unit, quantity

AMPLITUDE = "amplitude"
"""Key of the tool-point amplitude, which is no part of a machine file."""
_ROUNDING = 1e-9
"""Share by which a page may miss a bound, having gone over logarithms and back."""
_HALVINGS = 6
_NARROW = 2.0
"""Up to this factor a straight scale serves."""


@dataclass(frozen=True)
class Control:
    """One number that may be changed, in the unit in which people read it.

    ``key`` is its path in the machine file, see `machines.files.changes.change`, and the factors of a study.
    """

    key: str
    label: str
    group: str
    unit: str
    value: float
    low: float
    high: float
    logarithmic: bool = False
    whole: bool = False
    scale: float = 1.0
    """One ``unit`` in SI."""
    moves: tuple[tuple[str, float], ...] = ()
    """Paths that move together by as much as this does, with their values in SI; empty: the key itself."""
    choices: tuple[tuple[str, str], ...] = ()
    """What the numbers 1, 2, … stand for: a name, and what the machine file has then; empty: numbers."""

    def told(self, value: float) -> str:
        """A value as people read it in a field."""
        return self.choices[round(value) - 1][0] if self.choices else shown(value)

    def checked(self, value: object) -> float:
        """The value as a number within the bounds; text may carry another unit of the same kind."""
        number = self._chosen(value) if self.choices else self._number(value)
        if number == self.value:
            return self.value  # what the file has may lie beyond what is sensible
        slack = _ROUNDING * max(abs(self.low), abs(self.high))
        if number is None and self.choices:
            known = ", ".join(name for name, _ in self.choices)
            raise InputError(f"{self.group}, {self.label}: {str(value)[:40]!r}, expected one of {known}")
        if number is None or not self.low - slack <= number <= self.high + slack:
            shown = repr(value) if len(repr(value)) < 40 else "something long"
            raise InputError(
                f"{self.group}, {self.label}: {shown}, expected {'a whole number' if self.whole else 'a number'} from "
                f"{self.low:g} to {self.high:g}{f' {self.unit}' if self.unit else ''}"
            )
        return min(max(number, self.low), self.high)

    def _chosen(self, value: object) -> float | None:
        """The number of a name, of what stands for it in the file, or of a number that is one of them."""
        for number, names in enumerate(self.choices, start=1):
            if value in names or value == number:
                return float(number)
        return None

    def _number(self, value: object) -> float | None:
        if isinstance(value, str):
            parts = number_and_unit(value)
            if parts is None or (parts[1] and not self.unit):
                return None
            number, unit = parts
            if unit and unit != self.unit:
                number = quantity(value, self.unit, f"{self.group}, {self.label}")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            number = float(value) if abs(value) < 1e300 else math.inf
        else:
            return None
        return number if math.isfinite(number) and (not self.whole or number == round(number)) else None

    def si(self, value: float) -> float:
        """The value in SI."""
        return in_si(value, self.scale)

    def changes(self, value: float) -> dict[str, Any]:
        """What is then to stand in the machine file, by path."""
        if value == self.value or self.key == AMPLITUDE:
            return {}
        if self.choices:
            return {self.key: self.choices[round(value) - 1][1]}
        if self.moves:
            moved = self.si(value) - self.si(self.value)
            return {path: base + moved for path, base in self.moves}
        return {self.key: round(value) if self.whole else self.si(value)}


def shown(value: float) -> str:
    """A number as people read it in a field."""
    return re.sub(r"e([+-])0+", r"e\1", f"{value:.5g}").replace("e+", "e")


def in_si(value: float, scale: float) -> float:
    """A number of a unit of this size in SI: 5 µm is the float that 5e-6 is."""
    inverse = 1 / scale
    whole = round(inverse)
    return value / whole if whole and abs(inverse - whole) < 1e-9 * whole else value * scale


def bounds(
    value: float, factor: float, about_zero: tuple[float, float] | None, allowed: Callable[[float], bool]
) -> tuple[float, float, bool] | None:
    """Sensible ends about a value, and whether the scale is logarithmic; None where nothing else is allowed.

    From value/factor to value·factor; for zero the ends that are known. An end that is not allowed is drawn towards
    the value.
    """
    if value == 0:
        if about_zero is None:
            return None
        low, high = about_zero
    else:
        low, high = sorted((_rounded(value / factor), _rounded(value * factor)))
    low, high = _drawn(low, value, allowed), _drawn(high, value, allowed)
    if not low <= value <= high or low == high:
        return None
    return low, high, low > 0 and factor > _NARROW


def _drawn(end: float, value: float, allowed: Callable[[float], bool]) -> float:
    for _ in range(_HALVINGS):
        if allowed(end):
            return end
        end = (end + value) / 2
    return value


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


def chosen(controls: Mapping[str, Control], values: Mapping[str, object]) -> dict[str, float]:
    """The values that differ from those of the file, checked; what is not given stays as it is."""
    out = {}
    for key in sorted(values):
        if key not in controls:
            raise InputError(f"explore: no control {key!r}, {nearest(key, controls)}")
        number = controls[key].checked(values[key])
        if number != controls[key].value:
            out[key] = number
    return out
