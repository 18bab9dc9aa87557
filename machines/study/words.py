"""Quantities, designs and limits of a study as people read them: mm, rpm, cm³/min, µm/N."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .study import QUANTITIES, ROUNDING, Constraint, Objective, Study

_SHOWN: Mapping[str, tuple[str, float]] = {
    "m": ("mm", 1e3),
    "rpm": ("rpm", 1.0),
    "m^3/s": ("cm³/min", 60e6),
    "m/N": ("µm/N", 1e6),
    "kg": ("kg", 1.0),
}
_SAYS = {
    "minimum-depth": "at every speed it cuts {0} deep without chatter",
    "pocket-depth": "it cuts {0} deep{1}",
    "pocket-speed": "its best pocket is at {0}",
    "removal-rate": "it removes {0}{1}",
    "static-compliance": "its tool point yields {0}",
    "peak-receptance": "its tool point vibrates {0} at most",
    "weight": "it weighs {0}",
}


def shown_unit(quantity: str) -> tuple[str, float]:
    """The unit that people read a quantity in, and how many of it one of the SI unit is (rpm for speeds)."""
    return _SHOWN[QUANTITIES[quantity][0]]


def named(quantity: str) -> str:
    """``removal rate``."""
    return quantity.replace("-", " ")


def headed(quantity: str) -> str:
    """``removal rate [cm³/min]``."""
    return f"{named(quantity)} [{shown_unit(quantity)[0]}]"


def number(quantity: str, value: float) -> str:
    """A value without its unit, as in a column under `headed`."""
    if np.isnan(value):
        return "none"
    if np.isinf(value):
        return "no limit"
    scaled = value * shown_unit(quantity)[1]
    return f"{scaled:.0f}" if quantity == "pocket-speed" else plain(scaled, 4)


def plain(value: float, digits: int) -> str:
    """A number with so many digits that count, more where it is larger, and no power of ten where people need none."""
    if value == 0 or not 1e-6 <= abs(value) < 1e9:
        return f"{value:.{digits}g}"
    places = max(0, digits - 1 - int(np.floor(np.log10(abs(float(f"{value:.{digits}g}"))))))
    told = f"{value:.{places}f}"
    return told.rstrip("0").rstrip(".") if "." in told else told


def change(quantity: str, value: float) -> str:
    """A difference without its unit and with its sign."""
    told = plain(value * shown_unit(quantity)[1], 3)
    return f"+{told}" if value > 0 else told


def with_unit(quantity: str, value: float) -> str:
    """``212 cm³/min``."""
    return number(quantity, value) + (f" {shown_unit(quantity)[0]}" if np.isfinite(value) else "")


def does(quantity: str, results: Mapping[str, float]) -> str:
    """What a design does: ``it removes 212 cm³/min at 7850 rpm``."""
    if quantity == "minimum-depth" and np.isposinf(results[quantity]):
        return "at every speed it cuts without chatter, however deep"
    speed = results.get("pocket-speed", np.nan)
    at = f" at {with_unit('pocket-speed', speed)}" if np.isfinite(speed) else ""
    return _SAYS[quantity].format(with_unit(quantity, results[quantity]), at)


def missing(quantity: str) -> str:
    """Why a design is ruled out whose result does not exist."""
    pocket = quantity in ("pocket-depth", "pocket-speed", "removal-rate")
    return "no pocket between the lobes" if pocket else f"no {named(quantity)}"


def limit(constraint: Constraint) -> str:
    """``minimum depth of at least 0.5 mm``."""
    ends = [("at least", constraint.at_least), ("at most", constraint.at_most)]
    told = [f"{word} {with_unit(constraint.quantity, end)}" for word, end in ends if np.isfinite(end)]
    return f"{named(constraint.quantity)} of {' and '.join(told)}"


def wanted(objectives: Sequence[Objective]) -> str:
    """``removal rate large and weight small``."""
    return " and ".join(f"{named(o.quantity)} {'large' if o.goal == 'max' else 'small'}" for o in objectives)


def alike(first: float, second: float) -> bool:
    """Whether two results differ by no more than rounding."""
    return first == second or abs(first - second) <= ROUNDING * max(abs(first), abs(second))


def apart(first: float, second: float) -> str:
    """How far the first is from the second, as a share of the second: ``18 % more``."""
    if alike(first, second):
        return "as much"
    if not (np.isfinite(first) and np.isfinite(second)) or second == 0:
        return "better"
    share = 100 * (first / second - 1)
    digits = f"{abs(share):.0f}" if abs(share) >= 9.5 else f"{abs(share):.2g}"
    return f"{digits} % {'more' if share > 0 else 'less'}"


def chosen(factors: Mapping[str, str]) -> str:
    """``preload 700 N, cutter short``."""
    return ", ".join(f"{name} {value}" for name, value in factors.items())


def conditions(study: Study) -> list[str]:
    """What is said of the materials and tools that every design is judged with, beside its positions."""
    said = []
    if len({case.material for case in study.cases}) > 1:
        said.append("Where several materials are cut, the worst counts.")
    tools = list(dict.fromkeys(case.tool for case in study.cases))
    if len(tools) > 1:
        said.append(f"Every design is judged with the tools {', '.join(tools)}; the worst counts.")
    elif tools[0]:
        said.append(f"The tool is {tools[0]}.")
    return said
