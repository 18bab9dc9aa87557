"""Matrices that CalculiX stores with ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: .sti, .mas, and .dof for their rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from jointlib.foreign.door import bytes_of
from jointlib.io.finite_elements.dmig import Label

_NUMBERS = {"1": 1, "2": 2, "3": 3}
_LINE = [("row", np.int64), ("column", np.int64), ("value", float)]


def read_calculix(path: Path) -> tuple[scipy.sparse.csc_matrix, tuple[Label, ...] | None]:
    """One symmetric matrix, and the node and direction of its rows where the file ``.dof`` lies beside it.

    A line is ``row column value``, rows and columns counted from 1, of one triangle (matrixstorage.c of CalculiX 2.x);
    a line of ``.dof`` is ``node.direction``. All rows are there, the diagonal even where it is zero.

    Raises
    ------
    ValueError
        What is wrong with the file, without its name.
    """
    text = bytes_of(path, "a matrix").decode("latin-1")
    if not text.strip():
        raise ValueError("holds no entries")
    try:
        i, j, v = np.loadtxt(text.splitlines(), dtype=_LINE, comments=None, ndmin=1, unpack=True)
    except ValueError as error:
        raise ValueError(f"expected row, column and value on every line: {error}") from None
    if min(i.min(), j.min()) < 1:
        raise ValueError("names row or column 0, expected numbers from 1 on")
    i, j = i - 1, j - 1
    size = int(max(i.max(), j.max())) + 1
    if np.any(i > j) and np.any(i < j):
        raise ValueError("holds entries on both sides of the diagonal, expected one triangle")
    across = i != j
    entries = (np.append(v, v[across]), (np.append(i, j[across]), np.append(j, i[across])))
    return scipy.sparse.csc_matrix(scipy.sparse.coo_matrix(entries, shape=(size, size))), _labels(
        path.with_suffix(".dof"), size
    )


def _labels(path: Path, size: int) -> tuple[Label, ...] | None:
    if not path.is_file():
        return None
    lines = [line.strip() for line in bytes_of(path, "a matrix").decode("latin-1").splitlines() if line.strip()]
    found = []
    for number, line in enumerate(lines, 1):
        node, _, direction = line.partition(".")
        if not node.isascii() or not node.isdigit() or direction not in _NUMBERS:
            raise ValueError(f"{path.name}: line {number} is {line[:40]!r}, expected node.direction, as 12.3")
        found.append((int(node), _NUMBERS[direction]))
    if len(found) != size:
        raise ValueError(f"{path.name}: names {len(found)} rows and the matrix has {size}")
    return tuple(found)
