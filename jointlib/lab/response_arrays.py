"""Frequency responses as arrays, under whatever names a program or a person gave them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.foreign.archive import arrays_of
from jointlib.foreign.door import usable
from jointlib.frf import Quantity
from jointlib.lab.formats.hdf5 import hdf5_arrays
from jointlib.lab.formats.matlab import matlab_arrays
from jointlib.lab.lab_file import spectra_of
from jointlib.lab.response_columns import role_of

VALUES = ("H", *(q.word for q in Quantity))
"""Names of the values that are known."""


def is_frequency(name: str) -> bool:
    """Whether an array of a name, or a field of a structure, is one of frequencies."""
    return role_of(name.replace("/", ".").rpartition(".")[2]) == "frequency"


def response_arrays(path: Path) -> dict[str, Any]:
    """Arrays by name, those of the frequencies and of the values as ``frequency`` and as one of :data:`VALUES`.

    Where no name is known, the one vector of frequencies is that whose name says so, and the one complex array the
    values; ``name.field`` are fields of structures.

    Raises
    ------
    InputError
        What the file holds, where that is not one of each.
    """
    held = _arrays(path)
    known = [name for name in VALUES if name in held]
    frequencies = [name for name in held if is_frequency(name)]
    values = known or list(spectra_of(held))
    frequency = "frequency" if "frequency" in held else frequencies[0] if len(frequencies) == 1 else None
    if frequency is None or len(values) != 1:
        shown = ", ".join(held) or "no arrays"
        raise InputError(
            f"{path}: holds {shown}, expected 'frequency' and one of {', '.join(VALUES)}, or one complex array"
        )
    return {**held, "frequency": held[frequency], _word(values[0]): held[values[0]]}


def _word(name: str) -> str:
    """The name of values as this program has it: what a receptance, mobility or accelerance says of itself, else H."""
    return next((q.word for q in Quantity if q.word in name.casefold()), "H")


def _arrays(path: Path) -> Mapping[str, Any]:
    suffix = path.suffix.lower()
    found = arrays_of(path) if suffix == ".npz" else matlab_arrays(path) if suffix == ".mat" else hdf5_arrays(path)[0]
    held = {name: np.asarray(value) for name, value in found.items()}
    return {name: _numbers(path, name, value) for name, value in held.items() if value.dtype.kind in "fiuc"}


def _numbers(path: Path, name: str, value: np.ndarray) -> np.ndarray:
    return value if value.dtype.kind in "iu" else usable(path, name, value)
