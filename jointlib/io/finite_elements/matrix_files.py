"""Large matrices from files: MatrixMarket, Harwell–Boeing, npz, mat, Nastran DMIG and OUTPUT4, CalculiX."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, issparse

from jointlib.errors import InputError, nearest
from jointlib.io.finite_elements.calculix import read_calculix
from jointlib.io.finite_elements.dmig import Label, read_dmig
from jointlib.io.finite_elements.harwell_boeing import read_harwell_boeing
from jointlib.io.finite_elements.op4 import read_op4

MATRIX_MARKET = (".mtx", ".mm")
HARWELL_BOEING = (".hb", ".rsa", ".rua", ".rb", ".matrix")
DMIG = (".pch", ".bdf", ".dat", ".nas", ".dmig")
_UNREADABLE = (ValueError, OSError, EOFError, KeyError, TypeError, RuntimeError, zipfile.BadZipFile, zlib.error)
CALCULIX = (".sti", ".mas")
SUFFIXES = (*MATRIX_MARKET, *HARWELL_BOEING, *DMIG, *CALCULIX, ".op4", ".npz", ".mat")


@dataclass(frozen=True, eq=False)
class MatrixFile:
    """A square matrix, with the grid point and component of its rows where the file tells them."""

    matrix: csc_matrix
    labels: tuple[Label, ...] | None = None


def read_matrix(path: Path, name: str | None = None) -> MatrixFile:
    """A real square matrix; where the file holds several, ``name`` says which."""
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {what}, expected a matrix")
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: no reader for {path.suffix!r} matrices, {nearest(suffix, SUFFIXES)}")
    try:
        found = _read(path, suffix, name)
    except InputError:
        raise
    except _UNREADABLE as error:
        raise InputError(f"{path}: cannot be read as a matrix ({_reason(error)})") from None
    matrix = found.matrix
    if matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise InputError(f"{path}: the matrix has shape {matrix.shape}, expected a square one")
    if matrix.dtype.kind == "c" or not np.all(np.isfinite(matrix.data)):
        raise InputError(f"{path}: the matrix holds values that are not real and finite")
    return found


def _read(path: Path, suffix: str, name: str | None) -> MatrixFile:
    if suffix in MATRIX_MARKET:
        from scipy.io import mmread

        return MatrixFile(_sparse(mmread(path)))
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
        arrays = _npz(path)
        if {"data", "indices", "indptr", "shape", "format"} <= set(arrays):
            from scipy.sparse import load_npz

            return MatrixFile(_sparse(load_npz(path)))
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
    try:
        held = _npz(path) if suffix == ".npz" else _mat(path)
    except _UNREADABLE as error:
        raise InputError(f"{path}: cannot be read as arrays ({_reason(error)})") from None
    for name in held:
        held[name] = np.asarray(held[name].toarray() if issparse(held[name]) else held[name])
    return {name: value for name, value in held.items() if value.dtype.kind in "fiuc"}


def _mat(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        return {k: v for k, v in loadmat(path).items() if not k.startswith("__")}
    except NotImplementedError:
        raise ValueError("a MATLAB 7.3 file, expected version 7 or older; save with '-v7'") from None
    except MatReadError as error:
        raise ValueError(_reason(error)) from None


def _reason(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)


def _npz(path: Path) -> dict[str, Any]:
    with path.open("rb") as file, zipfile.ZipFile(file) as archive:
        names = [n.removesuffix(".npy") for n in archive.namelist() if n.endswith(".npy")]
        return {n: np.lib.format.read_array(io.BytesIO(archive.read(f"{n}.npy")), allow_pickle=False) for n in names}


def _named(path: Path, found: Mapping[str, Any], name: str | None) -> Any:
    if not found:
        raise InputError(f"{path}: holds no matrix")
    if name is None:
        if len(found) > 1:
            raise InputError(f"{path}: holds {', '.join(sorted(found))}, expected a name that says which")
        return next(iter(found.values()))
    known = {key.upper(): key for key in found}
    if name.upper() not in known:
        raise InputError(f"{path}: no matrix {name!r}, {nearest(name, found)}")
    return found[known[name.upper()]]


def _sparse(value: Any) -> csc_matrix:
    if not issparse(value):
        value = np.asarray(value)
        if value.ndim != 2 or value.dtype.kind not in "fiu":
            raise ValueError(f"shape {value.shape} of {value.dtype}, expected a real matrix")
    return csc_matrix(value, dtype=complex if value.dtype.kind == "c" else float)
