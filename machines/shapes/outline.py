"""Outlines of components, for the eye: surfaces from STL files in the place of what else would be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.stl import read_stl
from jointlib.io.toml import Section

from ..indices import Index

UNITS = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}
"""m; an STL file has no unit."""
_MOST = 3000
"""Triangles that are drawn of one outline."""
_CELLS = (1_000_000, 128, 96, 64, 48, 32, 24, 16, 8)
"""Corners within one cell become one; cells along the longest side."""


@dataclass(frozen=True)
class Outline:
    """``outline = "column.stl"``, or a table with ``file``, ``unit`` (mm where absent) and ``at``.

    ``at`` is where the origin of the file lies, m, machine axes, as the machine file is drawn.
    """

    file: Path
    unit: str = "mm"
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def surface(self) -> tuple[Array, Index]:
        """Corners (n, 3) in m and triangles (k, 3), as many as a picture needs."""
        triangles = read_stl(self.file) * UNITS[self.unit] + np.array(self.at)
        points = triangles.reshape(-1, 3)
        low, size = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-12)
        for cells in _CELLS:
            _, cell = np.unique(np.round((points - low) / size * cells), axis=0, return_inverse=True)
            cell = cell.ravel()
            faces = cell.reshape(-1, 3)
            kept = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
            _, first = np.unique(np.sort(faces[kept], axis=1), axis=0, return_index=True)
            if len(first) <= _MOST:
                break
        share = np.bincount(cell).astype(float)
        corners = np.stack([np.bincount(cell, points[:, axis]) / share for axis in range(3)], axis=1)
        return corners, faces[kept][np.sort(first)]


def take_outlines(documents: Sequence[Section]) -> dict[str, Outline]:
    """The outlines in the ``[[component]]`` tables of a machine file and its parts, taken out of them."""
    found = {}
    for document in documents:
        tables = document.raw().get("component", [])
        for table in tables if isinstance(tables, list) else []:
            if isinstance(table, dict) and "outline" in table:
                name = str(table.get("name"))
                where = f"{document.where}: [[component]] ({name}): outline"
                found[name] = _outline(table.pop("outline"), where, document.folder)
    return found


def _outline(value: object, where: str, folder: Path) -> Outline:
    section = Section(dict(value) if isinstance(value, dict) else {"file": value}, where, folder)
    file, unit = section.path("file"), section.text("unit", "mm")
    at = section.numbers("at", "m", (0.0, 0.0, 0.0), length=3)
    section.done()
    if unit not in UNITS:
        raise InputError(f"{where}: unit is {unit!r}, {nearest(unit, UNITS)}")
    if not file.is_file():
        raise InputError(f"{where} refers to {file}, which does not exist")
    return Outline(file, unit, (at[0], at[1], at[2]))
