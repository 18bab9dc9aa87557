"""Columns of numbers from csv, npz, mat and universal files; third parties add formats by entry point."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.lab.dialect import Told
from jointlib.lab.text_table import read_table
from jointlib.registry import installed

Reader = Callable[[Path], dict[str, Array]]


def read_columns(path: Path, told: Told | None = None) -> dict[str, Array]:
    """Every named one-dimensional array in a file, by the reader registered for its suffix.

    ``told`` is the dialect of text files, as far as it is known.
    """
    path = Path(path)
    if not path.is_file():
        found = "a folder" if path.is_dir() else "no such file"
        raise InputError(f"{path}: {found}, expected a record")
    readers = installed("jointlib.readers").found
    suffix = path.suffix.lower().lstrip(".")
    if suffix not in readers:
        raise InputError(f"{path}: no reader for {path.suffix!r} files, {nearest(suffix, readers)}")
    reader = readers[suffix]
    columns: dict[str, Array] = read_csv(path, told) if reader is read_csv else reader(path)
    if not columns or all(len(c) == 0 for c in columns.values()):
        raise InputError(f"{path}: holds no samples, expected columns of numbers")
    return columns


def read_csv(path: Path, told: Told | None = None) -> dict[str, Array]:
    """A table as text, in the dialect of its program or as ``told``, with a row of names above the numbers."""
    table = read_table(path, told)
    names = table.names
    if not table.named and (told is None or told.header != 0):
        raise InputError(
            f"{path}: the first row holds numbers, expected a header row with channel names "
            "(or [text] header = 0: there are none)"
        )
    if len(set(names)) < len(names):
        raise InputError(f"{path}: a column name stands twice in the header {', '.join(names)}")
    return dict(zip(names, table.columns, strict=True))


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
