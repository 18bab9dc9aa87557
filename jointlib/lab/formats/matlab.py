"""MATLAB files: up to version 7 by scipy, 7.3 as the HDF5 file that it is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.lab.formats.hdf5 import read_hdf5
from jointlib.lab.lab_file import LabFile, columns_of

_DEEPEST = 6


def read_matlab(path: Path) -> LabFile:
    """Variables by name, fields of structures as ``name.field``."""
    from scipy.io import loadmat

    try:
        held = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        return read_hdf5(path)
    except Exception as error:  # scipy raises plain exceptions of many kinds on broken files
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{path}: cannot be read as a MATLAB file ({said})") from None
    arrays = {name: value for key, item in held.items() if not key.startswith("__") for name, value in _flat(key, item)}
    units = {name.rpartition(".")[0]: value for name, value in arrays.items() if isinstance(value, str)}
    by_field = {name: units.get(name.rpartition(".")[0], "") if "." in name else "" for name in arrays}
    return LabFile(path, columns_of(arrays, by_field if _told(arrays) else {}))


def _told(arrays: dict[str, Any]) -> bool:
    """Whether structures say the unit of their values in a field of that name."""
    return any(name.casefold().endswith((".unit", ".units")) for name in arrays)


def _flat(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    listed = isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object)
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}", inner, depth + 1)
    elif listed and depth < _DEEPEST:
        for k, inner in enumerate(np.ravel(value), 1):
            yield from _flat(f"{name} {k}", inner, depth + 1)
    elif isinstance(value, str | np.ndarray | int | float):
        yield name, value
