"""What a file of a laboratory holds: columns of numbers, with unit and rate where the file says them."""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.lab.sampling import rounded_rate
from jointlib.lab.text_table import TextTable

_MOST_COLUMNS = 64
_RATE = {"fs", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency", "samplefrequency", "rate", "sr"}
_STEP = {"dt", "dx", "delta", "delta_t", "sample_time", "sampling_interval", "increment", "ts", "wf_increment"}


@dataclass(frozen=True, eq=False)
class Column:
    """One signal."""

    name: str
    values: Array
    unit: str = ""
    """As the file says it; empty where it does not."""
    quantity: str | None = None
    """Where the file says it by a code of its own."""
    rate: float | None = None
    """Samples per second, where the file says it."""
    factor: float = 1.0
    """Value in ``unit`` = factor · number in the file."""


@dataclass(frozen=True, eq=False)
class LabFile:
    """A file as it was found."""

    path: Path
    columns: tuple[Column, ...]
    notes: tuple[str, ...] = ()
    """Sentences on what is not as usual."""
    table: TextTable | None = None
    """Of a text file: the table with its dialect and the lines above."""
    responses: tuple[tuple[str, str], ...] = ()
    """Frequency responses: motion at, force at, as ``12+X``."""
    spectra: tuple[str, ...] = ()
    """Names of complex arrays, which are no columns."""
    grouped: bool = False
    """Whether columns are named ``group/column``."""
    group: str = ""
    """The one group of a file of several whose columns these are."""

    def groups(self) -> tuple[LabFile, ...]:
        """A file for each group, where the groups hold the same columns, two or more; else itself."""
        if not self.grouped:
            return (self,)
        held: dict[str, list[Column]] = {}
        for column in self.columns:
            group, _, name = column.name.partition("/")
            held.setdefault(group, []).append(replace(column, name=name))
        names = [{c.name for c in columns} for columns in held.values()]
        if len(names[0]) < 2 or any(one != names[0] for one in names):
            return (self,)
        shown = ", ".join(list(held)[:4]) + " …" * (len(held) > 4)
        notes = (*self.notes, f"its {len(held)} groups {shown} hold the same channels and are taken as records")
        return tuple(replace(self, columns=tuple(c), notes=notes, group=group) for group, c in held.items())

    def arrays(self) -> dict[str, Array]:
        """Columns by name."""
        return {column.name: column.values for column in self.columns}


def needed(package: str, path: Path) -> Any:
    """A package of the extra ``lab``, imported when a file asks for it."""
    try:
        return importlib.import_module(package)
    except ModuleNotFoundError:
        raise InputError(f"{path}: {package} is not installed, expected pip install 'jointlib[lab]'") from None


def columns_of(arrays: Mapping[str, Any], units: Mapping[str, str] | None = None) -> tuple[Column, ...]:
    """Vectors and narrow matrices of real numbers as columns, named ``name`` or ``name 1``, ``name 2`` …

    A scalar whose name is that of a sample rate or a time step is the rate of all.
    """
    out: list[Column] = []
    for name, value in arrays.items():
        flat = np.asarray(value)
        if flat.dtype.kind not in "fiu" or flat.size < 2:
            continue
        unit = (units or {}).get(name, "")
        if flat.size == max(flat.shape):
            out.append(Column(name, flat.astype(float).ravel(), unit))
        elif flat.ndim == 2 and min(flat.shape) <= _MOST_COLUMNS < max(flat.shape):
            rows = flat if flat.shape[0] < flat.shape[1] else flat.T
            out += [Column(f"{name} {k}", row.astype(float), unit) for k, row in enumerate(rows, 1)]
    rate = rate_of(arrays)
    return tuple(out) if rate is None else tuple(replace(column, rate=rate) for column in out)


def spectra_of(arrays: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of arrays of complex numbers, two or more."""
    held = {name: np.asarray(value) for name, value in arrays.items()}
    return tuple(name for name, value in held.items() if value.dtype.kind == "c" and value.size > 1)


def rate_of(values: Mapping[str, Any]) -> float | None:
    """The sample rate in Hz that scalars tell by their names; None where none or several differ."""
    found: set[float] = set()
    for name, value in values.items():
        word = name.replace("/", ".").rpartition(".")[2].strip().casefold().replace(" ", "_")
        if word in _RATE | _STEP:
            number = scalar(value)
            if number is not None and 0 < number < math.inf:
                found.add(rounded_rate(number if word in _RATE else 1 / number))
    return found.pop() if len(found) == 1 else None


def scalar(value: Any) -> float | None:
    """A single real number; None for anything else."""
    flat = np.asarray(value)
    return float(flat.ravel()[0]) if flat.size == 1 and flat.dtype.kind in "fiu" else None


def refuse_twice(path: Path, names: Iterable[str]) -> None:
    """Refuse a name that two columns have."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise InputError(f"{path}: a column name stands twice, {name!r}")
        seen.add(name)
