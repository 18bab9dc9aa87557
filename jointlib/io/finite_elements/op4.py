"""Nastran OUTPUT4 files: matrices in text or binary, dense or in strings."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from jointlib.arrays import Array, ComplexArray
from jointlib.foreign.door import bytes_of
from jointlib.io.finite_elements.fortran import columns, fixed

_NEW_STRING = 65536


@dataclass
class _Matrix:
    """What is known of a matrix while its columns are read."""

    name: str
    rows: int
    cols: int
    kind: int
    """1 and 2 real, 3 and 4 complex; the even ones in double precision."""
    big: bool
    at: list[NDArray[np.intp]] = field(default_factory=list)
    column: list[int] = field(default_factory=list)
    values: list[Array | ComplexArray] = field(default_factory=list)

    @property
    def words(self) -> int:
        """Words per number; a complex value is two numbers."""
        return 2 if self.kind in (2, 4) else 1

    def add(self, column: int, row: int, numbers: Array) -> None:
        values = numbers[::2] + 1j * numbers[1::2] if self.kind > 2 else numbers
        if not (row >= 1 and row + len(values) - 1 <= self.rows):
            raise ValueError(f"matrix {self.name}: column {column} reaches row {row + len(values) - 1} of {self.rows}")
        self.at.append(row - 1 + np.arange(len(values)))
        self.column.append(column - 1)
        self.values.append(values)

    def matrix(self) -> scipy.sparse.csc_matrix:
        if not self.values:
            return scipy.sparse.csc_matrix((self.rows, self.cols))
        spread = np.repeat(self.column, [len(v) for v in self.values])
        data = (np.concatenate(self.values), (np.concatenate(self.at), spread))
        return scipy.sparse.csc_matrix(scipy.sparse.coo_matrix(data, shape=(self.rows, self.cols)))


def read_op4(path: Path) -> dict[str, scipy.sparse.csc_matrix]:
    """Every matrix of the file by name.

    The format is that of the OUTPUT4 module (MSC Nastran DMAP Programmer's Guide). A matrix begins with its number
    of columns, of rows (negative: BIGMAT), its form, its type and its name; then come the columns that are not null,
    each with its number, its first row and its count of words, and a last one beyond the matrix. A first row of 0
    means strings: a header word 65536·(words + 1) + row, or for BIGMAT the two words (words + 1) and row, and the
    values.
    """
    data = bytes_of(path, "a matrix")
    for order in "<>":
        if len(data) >= 4 and struct.unpack(order + "i", data[:4])[0] in (24, 48):
            return {m.name: m.matrix() for m in _binary(data, order)}
    return {m.name: m.matrix() for m in _text(data.decode("latin-1").splitlines())}


def _begun(cols: int, rows: int, kind: int, name: str) -> _Matrix:
    name = name.strip().upper()
    if kind not in (1, 2, 3, 4):
        raise ValueError(f"matrix {name} has type {kind}, expected 1 to 4")
    if cols < 1 or rows == 0:
        raise ValueError(f"matrix {name} announces {abs(rows)} rows and {cols} columns")
    return _Matrix(name, abs(rows), cols, kind, rows < 0)


def _text(lines: list[str]) -> Iterator[_Matrix]:
    at = 0
    while at < len(lines):
        head = lines[at]
        if not head.strip():
            at += 1
            continue
        try:
            cols, rows, _, kind = (int(head[i : i + 8]) for i in (0, 8, 16, 24))
            per_line, width = columns(head[40:].strip() or "5E16.9")
        except ValueError:
            raise ValueError(f"line {at + 1} is no header of an OUTPUT4 matrix") from None
        found = _begun(cols, rows, kind, head[32:40])
        at += 1
        while True:
            try:
                column, row, words = (int(lines[at][i : i + 8]) for i in (0, 8, 16))
            except (ValueError, IndexError):
                raise ValueError(f"line {at + 1} is no head of a column of matrix {found.name}") from None
            at += 1
            left = words
            while row == 0 and left > 0 and column <= cols:
                try:
                    numbers = [int(word) for word in lines[at].split()]
                    length, start = _string(numbers, found.big)
                except (ValueError, IndexError):
                    raise ValueError(f"line {at + 1} is no head of a string of matrix {found.name}") from None
                values, at = fixed(lines, at + 1, length // found.words, per_line, width)
                found.add(column, start, values)
                left -= length + len(numbers)
            if row or column > cols:
                values, at = fixed(lines, at, max(1, words // found.words), per_line, width)
                if column > cols:
                    break
                found.add(column, row, values)
        yield found


def _string(numbers: list[int], big: bool) -> tuple[int, int]:
    """Words in the string and its first row."""
    if big:
        length, row = numbers[0] - 1, numbers[1]
    else:
        length, row = numbers[0] // _NEW_STRING - 1, numbers[0] % _NEW_STRING
    if length < 0:
        raise ValueError
    return length, row


def _binary(data: bytes, order: str) -> Iterator[_Matrix]:
    at = 0
    while at < len(data):
        record, at = _record(data, at, order)
        wide = len(record) == 48
        integer, step = (order + "q", 8) if wide else (order + "i", 4)
        if len(record) not in (24, 48):
            raise ValueError(f"a record of {len(record)} bytes stands where a matrix should begin")
        cols, rows, _, kind = (struct.unpack_from(integer, record, i * step)[0] for i in range(4))
        found = _begun(cols, rows, kind, record[4 * step :].decode("latin-1")[: 2 * step].replace("\0", " "))
        number = np.dtype(order + ("f8" if wide or found.words == 2 else "f4"))
        words_each = number.itemsize // step
        while True:
            record, at = _record(data, at, order)
            if len(record) < 3 * step:
                raise ValueError(f"a column of matrix {found.name} has {len(record)} bytes")
            column, row, words = (struct.unpack_from(integer, record, i * step)[0] for i in range(3))
            if column > cols:
                break
            body = record[3 * step : 3 * step + words * step]
            if len(body) < words * step:
                raise ValueError(f"column {column} of matrix {found.name} is cut off")
            if row:
                found.add(column, row, np.frombuffer(body, number, words // words_each).astype(float))
                continue
            place, heads = 0, 2 if found.big else 1
            while place + heads * step <= len(body):
                header = [struct.unpack_from(integer, body, place + i * step)[0] for i in range(heads)]
                place += heads * step
                try:
                    length, start = _string(header, found.big)
                except ValueError:
                    raise ValueError(f"column {column} of matrix {found.name} has a broken string") from None
                if place + length * step > len(body):
                    raise ValueError(f"column {column} of matrix {found.name} is cut off")
                found.add(column, start, np.frombuffer(body, number, length // words_each, place).astype(float))
                place += length * step
        yield found


def _record(data: bytes, at: int, order: str) -> tuple[bytes, int]:
    """One Fortran record between its two length marks, and where the next begins."""
    if at + 4 > len(data):
        raise ValueError("ends within a matrix")
    (length,) = struct.unpack_from(order + "i", data, at)
    end = at + 4 + length
    if length < 0 or end + 4 > len(data) or struct.unpack_from(order + "i", data, end)[0] != length:
        raise ValueError(f"the record at byte {at} is broken")
    return data[at + 4 : end], end + 4
