"""MATLAB files: up to version 7 as such, 7.3 as the HDF5 file that it is."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.foreign.door import bytes_of, foreign
from jointlib.foreign.matlab import is_hdf5, variables_of
from jointlib.lab.formats.hdf5 import hdf5_arrays, read_hdf5
from jointlib.lab.lab_file import LabFile, columns_of, spectra_of

_DEEPEST = 6


def read_matlab(path: Path) -> LabFile:
    """Variables by name, fields of structures as ``name.field``."""
    data = bytes_of(path, "a MATLAB file")
    if is_hdf5(data):
        return read_hdf5(path)
    arrays = _variables(path, data)
    units = {name.rpartition(".")[0]: value for name, value in arrays.items() if isinstance(value, str)}
    by_field = {name: units.get(name.rpartition(".")[0], "") if "." in name else "" for name in arrays}
    return LabFile(path, columns_of(arrays, by_field if _told(arrays) else {}), spectra=spectra_of(arrays))


def matlab_arrays(path: Path) -> dict[str, Any]:
    """Arrays and texts by the names that :func:`read_matlab` gives them, complex ones too."""
    data = bytes_of(path, "a MATLAB file")
    return hdf5_arrays(path)[0] if is_hdf5(data) else _variables(path, data)


def _variables(path: Path, data: bytes) -> dict[str, Any]:
    held = foreign(path, "a MATLAB file", lambda: variables_of(data))
    return {name: value for key, item in held.items() if not key.startswith("__") for name, value in _flat(key, item)}


def _told(arrays: dict[str, Any]) -> bool:
    """Whether structures say the unit of their values in a field of that name."""
    return any(name.casefold().endswith((".unit", ".units")) for name in arrays)


def _flat(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and depth < _DEEPEST:
        for key, inner in value.items():
            yield from _flat(f"{name}.{key}", inner, depth + 1)
    elif isinstance(value, list) and depth < _DEEPEST:
        for k, inner in enumerate(value, 1):
            yield from _flat(f"{name} {k}", inner, depth + 1)
    elif isinstance(value, str | np.ndarray | int | float):
        yield name, value
