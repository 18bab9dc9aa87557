"""Universal files: time histories and frequency responses of data sets 58, in text or binary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jointlib.io.universal import AXES, read_sets
from jointlib.lab.lab_file import Column, LabFile
from jointlib.lab.sampling import rate_of_times

_QUANTITIES = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force", 5: "temperature"}
_TIME, _FRF = (0, 1), 4


def read_universal(path: Path) -> LabFile:
    """Time histories by their first identification line, and the place where a line stands twice."""
    sets = read_sets(path)
    units = next((s for s in sets if s.get("type") == 164), None)
    times = [s for s in sets if s.get("type") == 58 and s.get("func_type") in _TIME and np.isrealobj(s["data"])]
    frfs = [s for s in sets if s.get("type") == 58 and s.get("func_type") == _FRF]
    titles = [str(s.get("id1") or "").strip() for s in times]
    columns: list[Column] = []
    for s, title in zip(times, titles, strict=True):
        again = titles.count(title) > 1 or title in ("", "NONE", "None")
        name = f"{title} {_place(s, 'rsp')}".replace("NONE ", "").strip() if again else title
        names = [c.name for c in columns]
        name = name if name not in names else f"{name} ({1 + sum(n.startswith(name) for n in names)})"
        columns.append(_column(path, s, name, units))
    pairs = tuple((_place(s, "rsp"), _place(s, "ref")) for s in frfs)
    return LabFile(path, tuple(columns), responses=pairs)


def _place(s: dict[str, Any], side: str) -> str:
    direction = int(s.get(f"{side}_dir") or 0)
    axis = AXES[abs(direction)] if abs(direction) < len(AXES) else str(abs(direction))
    return f"{int(s.get(f'{side}_node') or 0)}{'-' if direction < 0 else '+'}{axis}"


def _column(path: Path, s: dict[str, Any], name: str, units: dict[str, Any] | None) -> Column:
    rate = None
    if len(s["x"]) > 1:
        rate = rate_of_times(np.asarray(s["x"], dtype=float), f"{path}: the time of {name!r}")
    quantity = _QUANTITIES.get(int(s.get("ordinate_spec_data_type") or 0))
    unit = str(s.get("ordinate_axis_units_lab") or "").strip()
    unit = "" if unit.upper() == "NONE" else unit
    factor = 1.0
    if not unit and units is not None and quantity in ("displacement", "velocity", "acceleration", "force"):
        # Set 164 divides a value in file units by its factor to give SI.
        factor = 1 / float(units["force" if quantity == "force" else "length"])
        unit = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2", "force": "N"}[quantity]
    return Column(name, np.asarray(s["data"], dtype=float), unit, quantity, rate, factor)
