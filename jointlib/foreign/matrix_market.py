"""MatrixMarket files: real matrices by coordinates or in full, general, symmetric or skew-symmetric."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy

from jointlib.system.memory import refuse_beyond

_FIELDS = ("real", "double", "integer", "unsigned-integer", "pattern")
_SYMMETRIES = {"general": 0.0, "symmetric": 1.0, "skew-symmetric": -1.0}
"""What an entry across the diagonal is of the one that is given; 0: it is given itself."""
_ENTRY = np.dtype([("row", np.int64), ("column", np.int64), ("value", float)])


def read_matrix_market(path: Path, text: str) -> scipy.sparse.csc_matrix:
    """The matrix in a text.

    Format: Boisvert, Pozo, Remington, The Matrix Market Exchange Formats, NISTIR 5935, 1996.

    Raises
    ------
    ValueError
        What is wrong with the text, without the name of the file.
    """
    rows = text.splitlines()
    words = rows[0].lower().split() if rows else []
    if len(words) != 5 or words[0] not in ("%%matrixmarket", "%matrixmarket") or words[1] != "matrix":
        raise ValueError("the first line is no head of a MatrixMarket file")
    form, field, symmetry = words[2:]
    if form not in ("coordinate", "array") or field not in _FIELDS or symmetry not in _SYMMETRIES:
        raise ValueError(f"is {form} {field} {symmetry}, expected a real matrix, general or symmetric")
    body = [line for line in rows[1:] if line.strip() and not line.lstrip().startswith("%")]
    size = body[0].split() if body else []
    if len(size) != (3 if form == "coordinate" else 2) or not all(word.isascii() and word.isdigit() for word in size):
        raise ValueError("has no line with its numbers of rows, columns and entries")
    shape = int(size[0]), int(size[1])
    if form == "array":
        return _full(shape, body[1:], _SYMMETRIES[symmetry])
    if len(body) - 1 != int(size[2]):
        raise ValueError(f"announces {size[2]} entries and holds {len(body) - 1}")
    refuse_beyond(32.0 * sum(shape), f"{path}: a matrix of {shape[0]} rows and {shape[1]} columns")
    i, j, v = _entries(body[1:], field == "pattern")
    if len(v) and (min(i.min(), j.min()) < 1 or i.max() > shape[0] or j.max() > shape[1]):
        bad = int(np.argmax((i < 1) | (j < 1) | (i > shape[0]) | (j > shape[1])))
        raise ValueError(f"entry {bad + 1} is in row {i[bad]}, column {j[bad]} of a matrix of {shape[0]} by {shape[1]}")
    i, j, mirror = i - 1, j - 1, _SYMMETRIES[symmetry]
    across = (i != j) if mirror else np.zeros(len(i), dtype=bool)
    entries = np.append(v, mirror * v[across]), (np.append(i, j[across]), np.append(j, i[across]))
    return scipy.sparse.csc_matrix(scipy.sparse.coo_matrix(entries, shape=shape))


def _entries(lines: list[str], pattern: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if not lines:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    kind = _ENTRY[["row", "column"]] if pattern else _ENTRY
    found = np.loadtxt(lines, dtype=np.dtype([(n, kind[n]) for n in kind.names or ()]), comments=None, ndmin=1)
    return found["row"], found["column"], np.ones(len(found)) if pattern else found["value"]


def _full(shape: tuple[int, int], lines: list[str], mirror: float) -> scipy.sparse.csc_matrix:
    """Columns one after the other; of a symmetric matrix the lower triangle, of a skew one without its diagonal."""
    rows, columns = shape
    if mirror and rows != columns:
        raise ValueError(f"is symmetric with {rows} rows and {columns} columns")
    count = rows * columns if not mirror else rows * (rows + 1) // 2 if mirror > 0 else rows * (rows - 1) // 2
    if len(lines) != count:
        raise ValueError(f"announces {rows} by {columns} values and holds {len(lines)}, expected {count}")
    values = np.array([float(line) for line in lines])
    if not mirror:
        return scipy.sparse.csc_matrix(values.reshape(columns, rows).T)
    lower = np.zeros((rows, rows))
    j, i = np.triu_indices(rows, 0 if mirror > 0 else 1)
    lower[i, j] = values
    return scipy.sparse.csc_matrix(lower + mirror * np.tril(lower, -1).T)
