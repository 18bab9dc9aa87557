"""SI units as FMI wants them: a name, and whole exponents of the base units where there are any."""

from __future__ import annotations

import math
import re
from collections import Counter
from fractions import Fraction

_BASE: dict[str, dict[str, int]] = {
    "1": {},
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "A": {"A": 1},
    "K": {"K": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Hz": {"s": -1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
}
_TOKEN = re.compile(r"\s*(?:([A-Za-z]+|1)|(\^\(?-?\d+(?:/\d+)?\)?)|(.))")


def exponents(unit: str) -> dict[str, int] | None:
    """Exponents of kg, m, s, A, K, rad; None for a unit unknown here or with a broken power (m/N^(2/3))."""
    tokens = [match.groups() for match in _TOKEN.finditer(unit.strip())]
    try:
        found, rest = _product(tokens)
    except (KeyError, IndexError, ValueError):
        return None
    if rest or any(power.denominator != 1 for power in found.values()):
        return None
    return {base: int(power) for base, power in found.items() if power}


_Tokens = list[tuple[str | None, ...]]


def _product(tokens: _Tokens) -> tuple[Counter[str], _Tokens]:
    """Factors side by side or after a stroke; a stroke divides by the one factor that follows it."""
    total: Counter[str] = Counter()
    sign = 1
    while tokens and tokens[0][2] != ")":
        if tokens[0][2] == "/":
            sign, tokens = -1, tokens[1:]
        if tokens[0][2] == "(":
            factor, tokens = _product(tokens[1:])
            tokens = tokens[1:]
        else:
            factor, tokens = Counter(_BASE[tokens[0][0] or ""]), tokens[1:]
        power = Fraction(sign)
        if tokens and tokens[0][1]:
            power, tokens = power * Fraction(tokens[0][1].strip("^()")), tokens[1:]
        for base, exponent in factor.items():
            total[base] += exponent * power  # type: ignore[assignment]
        sign = 1
    return total, tokens


def base_unit(unit: str) -> dict[str, str] | None:
    """Attributes of FMI's and SSP's BaseUnit; None for a unit that has none."""
    if unit == "rpm":
        return {"rad": "1", "s": "-1", "factor": repr(math.pi / 30)}
    powers = exponents(unit)
    return None if powers is None else {base: str(power) for base, power in powers.items()}


def table_unit(unit: str, i: int, j: int) -> str:
    """Unit of the entry [i][j] of a table whose unit is written with the indices, ``N/(m^i (m/s)^j)``.

    Written without needless powers: N, N/m, N s/m, N s/m^2 …; a unit without indices stays as it is.
    """
    if "^i" not in unit and "^j" not in unit:
        return unit
    powers = exponents(unit.replace("^i", f"^{i}").replace("^j", f"^{j}"))
    if powers is None:
        return unit.replace("^i", f"^{i}").replace("^j", f"^{j}")
    # Every force surface is in N, so one N is kept in front of what it is divided by.
    left = {base: powers.get(base, 0) - _BASE["N"].get(base, 0) for base in sorted({*powers, *_BASE["N"]})}
    above = [_written(base, power) for base, power in left.items() if power > 0]
    below = [_written(base, -power) for base, power in left.items() if power < 0]
    text = " ".join(["N", *above])
    if below:
        text += "/" + (below[0] if len(below) == 1 else f"({' '.join(below)})")
    return text


def turned(unit: str) -> str:
    """Unit of the same quantity of a joint that turns: metres are of the motion, so they are rad, and N are N m.

    N m/rad for N/m, N m s/rad for N s/m, rad/(N m)^(2/3) for m/N^(2/3).
    """
    moment = re.sub(r"\bN\^", "(N m)^", re.sub(r"\bm\b", "rad", unit))
    return re.sub(r"(?<!\()\bN\b", "N m", moment)


def _written(base: str, power: int) -> str:
    return base if power == 1 else f"{base}^{power}"
