"""HDF5 files, MATLAB 7.3 files among them, read by h5py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from jointlib.foreign.door import foreign
from jointlib.foreign.tried import tried
from jointlib.lab.lab_file import LabFile, columns_of, needed, spectra_of
from jointlib.system.memory import refuse_beyond

_UNITS = ("unit", "units", "Unit", "Units", "unit_string", "EngineeringUnit")


def read_hdf5(path: Path) -> LabFile:
    """Data sets of numbers by their path, one or two dimensions; attributes tell units and rate."""
    arrays, units = hdf5_arrays(path)
    return LabFile(path, columns_of(arrays, units), spectra=spectra_of(arrays))


def hdf5_arrays(path: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """Data sets and scalars of attributes by their path, and units; a table of ``real`` and ``imag`` is complex."""
    h5py = needed("h5py", path)
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}

    def visit(name: str, item: Any) -> None:
        rated = {f"{name}.{key}": value for key, value in item.attrs.items()}
        arrays.update({key: value for key, value in rated.items() if np.asarray(value).size == 1})
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        refuse_beyond(2.0 * item.size * item.dtype.itemsize, f"{path}: {name!r} of {item.size} values")
        if item.dtype.names == ("real", "imag"):
            held = item[()]
            arrays[name] = held["real"] + 1j * held["imag"]
        elif item.dtype.names:
            arrays.update({f"{name}/{field}": item[field] for field in item.dtype.names})
        elif item.dtype.kind in "fiu" and item.size and "MATLAB_empty" not in item.attrs:
            arrays[name] = item[()]
        said = next((item.attrs[key] for key in _UNITS if key in item.attrs), "")
        units[name] = said.decode("utf-8", "replace") if isinstance(said, bytes) else str(said)

    def read() -> None:
        with h5py.File(path, "r") as file:
            visit("", file)
            file.visititems(visit)

    tried(path, "an HDF5 file", read)
    foreign(path, "an HDF5 file", read)
    return arrays, units
