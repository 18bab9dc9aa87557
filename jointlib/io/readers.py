"""Columns of numbers from text tables and the formats of laboratories; third parties add formats by entry point."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.foreign.door import foreign
from jointlib.lab.dialect import Told
from jointlib.lab.formats.wave import read_wave
from jointlib.lab.open_file import open_lab_file
from jointlib.lab.text_table import TextTable, read_table
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
    columns: dict[str, Array] = foreign(
        path, "a record", lambda: reader(path, told) if reader in (read_csv, read_lab) else reader(path)
    )
    if not columns or all(len(c) == 0 for c in columns.values()):
        raise InputError(f"{path}: holds no samples, expected columns of numbers")
    return columns


def rate_of_sound(path: Path) -> float | None:
    """Hz that a WAV file tells of itself; None for any other file."""
    return read_wave(path).columns[0].rate if path.suffix.lower() == ".wav" else None


def read_csv(path: Path, told: Told | None = None) -> dict[str, Array]:
    """A table as text, in the dialect of its program or as ``told``, with a row of names above the numbers."""
    return named_columns(path, read_table(path, told), told)


def named_columns(path: Path, table: TextTable, told: Told | None) -> dict[str, Array]:
    """The columns of a table by their names, which must differ."""
    names = table.names
    if not table.named and (told is None or told.header != 0):
        raise InputError(
            f"{path}: the first row holds numbers, expected a header row with channel names "
            "(or [text] header = 0: there are none)"
        )
    if len(set(names)) < len(names):
        raise InputError(f"{path}: a column name stands twice in the header {', '.join(names)}")
    return dict(zip(names, table.columns, strict=True))


def read_lab(path: Path, told: Told | None = None) -> dict[str, Array]:
    """Columns of the other formats of laboratories: npz, MATLAB, universal, TDMS, HDF5, WAV and LabVIEW files."""
    return open_lab_file(path, told).arrays()
