"""Quantities, designs and limits of a study as people read them: mm, rpm, cm³/min, µm/N."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .study import QUANTITIES, Constraint, Objective

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
    return f"{scaled:.0f}" if quantity == "pocket-speed" else f"{scaled:.4g}"


def with_unit(quantity: str, value: float) -> str:
    """``212 cm³/min``."""
    return number(quantity, value) + (f" {shown_unit(quantity)[0]}" if np.isfinite(value) else "")


def does(quantity: str, results: Mapping[str, float]) -> str:
    """What a design does: ``it removes 212 cm³/min at 7850 rpm``."""
    speed = results.get("pocket-speed", np.nan)
    at = f" at {with_unit('pocket-speed', speed)}" if np.isfinite(speed) else ""
    return _SAYS[quantity].format(with_unit(quantity, results[quantity]), at)


def limit(constraint: Constraint) -> str:
    """``minimum depth of at least 0.5 mm``."""
    ends = [("at least", constraint.at_least), ("at most", constraint.at_most)]
    told = [f"{word} {with_unit(constraint.quantity, end)}" for word, end in ends if np.isfinite(end)]
    return f"{named(constraint.quantity)} of {' and '.join(told)}"


def wanted(objectives: Sequence[Objective]) -> str:
    """``removal rate large and weight small``."""
    return " and ".join(f"{named(o.quantity)} {'large' if o.goal == 'max' else 'small'}" for o in objectives)


def apart(first: float, second: float) -> str:
    """How far the first is from the second, as a share of the second: ``18 % more``."""
    if not (np.isfinite(first) and np.isfinite(second)) or second == 0 or first == second:
        return "as much" if first == second else "better"
    share = 100 * (first / second - 1)
    digits = f"{abs(share):.0f}" if abs(share) >= 9.5 else f"{abs(share):.2g}"
    return f"{digits} % {'more' if share > 0 else 'less'}"


def chosen(factors: Mapping[str, str]) -> str:
    """``preload 700 N, cutter short``."""
    return ", ".join(f"{name} {value}" for name, value in factors.items())
