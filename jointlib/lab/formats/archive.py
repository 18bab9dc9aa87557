"""NumPy archives; nothing in them is unpickled."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

import numpy as np

from jointlib.errors import InputError
from jointlib.lab.lab_file import LabFile, columns_of


def read_archive(path: Path) -> LabFile:
    """Arrays by name."""
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
    return LabFile(path, columns_of(arrays))
