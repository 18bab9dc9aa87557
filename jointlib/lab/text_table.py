"""Tables of numbers as text: what every program and logger can write, in the dialect of each."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.lab.clock import DATE, seconds
from jointlib.lab.dialect import Reading, Told, Undecided, decide
from jointlib.lab.encoding import text_of
from jointlib.lab.header import Header, header_above
from jointlib.lab.numerals import LOOSE
from jointlib.lab.two_readings import in_two_ways
from jointlib.lab.two_tables import in_several

_SHOWN = 60


@dataclass(frozen=True, eq=False)
class TextTable:
    """Columns of numbers, one array each, and what stands above them."""

    names: tuple[str, ...]
    """Headings of the columns that hold numbers or clock times; ``column 1`` and so on where the file has none."""
    units: tuple[str, ...]
    """As the file says them, empty where it says none."""
    columns: tuple[Array, ...]
    """Clock times in seconds since the first row; nan where a cell is empty."""
    clocks: tuple[str, ...]
    """Headings of the columns of clock times."""
    left_out: tuple[str, ...]
    """Headings of the columns of text, and of those without any value."""
    above: tuple[str, ...]
    """Lines before the names."""
    named: bool
    """Whether the file has names for its columns."""
    encoding: str
    reading: Reading

    @property
    def dialect(self) -> Told:
        """How the file is read, so that it is read in the same way again."""
        r = self.reading
        header = None if self.named else 0
        return Told(r.separator.mark, r.numerals.decimal, r.numerals.thousands, self.encoding, header)


def read_table(path: Path, told: Told | None = None) -> TextTable:
    """The table of numbers in a text file.

    Separator (comma, semicolon, tab, bar, blanks), decimal mark, marks between thousands, text above the names, units
    in brackets or in a row of their own, comment lines that begin with #, encodings: as found. What can be read in two
    ways is refused with both; ``told`` says which.
    """
    text, encoding = text_of(path, None if told is None else told.encoding)
    return table_of(path, text, encoding, told or Told())


def table_of(path: Path, text: str, encoding: str, told: Told) -> TextTable:
    """The table in a text that has been read from ``path``."""
    return _Rows(path, text, encoding, told).table()


class _Rows:
    """The lines of a file without blank ones and comments, on their way into a `TextTable`."""

    def __init__(self, path: Path, text: str, encoding: str, told: Told) -> None:
        self._path, self._encoding = path, encoding
        self._all = text.split("\n")
        if (match := re.fullmatch(r"sep=(.)", self._all[0].strip().strip('"'))) is not None:
            told = told if told.separator is not None else replace(told, separator=match[1])
            self._all[0] = ""
        kept = [i for i, line in enumerate(self._all) if line and not line.isspace() and line.lstrip()[0] != "#"]
        self._numbers: Sequence[int] = range(len(kept)) if len(kept) == len(self._all) else kept
        self._lines = self._all if len(kept) == len(self._all) else [self._all[i] for i in kept]
        below = 0 if not told.header else bisect_right(self._numbers, told.header - 1)
        self._told, self._below = told, below
        if not self._lines:
            raise InputError(f"{path}: empty, expected a header row and columns of numbers")

    def table(self) -> TextTable:
        reading = self._decided(every=False)
        if self._fill_up(reading):
            reading = self._decided(every=True)
        read = self._at_once(reading)
        if read is None:
            reading = self._decided(every=True)
            read = self._cell_by_cell(reading)
        return self._made(reading, read)

    def _decided(self, every: bool) -> Reading:
        try:
            return decide(self._lines, self._told, self._below, every)
        except Undecided as two:
            line = self._lines[two.line].strip()
            raise InputError(f"{self._path}: {in_two_ways(two.readings, line, self._number(two.line))}") from None
        except InputError as error:
            said = "has a header but no samples" if len(self._lines) == 1 else in_several(self._all) or error
            raise InputError(f"{self._path}: {said}") from None

    def _fill_up(self, reading: Reading) -> bool:
        """Give every row the cell of remarks that some rows have below a last name; what it holds is left out."""
        count, start, lines = reading.count, reading.start, self._lines
        separator = replace(reading.separator, quoted=reading.separator.quoted or any('"' in line for line in lines))
        if len(separator.mark.strip(" ")) != 1 or not start or len(separator.cells(lines[start - 1])) != count + 1:
            return False
        cells = [separator.cells(line) for line in lines[start:]]
        behind = ["".join(row[count:]) for row in cells]
        if not any(behind) or not all(count <= len(row) <= count + 1 for row in cells):
            return False
        if not all(re.search(r"[^\W\d_]", text) for text in behind if text):
            return False
        rows = ([*row[:count], "remark" if text else ""] for row, text in zip(cells, behind, strict=True))
        self._lines = [*lines[:start], *map(separator.mark.join, rows)]
        return True

    def _at_once(self, reading: Reading) -> list[Array] | None:
        """The columns of numbers; None where a row is not plainly as those that were looked at."""
        separator, numerals = reading.separator, reading.numerals
        plain = not (separator.quoted or separator.pairs or separator.spaced or numerals.thousands)
        if not plain or set(reading.kinds) - {"number"}:
            return None
        rows = self._lines[reading.start :]
        if numerals.decimal != ".":
            text = "\n".join(rows)
            if "." in text:
                return None
            rows = numerals.plain(text).split("\n")
        mark = separator.mark.strip(" ")
        if mark and rows[0].rstrip(" ").endswith(mark):
            rows = [row.rstrip(" ") for row in rows]
            if not all(row.endswith(mark) for row in rows):
                return None
            rows = [row[:-1] for row in rows]
        try:
            table = np.loadtxt(rows, delimiter=mark or None, ndmin=2, comments=None)
        except ValueError:
            return None
        return [table[:, i] for i in range(reading.count)] if table.shape[1] == reading.count else None

    def _cell_by_cell(self, reading: Reading) -> list[Array]:
        fits, value = reading.numerals.pattern.fullmatch, reading.numerals.value
        wanted = [k for k, kind in enumerate(reading.kinds) if kind in ("number", "mixed")]
        clocks = [k for k, kind in enumerate(reading.kinds) if kind == "clock"]
        rows = self._lines[reading.start :]
        numbers = np.full((len(wanted), len(rows)), np.nan)
        times: dict[int, list[str]] = {k: [] for k in clocks}
        for i, line in enumerate(rows):
            cells = reading.row(line)
            if len(cells) != reading.count:
                self._refuse(reading, i)
            for at, k in enumerate(wanted):
                cell = cells[k]
                if cell:
                    if not fits(cell):
                        self._refuse(reading, i)
                    numbers[at, i] = value(cell)
            for k in clocks:
                times[k].append(cells[k])
        found = dict(zip(wanted, numbers, strict=True))
        for k in clocks:
            elapsed = seconds(times[k])
            if elapsed is None:
                raise InputError(f"{self._path}: column {k + 1} holds dates whose order cannot be told")
            found[k] = elapsed
        return [found[k] for k in sorted(found)]

    def _refuse(self, reading: Reading, row: int) -> NoReturn:
        if (several := in_several(self._all)) is not None:
            raise InputError(f"{self._path}: {several}")
        at = reading.start + row
        line = self._lines[at].strip()
        shown = line if len(line) < _SHOWN else f"{line[: _SHOWN - 3].strip()}..."
        expected = f"{reading.count} numbers a row" if "text" not in reading.kinds else f"{reading.count} cells a row"
        raise InputError(f"{self._path}: line {self._number(at)} is {shown!r}, expected {expected}")

    def _number(self, index: int) -> int:
        return self._numbers[index] + 1

    def _made(self, reading: Reading, columns: list[Array]) -> TextTable:
        self._refuse_row_above(reading)
        header, first = self._header(reading)
        if not self._told.header and (several := in_several(self._all, first)) is not None:
            raise InputError(f"{self._path}: {several}")
        every = header.names if header else tuple(f"column {k}" for k in range(1, reading.count + 1))
        units = header.units if header else ("",) * reading.count
        used = [k for k, kind in enumerate(reading.kinds) if kind not in ("text", "empty")]
        return TextTable(
            names=tuple(every[k] for k in used),
            units=tuple(units[k] for k in used),
            columns=tuple(np.ascontiguousarray(column) for column in columns),
            clocks=tuple(every[k] for k in used if reading.kinds[k] == "clock"),
            left_out=tuple(name for k, name in enumerate(every) if k not in used),
            above=tuple(line for line in self._all[:first] if line.strip()),
            named=header is not None,
            encoding=self._encoding,
            reading=reading,
        )

    def _header(self, reading: Reading) -> tuple[Header | None, int]:
        """The names, and the line where the text above them ends."""
        start = self._number(reading.start) - 1
        if self._told.header == 0:
            return None, start
        if self._told.header:
            header = header_above(self._all[: self._told.header], self._told.header, reading.separator, reading.count)
        else:
            header = header_above(self._all, start, reading.separator, reading.count)
        if header is None:
            self._refuse_names(reading)
        return header, header.line if header else start

    def _refuse_row_above(self, reading: Reading) -> None:
        """Refuse a row of numbers above the first one that is unlike it, and would be lost."""
        above = self._lines[reading.start - 1] if reading.start > self._below else ""
        first = reading.separator.cells(above)[0] if above else ""
        if LOOSE.fullmatch(first) and not DATE.fullmatch(first):
            self._refuse(reading, -1)

    def _refuse_names(self, reading: Reading) -> None:
        """Refuse a row above the numbers that seems to name columns, but not as many as there are."""
        above = self._lines[reading.start - 1] if reading.start > self._below or self._told.header else ""
        cells = reading.separator.cells(above)
        if self._told.header or (len(cells) > 1 and not any(LOOSE.fullmatch(cell) for cell in cells if cell)):
            raise InputError(
                f"{self._path}: line {self._number(reading.start - 1)} has {len(cells)} names and the rows below it "
                f"{reading.count} cells, expected a name for each (or [text] header = 0: there are no names)"
            )
