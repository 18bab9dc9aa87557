"""Harwell–Boeing files, as Ansys writes with HBMAT: assembled real matrices, symmetric or not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from jointlib.foreign.door import bytes_of
from jointlib.io.finite_elements.fortran import columns, fixed

LARGEST = 2**31 - 1


def read_harwell_boeing(path: Path) -> scipy.sparse.csc_matrix:
    """The matrix in compressed columns; of a symmetric one the file holds a triangle. Right-hand sides are skipped.

    Format: Duff, Grimes, Lewis, Users' Guide for the Harwell–Boeing Sparse Matrix Collection, 1992.

    Raises
    ------
    ValueError
        What is wrong with the file, without its name.
    """
    lines = bytes_of(path, "a matrix").decode("latin-1").splitlines()
    if len(lines) < 5:
        raise ValueError("ends within the header")
    try:
        right_hand = int(lines[1][56:70].strip() or 0)
        kind = lines[2][:3].upper()
        rows, cols, entries = (int(lines[2][i : i + 14]) for i in (14, 28, 42))
        formats = [lines[3][a:b] for a, b in ((0, 16), (16, 32), (32, 52))]
    except ValueError:
        raise ValueError("the header is not that of a Harwell–Boeing file") from None
    if kind[0] != "R" or kind[2] != "A" or kind[1] not in "SU":
        raise ValueError(f"type {kind!r}, expected RSA or RUA: real, symmetric or unsymmetric, assembled")
    if not (0 < rows <= LARGEST and 0 < cols <= LARGEST and 0 <= entries <= LARGEST):
        raise ValueError(f"announces {rows} rows, {cols} columns and {entries} entries")
    at = 5 if right_hand else 4
    pointers, at = fixed(lines, at, cols + 1, *columns(formats[0]))
    indices, at = fixed(lines, at, entries, *columns(formats[1]))
    values, at = fixed(lines, at, entries, *columns(formats[2]))
    start, row = pointers.astype(int) - 1, indices.astype(int) - 1
    if start[0] != 0 or start[-1] != entries or np.any(np.diff(start) < 0):
        raise ValueError("column pointers do not rise from 1 to the number of entries plus 1")
    if entries and not (row.min() >= 0 and row.max() < rows):
        raise ValueError(f"names row {row.max() + 1} of {rows}")
    matrix = scipy.sparse.csc_matrix((values, row, start), shape=(rows, cols))
    if kind[1] == "S":
        diagonal = scipy.sparse.csc_matrix((matrix.diagonal(), (np.arange(rows), np.arange(rows))), shape=(rows, cols))
        matrix = matrix + matrix.T - diagonal
    return scipy.sparse.csc_matrix(matrix)
