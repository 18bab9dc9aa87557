"""Values with units, at the doors only: a bare number is SI, a string carries its unit."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

from jointlib.errors import InputError

# Frequencies and speeds are read by rule: a units package would turn rpm and Hz into rad/s.
_BY_RULE = {
    "Hz": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, "1/s": 1.0},
    "rpm": {"rpm": 1.0, "krpm": 1e3, "Hz": 60.0},
}
_COMMON = {
    "m": {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "cm": 1e-2},
    "m^2": {"mm^2": 1e-6, "cm^2": 1e-4},
    "m^4": {"mm^4": 1e-12, "cm^4": 1e-8},
    "N": {"kN": 1e3},
    "N/m": {"N/um": 1e6, "N/µm": 1e6, "N/mm": 1e3, "kN/mm": 1e6, "kN/m": 1e3, "MN/m": 1e6},
    "N s/m": {"kN s/m": 1e3, "N s/mm": 1e3},
    "N/m^2": {"N/mm^2": 1e6, "MPa": 1e6, "GPa": 1e9, "Pa": 1.0},
    "kg": {"g": 1e-3, "t": 1e3},
    "rad": {"deg": math.radians(1.0)},
    "s": {"ms": 1e-3, "us": 1e-6, "µs": 1e-6},
}
"""What most files hold, [dimension][unit], as the units package has it, which takes longer to load than a file."""
HUGE = 1e75
"""Beyond this, products of a few quantities are no floats any more."""
_UNIT = re.compile(r"[^\d.eE+\-\s]")
_GRAM = re.compile(r"(?<![A-Za-z_])(m?)g(?![A-Za-z_0-9])")
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$", re.ASCII | re.DOTALL)
_COMMA = re.compile(r",(\d+)", re.ASCII)
_WHOLE = re.compile(r"[0-9]{1,18}")
MOST_LINES = 1_000_000
"""Lines of frequency; what fewer of them need is told where they are used."""
_LETTERS = re.compile(r"[\w *\u00a0/^().·⋅%‰°+-]*")
"""Of what a unit is written; the reader of units would pass over other signs, as over what follows ``#``."""
_LONGEST_UNIT = 60
"""Letters; a longer one is none, and the reader of units would go into it as deep as it is long."""


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def scale(unit: str, expected: str, where: str) -> float:
    """SI value of one ``unit``, which must have the dimension of the SI unit ``expected``."""
    if _COMMA.match(unit):
        raise InputError(f"{where}: a decimal comma before {unit[1:]!r}, expected a point: write it as 3.5 mm")
    if expected in _BY_RULE:
        if unit in _BY_RULE[expected]:
            return _BY_RULE[expected][unit]
        raise InputError(f"{where}: unit {unit!r}, expected {' or '.join(_BY_RULE[expected])}")
    if unit == expected:
        return 1.0
    if unit in (common := _COMMON.get(expected, {})):
        return common[unit]
    try:
        return _factor(unit, expected)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


@lru_cache(maxsize=1024)  # a study reads the same file thousands of times
def _factor(unit: str, expected: str) -> float:
    registry = _registry()
    target = registry.parse_units("" if expected == "1" else _power(expected))
    try:
        if len(unit) > _LONGEST_UNIT or not _LETTERS.fullmatch(unit):
            raise ValueError
        found = registry.parse_units(_power(unit))
    except Exception:  # pint evaluates an expression, and raises what the language does
        raise InputError(f"unit {unit!r} is not known, expected one like {expected!r}") from None
    if found.dimensionality != target.dimensionality:
        gravity = _GRAM.sub(r"\1g_0", _power(unit))  # where no mass fits, g is that of free fall
        found = registry.parse_units(gravity) if gravity != _power(unit) else found
    if found.dimensionality != target.dimensionality:
        raise InputError(f"unit {unit!r} does not fit, expected one like {expected!r}")
    if found == target:
        return 1.0
    if not registry.Quantity(1.0, found)._is_multiplicative:
        raise InputError(f"unit {unit!r} has its zero elsewhere, expected one like {expected!r}")
    try:
        factor = float(registry.Quantity(1.0, found).to(target).magnitude)
    except (ArithmeticError, ValueError):
        factor = 0.0
    if not 0 < factor < math.inf:
        raise InputError(f"unit {unit!r} is too large or too small, expected one like {expected!r}")
    return _clean(factor)


def number_and_unit(text: str) -> tuple[float, str] | None:
    """The two parts of ``"25 N/um"``, the unit empty where there is none; None where no number comes first."""
    match = _NUMBER.match(text)
    return None if match is None else (float(match[1]), match[2])


