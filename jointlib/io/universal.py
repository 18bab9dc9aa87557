"""Universal files: their data sets, units and the labels of their nodes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from jointlib.errors import InputError

AXES = ("", "X", "Y", "Z", "RX", "RY", "RZ")
"""Directions 0 to 6 of a data set."""
_PLACE = re.compile(r"(\d+)\s*([+-]?)\s*(R?[XYZ]?)$", re.IGNORECASE)


def read_sets(path: Path) -> list[dict[str, Any]]:
    """Every data set that is understood."""
    import pyuff

    try:
        sets = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # pyuff raises bare exceptions of many kinds on broken files
        raise InputError(f"{path}: cannot be read as a universal file ({error})") from None
    return sets if isinstance(sets, list) else [sets]


def place(label: str) -> tuple[str, int]:
    """A node with its direction and the sign of that, from ``12+X``, ``12X`` or ``12-RZ``."""
    match = _PLACE.match(label.strip())
    if match is None:
        raise ValueError(f"{label!r}, expected a node and direction like '12+X'")
    return f"{int(match[1])}{match[3].upper()}", -1 if match[2] == "-" else 1


def units(path: Path, found: dict[str, Any]) -> tuple[float, str]:
    """Receptance in SI over that in the file, from set 164, and a sentence that says its units.

    The set divides a value in file units by its factor to give SI: lengths by length, forces by force.
    """
    length, force = float(found["length"]), float(found["force"])
    if not (length > 0 and force > 0):
        raise InputError(f"{path}: set 164 has length {length:g} and force {force:g}, expected factors above 0")
    described = str(found.get("units_description", "")).strip() or f"code {found.get('units_code')}"
    return force / length, f"units of the file: {described}."


NO_UNITS = "the file states no units, taken as SI."
