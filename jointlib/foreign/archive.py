"""NumPy archives: arrays whose header fits their bytes; nothing in them is unpickled."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, foreign
from jointlib.system.memory import refuse_beyond

_HEADER = 65536
"""Letters that the header of an array may have."""


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    """Every array by name."""
    data = bytes_of(path, "a NumPy archive")
    return foreign(path, "npz", lambda: _arrays(path, data))


def _arrays(path: Path, data: bytes) -> dict[str, np.ndarray]:
    out = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in archive.infolist():
            if info.filename.endswith(".npy"):
                name = info.filename.removesuffix(".npy")
                if name in out:
                    raise InputError(f"{path}: holds {name!r} twice")
                refuse_beyond(2 * info.file_size, f"{path}: {name!r} of {info.file_size} bytes")
                out[name] = _array(name, archive.read(info))
    return out


def _array(name: str, data: bytes) -> np.ndarray:
    """One array, after its header has been held against the bytes that follow."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file, _HEADER)
    if dtype.hasobject:
        raise ValueError(f"{name!r} holds objects of a program, expected numbers")
    need = math.prod(shape) * dtype.itemsize
    if any(n < 0 for n in shape) or need != len(data) - file.tell():
        raise ValueError(f"{name!r} announces {need} bytes and {len(data) - file.tell()} follow")
    return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False, max_header_size=_HEADER)


def is_sparse(arrays: Mapping[str, np.ndarray]) -> bool:
    """Whether an archive is a sparse matrix, as scipy saves it."""
    return {"format", "shape", "data"} <= arrays.keys()


def sparse_of(arrays: Mapping[str, np.ndarray]) -> scipy.sparse.csc_matrix:
    """The sparse matrix in an archive, its indices held against its shape before anything follows them."""
    form = arrays["format"].item()
    form = form.decode("ascii") if isinstance(form, bytes) else str(form)
    shape = tuple(int(n) for n in arrays["shape"])
    if len(shape) != 2 or min(shape) < 1:
        raise ValueError(f"shape {shape}, expected rows and columns")
    refuse_beyond(32.0 * sum(shape), f"a matrix of {shape[0]} rows and {shape[1]} columns")
    data: Any = arrays["data"]
    if form in ("csc", "csr", "bsr"):
        kind: Any = getattr(scipy.sparse, f"{form}_matrix")
        found = kind((data, arrays["indices"], arrays["indptr"]), shape=shape)
        found.check_format(full_check=True)
    elif form == "coo":
        found = scipy.sparse.coo_matrix((data, (arrays["row"], arrays["col"])), shape=shape)
    elif form == "dia":
        found = scipy.sparse.dia_matrix((data, arrays["offsets"]), shape=shape)
    else:
        raise ValueError(f"a sparse matrix of form {form!r}, expected csc, csr, coo, dia or bsr")
    return scipy.sparse.csc_matrix(found)
