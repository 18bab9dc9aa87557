"""Universal files: their data sets, units and the labels of their nodes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, foreign

_END = 256
AXES = ("", "X", "Y", "Z", "RX", "RY", "RZ")
"""Directions 0 to 6 of a data set."""
_PLACE = re.compile(r"(\d+)\s*([+-]?)\s*(R?[XYZ]?)$", re.IGNORECASE)


def read_sets(path: Path) -> list[dict[str, Any]]:
    """Every data set that is understood."""
    import pyuff

    end = bytes_of(path, "a universal file")[-_END:]
    if end.split()[-1:] != [b"-1"]:
        raise InputError(f"{path}: does not end with the line '-1', expected a whole universal file")
    sets = foreign(path, "a universal file", lambda: pyuff.UFF(str(path)).read_sets())
    sets = sets if isinstance(sets, list) else [sets]
    for s in sets:
        if s.get("type") == 58:
            _check(path, s)
    return sets


def _check(path: Path, s: dict[str, Any]) -> None:
    """Refuse samples that are missing or of a form that is read wrongly; take off those that only fill up a line."""
    where, count = f"{path}: set 58 ({str(s.get('id1', '')).strip()})", int(s.get("num_pts") or 0)
    if s.get("binary") and int(s.get("fp_format") or 2) != 2:
        raise InputError(f"{where} has floating point format {s['fp_format']}, expected 2: IEEE")
    if len(s["data"]) < count:
        raise InputError(f"{where} holds {len(s['data'])} of {count} samples, expected all")
    s["data"], s["x"] = s["data"][:count], s["x"][:count]


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
