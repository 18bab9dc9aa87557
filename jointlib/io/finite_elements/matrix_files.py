"""Large matrices from files: MatrixMarket, Harwell–Boeing, npz, mat, Nastran DMIG and OUTPUT4, CalculiX."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.errors import InputError, few, nearest
from jointlib.foreign.archive import arrays_of, is_sparse, sparse_of
from jointlib.foreign.door import LARGEST, bytes_of, foreign, usable
from jointlib.foreign.matlab import variables_of
from jointlib.foreign.matrix_market import read_matrix_market
from jointlib.io.finite_elements.calculix import read_calculix
from jointlib.io.finite_elements.dmig import Label, read_dmig
from jointlib.io.finite_elements.harwell_boeing import read_harwell_boeing
from jointlib.io.finite_elements.op4 import read_op4
from jointlib.system.memory import refuse_beyond

MATRIX_MARKET = (".mtx", ".mm")
HARWELL_BOEING = (".hb", ".rsa", ".rua", ".rb", ".matrix")
DMIG = (".pch", ".bdf", ".dat", ".nas", ".dmig")
CALCULIX = (".sti", ".mas")
SUFFIXES = (*MATRIX_MARKET, *HARWELL_BOEING, *DMIG, *CALCULIX, ".op4", ".npz", ".mat")


@dataclass(frozen=True, eq=False)
class MatrixFile:
    """A square matrix, with the grid point and component of its rows where the file tells them."""

    matrix: scipy.sparse.csc_matrix
    labels: tuple[Label, ...] | None = None


def read_matrix(path: Path, name: str | None = None) -> MatrixFile:
    """A real square matrix; where the file holds several, ``name`` says which."""
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {what}, expected a matrix")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: no reader for {path.suffix!r} matrices, {nearest(suffix, SUFFIXES)}")
    found = foreign(path, "a matrix", lambda: _read(path, suffix, name))
    matrix = found.matrix
    if matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise InputError(f"{path}: the matrix has shape {matrix.shape}, expected a square one")
    if matrix.dtype.kind == "c":
        raise InputError(f"{path}: the matrix holds complex values, expected a real matrix")
    bad = ~(np.abs(matrix.data) <= LARGEST)
    if np.any(bad):
        entries = matrix.tocoo()
        first = int(np.argmax(bad))
        row, column = (int(at[first]) + 1 for at in entries.coords)
        spot = f"the matrix in row {row}, column {column}"
        raise InputError(f"{path}: {spot} is {entries.data[first]:g}, expected finite numbers up to {LARGEST:g}")
    return found


def _read(path: Path, suffix: str, name: str | None) -> MatrixFile:
    if suffix in MATRIX_MARKET:
        text = bytes_of(path, "a matrix").decode("latin-1")
        return MatrixFile(read_matrix_market(path, text))
    if suffix in HARWELL_BOEING:
        return MatrixFile(read_harwell_boeing(path))
    if suffix in DMIG:
        matrix, labels = _named(path, read_dmig(path), name)
        return MatrixFile(matrix, labels)
    if suffix in CALCULIX:
        return MatrixFile(*read_calculix(path))
    if suffix == ".op4":
        return MatrixFile(_named(path, read_op4(path), name))
    if suffix == ".npz":
        arrays = arrays_of(path)
        if is_sparse(arrays):
            return MatrixFile(_sparse(sparse_of(arrays)))
        return MatrixFile(_sparse(_named(path, arrays, name)))
    return MatrixFile(_sparse(_named(path, _mat(path), name)))


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Every numeric array of an npz or mat file by name; nothing is unpickled."""
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}, expected arrays")
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".mat"):
        raise InputError(f"{path}: no arrays in {path.suffix!r} files, expected .npz or .mat")
    held: dict[str, Any] = foreign(path, "arrays", lambda: arrays_of(path) if suffix == ".npz" else _mat(path))
    for name in held:
        if scipy.sparse.issparse(held[name]):
            refuse_beyond(16.0 * np.prod(held[name].shape), f"{path}: {name!r} of {held[name].shape} entries")
            held[name] = held[name].toarray()
    return {name: _numbers(path, name, np.asarray(value)) for name, value in held.items() if _counts(value)}


def _counts(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiuc"


def _numbers(path: Path, name: str, value: np.ndarray) -> np.ndarray:
    return value if value.dtype.kind in "iu" else usable(path, name, value)


def _mat(path: Path) -> dict[str, Any]:
    found = variables_of(bytes_of(path, "arrays"))
    return {k: v for k, v in found.items() if isinstance(v, np.ndarray) or scipy.sparse.issparse(v)}


def _named(path: Path, found: Mapping[str, Any], name: str | None) -> Any:
    if not found:
        raise InputError(f"{path}: holds no matrix")
    if name is None:
        if len(found) > 1:
            raise InputError(f"{path}: holds {few(sorted(found))}, expected a name that says which")
        return next(iter(found.values()))
    known = {key.upper(): key for key in found}
    if name.upper() not in known:
        raise InputError(f"{path}: no matrix {name!r}, {nearest(name, found)}")
    return found[known[name.upper()]]


def _sparse(value: Any) -> scipy.sparse.csc_matrix:
    if not scipy.sparse.issparse(value):
        value = np.asarray(value)
        if value.ndim != 2 or value.dtype.kind not in "fiu":
            raise ValueError(f"shape {value.shape} of {value.dtype}, expected a real matrix")
    return scipy.sparse.csc_matrix(value, dtype=complex if value.dtype.kind == "c" else float)