def quantity(value: Any, expected: str, where: str) -> float:
    """A number (SI, or Hz or rpm where those are expected) or a string with a unit, as a finite float."""
    if isinstance(value, str):
        parts = number_and_unit(value)
        if parts is None:
            raise InputError(f"{where}: {value!r}, expected a number with a unit like {expected!r}")
        number, unit = parts
        if (after := _COMMA.match(unit)) is not None:
            head, tail = (part.strip() for part in value.split(",", 1))
            whole = f", or {head}{tail} where it groups thousands" if len(after[1]) == 3 and "." not in head else ""
            raise InputError(f"{where}: {value!r}, a decimal comma: write {head.replace('.', '')}.{tail}{whole}")
        factor = scale(unit, expected, where) if unit else 1.0
        # Dividing by a whole reciprocal keeps "25 um" the float that 25e-6 is.
        out = number / round(1 / factor) if 0 < factor < 1 and (1 / factor).is_integer() else number * factor
    elif isinstance(value, int | float) and not isinstance(value, bool):
        out = float(value) if isinstance(value, float) or abs(value) < 10**300 else math.inf
    else:
        raise InputError(f"{where}: {value!r}, expected a number or a string with a unit like {expected!r}")
    if not math.isfinite(out):
        shown = repr(value) if len(repr(value)) < 30 else "a number of many digits"
        raise InputError(f"{where}: {shown}, expected a finite value in {expected}")
    if abs(out) > HUGE or 0 < abs(out) < 1 / HUGE:
        raise InputError(f"{where}: {value!r}, expected 0 or a size between {1 / HUGE:g} and {HUGE:g} {expected}")
    return out


def within(value: float, lower: float | None, upper: float | None, unit: str, where: str, given: object) -> float:
    """The value, refused below ``lower`` and above ``upper`` where there are such, in the words of ``given``."""
    if lower is not None and value < lower:
        raise InputError(f"{where}: {given}, expected at least {lower:g} {unit}")
    if upper is not None and value > upper:
        bare = "" if _UNIT.search(str(given)) else f"; a number without a unit is in {unit}"
        raise InputError(f"{where}: {given}, expected at most {upper:g} {unit}{bare}")
    return value


def frequency_range(parts: Sequence[str], where: str, given: str) -> tuple[float, float, int | None]:
    """Lowest and highest frequency in Hz, and the number of lines or None, of two or three words."""
    if len(parts) not in (2, 3) or (len(parts) == 3 and not _WHOLE.fullmatch(parts[2])):
        raise InputError(f"{where}: {given!r}, expected lo:hi or lo:hi:n")
    low, high = (quantity(p, "Hz", where) for p in parts[:2])
    if not 0 < low < high:
        raise InputError(f"{where}: runs from {low:g} to {high:g} Hz, expected 0 < low < high")
    count = int(parts[2]) if len(parts) == 3 else None
    if count is not None and not 2 <= count <= MOST_LINES:
        raise InputError(f"{where}: {count} lines, expected 2 to {MOST_LINES}")
    return low, high, count


_MOST_PLACES = 9
"""Digits after the point to which a value is told at most."""
_SHOWN = {
    "rad": (180 / math.pi, "°"),
    "m": (1e6, "µm"),
    "s": (1e6, "µs"),
    "N/m": (1e-6, "N/µm"),
    "N/m^2": (1e-12, "N/µm²"),
}


def shown(unit: str) -> tuple[float, str]:
    """Factor and unit in which people read a joint parameter that is kept in SI."""
    return _SHOWN.get(unit, (1.0, unit))


def read_as(value: float, unit: str) -> tuple[float, str]:
    """The same for a value: times and lengths from a thousandth on in ms and mm, soft springs in N/m."""
    size = abs(value)
    if unit in ("s", "m") and size >= 1e-3:
        return 1e3, f"m{unit}"
    if unit == "N/m" and 0 < size < 1e4:
        return 1.0, unit
    return shown(unit)


def with_error(value: float, error: float, unit: str) -> str:
    """A parameter as people read it, its digits cut to those that its error leaves: ``39.148 ± 0.021 N/µm``."""
    factor, word = read_as(value, "" if unit == "1" else unit)
    v, e = rounded(value * factor, error * factor)
    return " ".join(part for part in (v, e, word) if part)


def rounded(value: float, error: float | None, digits: int = 4) -> tuple[str, str]:
    """A value to the two digits that its error has, and ``± error``; to some digits and nothing where that is unknown
    or 0."""
    if error is None or not (math.isfinite(error) and error):
        return f"{value:.{digits}g}", ""
    error = float(f"{abs(error):.1e}")
    last, size = math.floor(math.log10(error)) - 1, max(abs(value), error)
    power = 0 if 1e-4 <= size < 1e6 else math.floor(math.log10(size))
    places = power - last
    if places > _MOST_PLACES:
        return f"{value:.6g}", f"± {error:.2g}"
    ten = f"e{power}" if power else ""
    v, e = (round(x / 10.0**power, places) for x in (value, error))
    return f"{v:.{max(places, 0)}f}{ten}", f"± {e:.{max(places, 0)}f}{ten}"


def parameters_in_words(found: Mapping[str, tuple[float, float, str]], most: int = 6) -> str:
    """Value, standard error (nan or 0 where there is none) and unit by name, as a list in a sentence."""
    words = [
        f"{name.rpartition('.')[2].replace('_', ' ')} {with_error(value, error, unit)}"
        for name, (value, error, unit) in list(found.items())[:most]
    ]
    return ", ".join(words) + (f" and {len(found) - most} more" if len(found) > most else "")


def _power(unit: str) -> str:
    """'m/s2' is read as m/s², and blanks multiply, as engineers write."""
    return re.sub(r"(?<=[A-Za-z])([23])\b", r"^\1", unit.replace("²", "^2").replace("³", "^3").replace("µ", "u"))


def _clean(factor: float) -> float:
    """Remove the rounding noise of a decimal conversion: 9.999999999999999e-07 is 1e-6."""
    decimal = float(f"{factor:.12g}")
    return decimal if abs(decimal - factor) <= 4e-16 * abs(factor) else factor
