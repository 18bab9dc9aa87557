"""NumPy archives; nothing in them is unpickled."""

from __future__ import annotations

from pathlib import Path

from jointlib.foreign.archive import arrays_of
from jointlib.lab.lab_file import LabFile, columns_of, spectra_of


def read_archive(path: Path) -> LabFile:
    """Arrays by name."""
    arrays = arrays_of(path)
    return LabFile(path, columns_of(arrays), spectra=spectra_of(arrays))
