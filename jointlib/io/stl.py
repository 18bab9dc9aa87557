"""Surfaces in STL files, binary or text: triangles and nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, usable

_HEAD, _EACH = 84, 50
"""Bytes before the triangles, and of each."""
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")


def read_stl(path: Path) -> Array:
    """Corners of the triangles in the numbers of the file, (n, 3, 3), counter-clockwise seen from outside.

    Raises
    ------
    InputError
        Where the file cannot be read or is no whole STL file.
    """
    data = bytes_of(path, "an STL file")
    count = int.from_bytes(data[80:_HEAD], "little") if len(data) >= _HEAD else -1
    if count >= 0 and len(data) == _HEAD + _EACH * count:
        found = np.frombuffer(data, _RECORD, offset=_HEAD)["corners"].astype(float)
    elif data.lstrip()[:5].lower() == b"solid" and b"vertex" in data:
        found = _text(path, data)
    else:
        promised = f"its head promises {count} triangles, {_HEAD + _EACH * count} bytes" if count >= 0 else "too few"
        raise InputError(f"{path}: {len(data)} bytes, {promised}; expected a whole STL file, binary or text")
    if not len(found):
        raise InputError(f"{path}: holds no triangle, expected the triangles of a surface")
    return np.asarray(usable(path, "triangle, corner and axis", found))


def _text(path: Path, data: bytes) -> Array:
    rows, facets = _VERTEX.findall(data), len(re.findall(rb"\bendfacet\b", data))
    if len(rows) != 3 * facets or b"endsolid" not in data:
        raise InputError(
            f"{path}: {len(rows)} corners in {facets} whole facets, expected three each and 'endsolid' at the end"
        )
    try:
        return np.array(rows, dtype="S").astype(float).reshape(-1, 3, 3)
    except ValueError:
        raise InputError(f"{path}: a vertex is no three numbers, expected a whole STL file") from None
