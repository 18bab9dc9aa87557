"""The section on where a machine stands under its static load."""

from __future__ import annotations

from typing import Any

from ..model.machine import Machine
from ..statics.statics import static_point
from .page import Section, Table

_NOTHING = 1e-10
"""Share of the largest force that is rounding."""
_OPEN = 20
"""Rows that one reads at a glance."""


def working_point(machine: Machine) -> tuple[dict[str, Any], Section]:
    """What a run keeps of the static point, and its section: displacement and force of every joint."""
    names, displacement, force = static_point(machine).table
    rounding = _NOTHING * max((abs(f) for f in force), default=0.0)
    force = [f if abs(f) > rounding else 0.0 for f in force]
    rows = [(n, f"{z * 1e6:.4f}", f"{f:.4g}") for n, z, f in zip(names, displacement, force, strict=True)]
    text = [
        "Weight, constant forces and offsets are balanced first; the joints vibrate about where they stand then, and "
        "their means move with the amplitudes. A contact's force counts beyond its preload."
    ]
    step = {"step": "static", "connection": list(names), "displacement": displacement, "force": force}
    header = ("joint", "stands at [µm]", "force [N]")
    fold = f"Where the {len(rows)} joints stand" if len(rows) > _OPEN else ""
    return step, Section("Static working point", text, (), [Table(header, rows, "Under the static load", fold)])
