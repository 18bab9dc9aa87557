"""MATLAB files of versions 4 to 7: every length held against the bytes that are there, so that no damage crashes."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from jointlib.system.memory import limit

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Types of data elements by their number."""
_TEXTS = {1: "latin-1", 2: "latin-1", 3: "utf-16", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
"""Types of arrays by their class."""
_MATRIX, _PACKED = 14, 15
_CELL, _STRUCTURE, _OBJECT, _CHARACTER, _SPARSE = 1, 2, 3, 4, 5
_COMPLEX, _LOGICAL = 0x0800, 0x0200
_HEADER = 128
_DEEPEST = 24
_OLD = ("f8", "f4", "i4", "i2", "u2", "u1")
"""Types of version 4."""


def is_hdf5(data: bytes) -> bool:
    """Whether a file is of version 7.3, which is HDF5, behind a head of its own or bare."""
    version = {b"IM": "<H", b"MI": ">H"}.get(data[126:128])
    return data.startswith(b"\x89HDF") or bool(version and struct.unpack_from(version, data, 124)[0] == 0x0200)


def variables_of(data: bytes) -> dict[str, Any]:
    """Variables by name: arrays of two or more dimensions, text as ``str``, structures as ``dict``, cells as ``list``.

    Cells and arrays of structures are listed by rows. Functions and objects of classes are left out.

    Format: MAT-File Format, The MathWorks; a data element is a type, a length and so many bytes.

    Raises
    ------
    ValueError
        What is wrong with the file, without its name.
    """
    if is_hdf5(data):
        raise ValueError("a MATLAB 7.3 file, expected version 7 or older; save with '-v7'")
    if len(data) >= _HEADER and data[126:128] in (b"IM", b"MI"):
        order = "<" if data[126:128] == b"IM" else ">"
        return dict(_variables(_Elements(data, order, _HEADER, len(data))))
    return dict(_old(data))


@dataclass
class _Elements:
    """Data elements one after the other, up to ``end``."""

    data: bytes
    order: str
    at: int
    end: int

    def __bool__(self) -> bool:
        return self.at < self.end

    def next(self) -> tuple[int, int, int]:
        """Type of the next element, where its bytes begin and where they end."""
        if self.at + 8 > self.end:
            raise ValueError(f"ends within an element at byte {self.at}")
        kind, size = struct.unpack_from(self.order + "2I", self.data, self.at)
        if kind >> 16:  # a short one, both numbers and up to four bytes in eight
            first = self.at + 4
            kind, size, after = kind & 0xFFFF, kind >> 16, self.at + 8
            if size > 4:
                raise ValueError(f"a short element at byte {self.at} has {size} bytes")
        else:
            first = self.at + 8
            after = first + size + (0 if kind == _PACKED else -size % 8)
        if first + size > self.end:
            raise ValueError(f"the element at byte {self.at} has {size} bytes and {max(0, self.end - first)} follow")
        self.at = min(after, self.end)
        return kind, first, first + size

    def inside(self, first: int, last: int) -> _Elements:
        return _Elements(self.data, self.order, first, last)

    def numbers(self, wanted: str = "numbers") -> np.ndarray:
        """The next element as numbers of its type."""
        kind, first, last = self.next()
        if kind not in _NUMBERS:
            raise ValueError(f"an element of type {kind} stands where {wanted} are expected")
        dtype = np.dtype(self.order + _NUMBERS[kind])
        if (last - first) % dtype.itemsize:
            raise ValueError(f"{last - first} bytes are no whole number of {wanted}")
        return np.frombuffer(self.data, dtype, (last - first) // dtype.itemsize, first)

    def text(self) -> str:
        """The next element as letters."""
        kind, first, last = self.next()
        if kind not in _TEXTS:
            raise ValueError(f"an element of type {kind} stands where a text is expected")
        coding = _TEXTS[kind]
        coding += {"<": "-le", ">": "-be"}[self.order] if coding in ("utf-16", "utf-32") else ""
        return self.data[first:last].decode(coding, "replace")


def _variables(elements: _Elements) -> Iterator[tuple[str, Any]]:
    while elements:
        begun = elements.at
        kind, first, last = elements.next()
        if kind == _PACKED:
            packer, most = zlib.decompressobj(), limit() // 4
            inside = packer.decompress(elements.data[first:last], most)
            if packer.unconsumed_tail:
                raise ValueError(f"the element at byte {begun} unpacks to more than the memory that is free")
            if not packer.eof:
                raise ValueError(f"the element at byte {begun} ends within its packed bytes")
            unpacked = _Elements(inside, elements.order, 0, len(inside))
            kind, first, last = unpacked.next()
        else:
            unpacked = elements
        if kind != _MATRIX:
            raise ValueError(f"an element of type {kind} at byte {begun}, expected a variable")
        name, value = _matrix(unpacked.inside(first, last), 0)
        if name and value is not None:
            yield name, value


def _matrix(elements: _Elements, depth: int) -> tuple[str, Any]:
    """Name and value of one variable, cell or field; None for what is left out."""
    if not elements:
        return "", np.empty((0, 0))
    if depth > _DEEPEST:
        raise ValueError("cells and structures are nested too deeply")
    flags = elements.numbers("flags")
    if len(flags) < 2:
        raise ValueError("a variable has no flags")
    kind, marks = int(flags[0]) & 0xFF, int(flags[0])
    if kind not in (*_CLASSES, _CELL, _STRUCTURE, _OBJECT, _CHARACTER, _SPARSE):
        return "", None
    shape = tuple(int(n) for n in elements.numbers("dimensions"))
    name = elements.text().rstrip("\0")
    if len(shape) < 2 or min(shape) < 0:
        raise ValueError(f"{name!r} has dimensions {shape[:8]}")
    count = math.prod(shape)
    if kind in _CLASSES:
        return name, _plain(elements, name, shape, kind, marks)
    if kind == _CHARACTER:
        return name, _letters(elements, shape)
    if kind == _SPARSE:
        return name, _sparse(elements, name, shape, bool(marks & _COMPLEX))
    if kind == _OBJECT:
        elements.text()
    fields = _fields(elements, name) if kind != _CELL else [""]
    if count * len(fields) * 8 > elements.end - elements.at:
        raise ValueError(f"{name!r} announces {count} entries, and they do not follow")
    held = [[_inner(elements, depth) for _ in fields] for _ in range(count)]
    by_rows = np.arange(count).reshape(shape, order="F").ravel()
    if kind == _CELL:
        return name, [held[k][0] for k in by_rows]
    rows = [dict(zip(fields, held[k], strict=True)) for k in by_rows]
    return name, rows[0] if count == 1 else rows


def _inner(elements: _Elements, depth: int) -> Any:
    kind, first, last = elements.next()
    if kind != _MATRIX:
        raise ValueError(f"an element of type {kind} stands where an entry is expected")
    return _matrix(elements.inside(first, last), depth + 1)[1]


def _fields(elements: _Elements, name: str) -> list[str]:
    length = elements.numbers("a length")
    letters = elements.text().encode("latin-1", "replace")
    each = int(length[0]) if len(length) else 0
    if each < 1 or len(letters) % each:
        raise ValueError(f"{name!r} has no whole names of fields")
    return [letters[k : k + each].split(b"\0")[0].decode("latin-1") for k in range(0, len(letters), each)]


def _plain(elements: _Elements, name: str, shape: tuple[int, ...], kind: int, marks: int) -> np.ndarray:
    """An array of numbers, by columns, stored in any type that holds them."""
    parts = [elements.numbers() for _ in range(2 if marks & _COMPLEX else 1)]
    for part in parts:
        if len(part) != math.prod(shape):
            raise ValueError(f"{name!r} announces {' by '.join(map(str, shape[:8]))} values and holds {len(part)}")
    dtype = np.dtype(_CLASSES[kind])
    real = parts[0].astype(dtype)
    value = _complex(real, parts[1].astype(dtype)) if len(parts) > 1 else real
    value = value.reshape(shape, order="F")
    return value.astype(bool) if marks & _LOGICAL else value


def _complex(real: np.ndarray, imaginary: np.ndarray) -> np.ndarray:
    """Complex numbers by their parts; the sum real + 1j · imaginary would make 0 + inf·j not a number."""
    if real.shape != imaginary.shape:
        raise ValueError(f"{len(real)} real parts have {len(imaginary)} imaginary ones")
    value = np.empty(real.shape, dtype=np.result_type(real, np.complex64))
    value.real, value.imag = real, imaginary
    return value


def _letters(elements: _Elements, shape: tuple[int, ...]) -> str:
    """Text; of several rows the first, which is what names and units are."""
    text = elements.text()
    return text[:: shape[0]][: shape[1]] if len(shape) == 2 and shape[0] > 1 else text


def _sparse(elements: _Elements, name: str, shape: tuple[int, ...], is_complex: bool) -> scipy.sparse.csc_matrix:
    rows, starts = (elements.numbers("indices").astype(np.int64) for _ in range(2))
    values: Any = elements.numbers()
    if is_complex:
        values = _complex(values, elements.numbers())
    if len(shape) != 2 or len(starts) != shape[1] + 1:
        raise ValueError(f"{name!r} announces {shape[1]} columns and has {len(starts) - 1}")
    count = int(starts[-1])
    if starts[0] != 0 or np.any(np.diff(starts) < 0) or count > min(len(rows), len(values)):
        raise ValueError(f"the columns of {name!r} do not rise from 0 to the number of its entries")
    rows, values = rows[:count], values[:count]
    if count and not (rows.min() >= 0 and rows.max() < shape[0]):
        raise ValueError(f"{name!r} names row {rows.max() + 1} of {shape[0]}")
    return scipy.sparse.csc_matrix((values.astype(complex if is_complex else float), rows, starts), shape=shape)


def _old(data: bytes) -> Iterator[tuple[str, Any]]:
    """Variables of a version 4 file: five whole numbers, the name, the real and the imaginary parts."""
    at = 0
    if not data:
        raise ValueError("is empty")
    while at < len(data):
        if at + 20 > len(data):
            raise ValueError(f"ends within a head at byte {at}")
        order = "<" if 0 <= struct.unpack_from("<i", data, at)[0] < 5000 else ">"
        code, rows, columns, imaginary, letters = struct.unpack_from(order + "5i", data, at)
        machine, rest = divmod(code, 1000)
        form, matrix = divmod(rest % 100, 10)
        if machine != (order == ">") or rest // 100 or form >= len(_OLD) or matrix > 2 or imaginary not in (0, 1):
            raise ValueError("is no MATLAB file of version 4 to 7")
        dtype = np.dtype(order + _OLD[form])
        size = rows * columns * dtype.itemsize
        if rows < 0 or columns < 0 or letters < 1 or at + 20 + letters + size * (1 + imaginary) > len(data):
            raise ValueError(f"the variable at byte {at} announces {rows} by {columns} values, and they do not follow")
        name = data[at + 20 : at + 20 + letters].split(b"\0")[0].decode("latin-1")
        at += 20 + letters
        parts = [np.frombuffer(data, dtype, rows * columns, at + k * size) for k in range(1 + imaginary)]
        at += size * (1 + imaginary)
        value: Any = _complex(*parts) if imaginary else parts[0].astype(float)
        value = value.reshape((rows, columns), order="F")
        if matrix == 1:
            yield name, "".join(chr(int(v) & 0xFF) for v in parts[0][: rows * columns : max(rows, 1)])
        else:
            yield name, _old_sparse(name, value) if matrix == 2 else value


def _old_sparse(name: str, value: np.ndarray) -> scipy.sparse.csc_matrix:
    """Rows, columns and values as columns of a matrix, the last row of which tells the shape."""
    if value.shape[1] not in (3, 4) or not len(value) or not np.all(np.isfinite(value)):
        raise ValueError(f"{name!r} is no sparse matrix")
    place = value[:, :2].real
    shape = int(place[-1, 0]), int(place[-1, 1])
    if not np.all((place[:-1] >= 1) & (place[:-1] <= shape)) or max(shape) * 32.0 > limit():
        raise ValueError(f"{name!r} has entries outside of {shape[0]} by {shape[1]}")
    numbers = value[:-1, 2] if value.shape[1] == 3 else _complex(value[:-1, 2], value[:-1, 3])
    at = place[:-1].astype(np.int64) - 1
    return scipy.sparse.csc_matrix(scipy.sparse.coo_matrix((numbers, (at[:, 0], at[:, 1])), shape=shape))
