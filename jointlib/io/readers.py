"""Columns of numbers from csv, npz, mat and universal files; third parties add formats by entry point."""

from __future__ import annotations

import csv
import io
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.registry import installed

Reader = Callable[[Path], dict[str, Array]]


def read_columns(path: Path) -> dict[str, Array]:
    """Every named one-dimensional array in a file, by the reader registered for its suffix."""
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}, expected a record")
    readers = installed("jointlib.readers").found
    suffix = path.suffix.lower().lstrip(".")
    if suffix not in readers:
        raise InputError(f"{path}: no reader for {path.suffix!r} files, {nearest(suffix, readers)}")
    columns: dict[str, Array] = readers[suffix](path)
    if not columns or all(len(c) == 0 for c in columns.values()):
        raise InputError(f"{path}: holds no samples, expected columns of numbers")
    return columns


def read_csv(path: Path) -> dict[str, Array]:
    """Comma-separated values with a header row; lines that start with # are comments."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = (line for line in file if not line.lstrip().startswith("#"))
            header = [name.strip() for name in next(csv.reader(rows), [])]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: cannot be read as CSV ({error})") from None
    names = header[: len(header) - (header[-1:] == [""])]
    if not names:
        raise InputError(f"{path}: empty, expected a header row and columns of numbers")
    if len(set(names)) < len(names):
        raise InputError(f"{path}: a column name stands twice in the header {', '.join(names)}")
    try:
        [float(name) for name in names]
    except ValueError:
        pass
    else:
        raise InputError(f"{path}: the first row holds numbers, expected a header row with channel names")
    try:
        with path.open(encoding="utf-8-sig") as file:
            numbered = [(n, line) for n, line in enumerate(file, 1) if line.strip() and line.lstrip()[0] != "#"]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as CSV ({error})") from None
    if not numbered[1:]:
        raise InputError(f"{path}: has a header but no samples")
    try:
        lines = [line for _, line in numbered[1:]]
        table = np.loadtxt(lines, delimiter=",", ndmin=2, usecols=range(len(names)), comments=None)
    except ValueError:
        number, text = next(((n, line) for n, line in numbered[1:] if not _is_row(line, len(names))), numbered[1])
        text = text.strip() if len(text) < 60 else f"{text[:57].strip()}..."
        raise InputError(f"{path}: line {number} is {text!r}, expected {len(names)} numbers a row") from None
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def _is_row(line: str, count: int) -> bool:
    try:
        return "_" not in line and len([float(cell) for cell in line.split(",")[:count]]) == count
    except ValueError:
        return False


def read_npz(path: Path) -> dict[str, Array]:
    """NumPy archive of one-dimensional arrays; nothing is unpickled."""
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            names = [name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy")]
            members = [archive.read(f"{name}.npy") for name in names]
        arrays = {
            name: np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)
            for name, data in zip(names, members, strict=True)
        }
    except (OSError, ValueError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"{path}: cannot be read as npz ({error})") from None
    return _one_dimensional(arrays)


def read_mat(path: Path) -> dict[str, Array]:
    """MATLAB file up to version 7."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        return _one_dimensional({k: v for k, v in loadmat(path).items() if not k.startswith("__")})
    except NotImplementedError:
        raise InputError(f"{path}: a MATLAB 7.3 file, expected version 7 or older (save with '-v7')") from None
    except (MatReadError, OSError, ValueError, TypeError) as error:
        raise InputError(f"{path}: cannot be read as a MATLAB file ({error})") from None


def read_uff(path: Path) -> dict[str, Array]:
    """Universal file: time histories of data sets 58, named by their first identification line."""
    import pyuff

    try:
        sets = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # pyuff raises bare exceptions of many kinds on broken files
        raise InputError(f"{path}: cannot be read as a universal file ({error})") from None
    sets = sets if isinstance(sets, list) else [sets]
    return _one_dimensional(
        {str(s["id1"]).strip(): s["data"] for s in sets if s.get("type") == 58 and s.get("func_type") in (0, 1)}
    )


def _one_dimensional(arrays: dict[str, np.ndarray]) -> dict[str, Array]:
    """Real vectors (a row or a column is one); scalars, strings and matrices are no channels."""
    out = {}
    for name, value in arrays.items():
        flat = np.asarray(value)
        if flat.dtype.kind in "fiu" and flat.size > 1 and flat.size == max(flat.shape):
            out[name] = flat.astype(float).ravel()
    return out
