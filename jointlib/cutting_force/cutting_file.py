"""Cutting files: ``schema = "jointlib/cutting/1"``, coefficients of cutting forces that machine files can name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointlib.cutting_force.coefficients import Coefficients
from jointlib.cutting_force.cut import PROCESSES
from jointlib.cutting_force.tooth_force import COEFFICIENTS
from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section
from jointlib.io.toml_file import read_toml, write_toml
from jointlib.joint import Covariance


def read_cutting_file(path: Path) -> Coefficients:
    """The coefficients in a file."""
    section = read_toml(Path(path), "cutting")
    table = section.section("cutting")
    process = table.text("process", choices=PROCESSES)
    values = {name: table.number(name, unit) for name, unit in COEFFICIENTS.items() if table.has(name)}
    table.done()
    for name in ("tangential", "normal") if process == "milling" else ("normal",):
        if name not in values:
            raise InputError(f"{table.where}: {name} is missing, expected it of a {process} cut")
    covariance = _covariance(section.section("covariance"), values)
    provenance = section.section("provenance").raw()
    section.done()
    try:
        return Coefficients(process, values, covariance, dict(provenance))
    except InputError as error:
        raise InputError(f"{table.where}: {error}") from None


def _covariance(section: Section, values: dict[str, float]) -> Covariance | None:
    if not section.keys():
        return None
    names = section.words("names")
    matrix = np.array(section.matrix("matrix", "1"))
    section.done()
    for name in names:
        if name not in values:
            raise InputError(f"{section.where}: names has {name!r}, {nearest(name, values)}")
    if matrix.shape != (len(names), len(names)) or np.any(np.diag(matrix) < 0):
        raise InputError(f"{section.where}: matrix has shape {matrix.shape}, expected {len(names)} rows with variances")
    return Covariance(names, matrix)


def write_cutting_file(path: Path, found: Coefficients) -> None:
    """Write coefficients; read back they are the same, bit for bit."""
    table: dict[str, object] = {"cutting": {"process": found.process, **found.values}}
    if found.covariance is not None:
        matrix = [[float(x) for x in row] for row in found.covariance.matrix]
        table["covariance"] = {"names": list(found.covariance.names), "matrix": matrix}
    write_toml(path, "cutting", {**table, "provenance": dict(found.provenance)})
