"""Any file of a laboratory, by its suffix."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jointlib.errors import InputError
from jointlib.foreign.door import foreign
from jointlib.lab.dialect import Told
from jointlib.lab.formats.archive import read_archive
from jointlib.lab.formats.hdf5 import read_hdf5
from jointlib.lab.formats.lvm import read_lvm
from jointlib.lab.formats.matlab import read_matlab
from jointlib.lab.formats.tdms import read_tdms
from jointlib.lab.formats.universal_records import read_universal
from jointlib.lab.formats.wave import read_wave
from jointlib.lab.lab_file import Column, LabFile, refuse_twice
from jointlib.lab.text_table import read_table

TEXT = ("csv", "txt", "tsv", "asc", "dat")
FORMATS: dict[str, Callable[[Path], LabFile]] = {
    "npz": read_archive,
    "mat": read_matlab,
    "uff": read_universal,
    "unv": read_universal,
    "tdms": read_tdms,
    "h5": read_hdf5,
    "hdf5": read_hdf5,
    "wav": read_wave,
}
_FIRST = {
    b"TDSm": ("tdms",),
    b"\x89HDF": ("h5", "hdf5", "mat"),
    b"MATLAB 5": ("mat",),
    b"MATLAB 7": ("mat",),
    b"RIFF": ("wav",),
    b"PK\x03\x04": ("npz",),
}
"""First bytes of formats, and the suffixes under which each is read."""


def open_lab_file(path: Path, told: Told | None = None) -> LabFile:
    """What a file holds; of a text table also its dialect, in which ``told`` says what is known."""
    return foreign(path, "a record", lambda: _opened(path, told))


def _opened(path: Path, told: Told | None) -> LabFile:
    suffix = path.suffix.lower().lstrip(".")
    if suffix in TEXT:
        return _text(path, told)
    if suffix == "lvm":
        return read_lvm(path, told)
    _refuse_mistaken(path, suffix)
    return FORMATS[suffix](path)


def _text(path: Path, told: Told | None) -> LabFile:
    table = read_table(path, told)
    refuse_twice(path, table.names)
    columns = [Column(n, v, u) for n, v, u in zip(table.names, table.columns, table.units, strict=True)]
    left = tuple(f"column {name!r} holds text or nothing and is left out" for name in table.left_out)
    return LabFile(path, tuple(columns), left, table)


def _refuse_mistaken(path: Path, suffix: str) -> None:
    """Refuse a file that is of another format than its suffix says."""
    try:
        with path.open("rb") as file:
            first = file.read(16)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    if not first:
        raise InputError(f"{path}: empty, expected a {suffix} file")
    for start, suffixes in _FIRST.items():
        if first.startswith(start) and suffix not in suffixes:
            raise InputError(f"{path}: is a .{suffixes[0]} file by its first bytes, expected what .{suffix} says")
