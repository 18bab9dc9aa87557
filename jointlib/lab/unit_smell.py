"""Factors by which units differ: what a size that is wrong by one of them smells of."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

_NEAR = 0.1
"""Share by which a factor may miss that of a unit."""
UNITS: Mapping[float, str] = MappingProxyType(
    {
        1e3: "mm for m, um for mm, kN for N",
        1e6: "um for m, MN for N",
        25.4: "inches for mm",
        9.80665: "kgf for N, g for m/s^2",
    }
)
"""Factors by which units differ, and examples."""
RATES: Mapping[float, str] = MappingProxyType({60.0: "mm/min for mm/s", 6e4: "mm/min for m/s", 100.0: "cm for m"})
"""The same, of signals that have a time in their unit."""


def smell_of(size: float, known: Mapping[float, str] = UNITS) -> tuple[str, str] | None:
    """How far a size is off (``1000 times smaller``) and examples of units that are; None where no unit is near."""
    for unit, words in known.items():
        for times, far in ((unit, f"{unit:g} times as large"), (1 / unit, f"{unit:g} times smaller")):
            if abs(size / times - 1) < _NEAR:
                return far, words
    return None
