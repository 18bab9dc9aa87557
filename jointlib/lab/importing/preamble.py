"""What the lines above a table say: the sample rate or the time step, and units of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence

from jointlib.lab.numerals import LOOSE, Numerals
from jointlib.lab.sampling import rounded_rate
from jointlib.lab.unit_words import is_unit, without_unit

_RATE = re.compile(
    r"\b(sampl\w*[ _-]?(rate|freq\w*)|abtast(rate|frequenz)|messrate|scan[ _-]?rate|data[ _-]?rate)\b|^\W*(fs|rate)\b",
    re.IGNORECASE,
)
_STEP = re.compile(
    r"\b(delta[ _-]?[xt]|[xt][ _-]?(incr\w*|step)|sampl\w*[ _-]?(interval|time|period)|time[ _-]?step|"
    r"abtastintervall|zeitschritt)\b|^\W*(d[xt]|incr\w*)\b",
    re.IGNORECASE,
)
_HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "1/s": 1.0, "s/s": 1.0, "sps": 1.0, "": 1.0}
_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "": 1.0}
_UNITS = re.compile(r"^\W*(units?|einheit(en)?|unités?|y[_ ]unit\w*)\b", re.IGNORECASE)
_PARTS = re.compile(r"[;\t|]| *[:=,] +|[:=]|,(?=\D)")
_GROUPS = re.compile(r"(?<![\w.,])\d{1,3}(?:[ '\u2019\u00a0\u202f]\d{3})+(?!\w)")
"""Digits with a blank or a stroke between thousands."""


def rates_above(lines: Sequence[str], numerals: Numerals) -> list[tuple[float, str]]:
    """Sample rates in Hz that lines tell, with each line."""
    found = []
    for line in lines:
        for pattern, scales, step in ((_STEP, _SECONDS, True), (_RATE, _HERTZ, False)):
            match = pattern.search(line)
            value = None if match is None else _number(line[match.end() :], numerals, scales)
            if value:
                found.append((rounded_rate(1 / value if step else value), line.strip()))
                break
    return found


def _number(rest: str, numerals: Numerals, scales: dict[str, float]) -> float | None:
    """The first number of a text in the unit before or behind it; None where it has none, or another unit."""
    rest = _GROUPS.sub(lambda found: re.sub(r"\D", "", found[0]), rest)
    for match in re.finditer(r"[^\s;:=|\[\]()]+", rest):
        word = match[0].rstrip(",")
        if not (LOOSE.fullmatch(word) and word[0] in "0123456789"):
            continue
        ways = (numerals, Numerals(numerals.decimal, "." if numerals.decimal == "," else ","), Numerals("."))
        way = next((way for way in ways if way.pattern.fullmatch(word)), None)
        if way is None:
            return None
        words = [
            w.casefold() for w in re.findall(r"[^\s;:=|\[\](),]+", rest[: match.start()] + " " + rest[match.end() :])
        ]
        unit = next((w for w in words if w in scales), "")
        return way.value(word) * scales[unit]
    return None


def units_above(lines: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    """Units of columns that lines tell: a row of them, or a line that names a column and its unit."""
    found: dict[str, str] = {}
    for line in lines:
        cells = [cell.strip().strip("[]() ") for cell in _PARTS.split(line)]
        if _UNITS.match(line) and len(cells) in (len(names), len(names) + 1):
            for name, unit in zip(names, cells[-len(names) :], strict=True):
                if is_unit(unit) and len(cells) == len(names) + 1:
                    found[name] = unit
        for name in names:
            word = re.escape(without_unit(name))
            inside = re.search(rf"(?<!\w){word}\s*(?:\bin\b|[:=(\[])\s*([^\s;,:=()\[\]]+)", line)
            if inside is not None and is_unit(inside[1]):
                found[name] = inside[1]
        last = cells[-1]
        for name in names if len(cells) > 1 and is_unit(last) else ():
            said = re.search(rf"(?<!\w){re.escape(without_unit(name))}(?!\w)", line[: line.rfind(last)])
            if said is not None:
                found[name] = last
    return found
