"""The matrices and rows that a ``matrices`` section of a machine file names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy

from jointlib.errors import InputError
from jointlib.io.finite_elements.dmig import Label
from jointlib.io.finite_elements.matrix_files import MatrixFile, read_matrix
from jointlib.io.mistakes import Lost
from jointlib.io.toml import Section

from .nodes import DIRECTIONS


def matrix_file(section: Section, key: str) -> MatrixFile:
    """The matrix that a key names: a file, or a table of file and name."""
    value = section.take(key)
    table = {"file": value} if isinstance(value, str) else value
    if not isinstance(table, dict):
        raise InputError(f'{section.where}: {key} is {value!r}, expected a file name or {{ file = "…", name = "…" }}')
    inline = section.within(table, key)
    path, name = inline.path("file"), inline.text("name", None)
    inline.done()
    try:
        return read_matrix(Path(path), name)
    except InputError as error:
        raise InputError(f"{section.where}: {key}: {error}") from None


def aligned(
    where: str, files: Mapping[str, MatrixFile]
) -> tuple[dict[str, scipy.sparse.csc_matrix], tuple[Label, ...] | None]:
    """Matrices over the same rows: a grid point that only one of them names is empty in the others."""
    given = {key: found.labels for key, found in files.items()}
    if len(set(given.values())) == 1:
        return {key: found.matrix for key, found in files.items()}, next(iter(given.values()))
    for key, labels in given.items():
        if labels is None:
            raise InputError(f"{where}: {key} names no grid points and the others do, expected all in one format")
    union = sorted({label for labels in given.values() for label in labels or ()})
    place = {label: i for i, label in enumerate(union)}
    out = {}
    for key, found in files.items():
        at = np.array([place[label] for label in found.labels or ()])
        entries = found.matrix.tocoo()
        rows, columns = (at[k] for k in entries.coords)
        out[key] = scipy.sparse.csc_matrix((entries.data, (rows, columns)), shape=(len(union), len(union)))
    return out, tuple(union)


def named_rows(
    section: Section, labels: Sequence[Label] | None
) -> tuple[tuple[str, ...], tuple[int, ...], list[str], list[tuple[float, ...]]]:
    """Dofs and their rows from the nodes, and the nodes whose position is given."""
    dofs: list[str] = []
    rows: list[int] = []
    names: list[str] = []
    places: list[tuple[float, ...]] = []
    for part in section.sections("node"):
        name = part.text("name")
        if part.has("grid"):
            grid = part.integer("grid", lower=1)
            own = {DIRECTIONS[max(c - 1, 0)]: i for i, (g, c) in enumerate(labels or ()) if g == grid and c <= 6}
            if not own:
                found = "the matrices name no grid points" if labels is None else f"no row of grid point {grid}"
                raise InputError(f"{part.where}: {found}, expected {'rows' if labels is None else 'one they hold'}")
        else:
            table = part.section("rows")
            own = {word: table.integer(word, lower=1) - 1 for word in DIRECTIONS if table.has(word)}
            table.done()
            if not own and table.keys():
                raise Lost
            if not own:
                raise InputError(f"{part.where}: neither rows nor grid, expected rows = {{ x = 1, … }} or grid = 1")
        dofs += [f"{name}.{word}" for word in own]
        rows += own.values()
        at = part.numbers("at", "m", None, length=3)
        if at is not None:
            names.append(name)
            places.append(at)
        part.done()
    if not dofs:
        raise InputError(f"{section.where}: no [[component.node]], expected the rows that are of interest")
    return tuple(dofs), tuple(rows), names, places
