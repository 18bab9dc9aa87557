"""In which dialect a table of numbers is written, decided from all of its rows or refused with both readings."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from jointlib.errors import InputError
from jointlib.lab.clock import CLOCK, DATE
from jointlib.lab.header import count_matches
from jointlib.lab.numerals import BLANKS, EVERY, LOOSE, Numerals
from jointlib.lab.separator import Separator, candidates

_HEAD, _TAIL = 400, 60
_GLITCHES = 2
"""Rows of numbers that may still belong to the text before a table."""
_MOST = 0.5
"""Share of the lines of a file that are rows of its table."""
_OTHER_MARK = re.compile(r"\d[;,\t|]|[;,\t|]\d")


@dataclass(frozen=True)
class Told:
    """What is known of a dialect from elsewhere; None where nothing is."""

    separator: str | None = None
    decimal: str | None = None
    thousands: str | None = None
    encoding: str | None = None
    header: int | None = None
    """Line of the names, counted from 1; 0 where there are none."""


@dataclass(frozen=True)
class Reading:
    """One way to read a table: ``kinds`` says of every column "number", "clock", "text", "empty" or "mixed"."""

    separator: Separator
    numerals: Numerals
    start: int
    kinds: tuple[str, ...]
    named: bool
    """Whether the line above has a name for each column."""

    @property
    def count(self) -> int:
        return len(self.kinds)

    def row(self, line: str) -> list[str]:
        """The cells of a row; an empty one behind the last mark is none."""
        cells = self.separator.cells(line)
        while len(cells) > self.count and not cells[-1]:
            cells.pop()
        return cells


class Undecided(Exception):
    """Rows that were looked at do not tell which reading is right."""

    def __init__(self, readings: Sequence[Reading], line: int) -> None:
        super().__init__()
        self.readings, self.line = readings, line


def decide(lines: list[str], told: Told, begin: int = 0, every: bool = False) -> Reading:
    """The one way in which all rows of a table can be read; from line ``begin`` on.

    With ``every`` all rows are looked at, not a sample of them.

    Raises `Undecided` where several ways fit, and `InputError` (half a sentence) where none does.
    """
    looked_at = lines if every else [*lines[:_HEAD], *lines[-_TAIL:]]
    quoted = any('"' in line for line in looked_at)
    found: list[Reading] = []
    for separator in candidates(quoted, told.separator):
        found += _readings(lines, separator, told, begin, every)
    if not found:
        raise InputError("no row of numbers, expected columns of numbers under a header row")
    if every and len({r.separator for r in found}) > 1:
        found = [r for r in found if all(len(r.row(line)) <= r.count for line in lines[r.start :])] or found
    clean = [r for r in found if not {"text", "mixed"} & set(r.kinds)] or [r for r in found if "mixed" not in r.kinds]
    found = _by_header(clean or _least_mixed(found), told)
    sample = _sample(lines, min(r.start for r in found), every)
    distinct: dict[object, Reading] = {}
    for reading in found:
        distinct.setdefault(_values(reading, [lines[i] for i in sample[-_TAIL:]] if clean else []), reading)
    left = list(distinct.values()) if clean else found[:1]
    if len(left) > 1 and not every and len(lines) > len(sample):
        return decide(lines, told, begin, every=True)
    if len(left) > 1:
        raise Undecided(left, _first_difference(left, lines))
    other = in_two_meanings(left[0], [lines[i] for i in sample], told) if clean else None
    if other is not None:
        if not every and len(lines) > len(sample):
            return decide(lines, told, begin, every=True)
        raise Undecided((left[0], other), left[0].start)
    return left[0]


_WHOLE = re.compile(rf"[+-]?(?:\d+|[1-9]\d{{0,2}}(?:[.'{BLANKS}]\d{{3}})+)")
_DIGITS = re.compile(r"\d+(?:[eE][+-]?\d+)?")
_HEAD_GROUP, _GROUP = re.compile(r"[+-]?[1-9]\d{0,2}"), re.compile(r"\d{3}(?:[.,]\d*)?")
_PADDED = re.compile(r"0\d+(?:[eE][+-]?\d+)?")


def in_two_meanings(reading: Reading, lines: Sequence[str], told: Told) -> Reading | None:
    """Another reading, where commas or blanks between columns may as well stand inside the numbers of one.

    So it is where every row has a whole number that is followed by digits alone. Names above both speak against it,
    digits that begin with 0 for it.
    """
    mark = reading.separator.mark
    if reading.separator != Separator(mark) or mark not in (",", " ") or told.separator is not None:
        return None
    rows = [list(pairwise(reading.row(line))) for line in lines]
    padded = any(_WHOLE.fullmatch(a) and _PADDED.fullmatch(b) for row in rows for a, b in row)
    if mark == "," and told.decimal is None and (padded or not reading.named):
        found = [_first(row, _WHOLE, _DIGITS) for row in rows]
        numerals = next((n for n in EVERY if n.decimal == "," and _elsewhere(n, rows)), None)
        if None not in found and numerals is not None:
            return _joined(reading, found[0] or 0, numerals)
    found = [] if reading.named else [_first(row, _HEAD_GROUP, _GROUP) for row in rows]
    if found and None not in found:
        numerals = Numerals("." if mark == "," else reading.numerals.decimal, mark)
        return _joined(reading, found[0] or 0, numerals) if _elsewhere(numerals, rows) else None
    return None


def _elsewhere(numerals: Numerals, rows: Sequence[Sequence[tuple[str, str]]]) -> bool:
    """Whether each cell by itself may be a piece of a number that is written so."""
    fits = numerals.pattern.fullmatch
    pieces = {cell for row in rows for pair in row for cell in pair if cell}
    return all(fits(cell) or _GROUP.fullmatch(cell) or _DIGITS.fullmatch(cell) for cell in pieces)


def _first(row: Sequence[tuple[str, str]], one: re.Pattern[str], other: re.Pattern[str]) -> int | None:
    """Where in a row two neighbours are first of these forms."""
    return next((j for j, (a, b) in enumerate(row) if one.fullmatch(a) and other.fullmatch(b)), None)


def _joined(reading: Reading, j: int, numerals: Numerals) -> Reading:
    kinds = reading.kinds[:j] + reading.kinds[j + 1 :]
    return Reading(Separator(reading.separator.mark, joined=j), numerals, reading.start, kinds, False)


def _by_header(found: list[Reading], told: Told) -> list[Reading]:
    """Those that the row of names agrees with; one name for one column, or commas in two meanings, prove nothing."""
    named = [r for r in found if r.named and r.separator.mark and not r.separator.pairs]
    if not named and told.separator is not None:
        named = [r for r in found if r.named]
    return named or found


def _least_mixed(found: list[Reading]) -> list[Reading]:
    fewest = min(r.kinds.count("mixed") / r.count for r in found)
    return [r for r in found if r.kinds.count("mixed") / r.count == fewest]


def _readings(lines: list[str], separator: Separator, told: Told, begin: int, every: bool) -> list[Reading]:
    place = _block(lines, separator, begin, every)
    if place is None:
        return []
    start, count = place
    rows = [separator.cells(lines[i])[:count] for i in _sample(lines, start, every)]
    rows = [row for row in rows if len(row) == count]
    columns = list(zip(*rows, strict=True))
    named = told.header != 0 and count_matches(lines, start, separator, count)
    loose = [_loose_kind(column) for column in columns]
    if any(k == "text" and any(_OTHER_MARK.search(c) for c in col) for k, col in zip(loose, columns, strict=True)):
        return []
    out = []
    for numerals in EVERY:
        if not separator.allows(numerals):
            continue
        if told.decimal not in (None, numerals.decimal) or told.thousands not in (None, numerals.thousands):
            continue
        fits = numerals.pattern.fullmatch
        if separator.pairs and not all("," in cell for row in rows for cell in row):
            continue
        kinds = tuple(
            "mixed" if kind == "number" and not all(fits(c) for c in column if c) else kind
            for kind, column in zip(loose, columns, strict=True)
        )
        if "number" in kinds:
            out.append(Reading(separator, numerals, start, kinds, named))
    return out


def _loose_kind(column: Sequence[str]) -> str:
    filled = [cell for cell in column if cell]
    if not filled:
        return "empty"
    if all(CLOCK.fullmatch(cell) for cell in filled):
        return "clock"
    if all(DATE.fullmatch(cell) for cell in filled):
        return "text"
    return "number" if sum(bool(LOOSE.fullmatch(cell)) for cell in filled) > 0 else "text"


def _block(lines: list[str], separator: Separator, begin: int, every: bool) -> tuple[int, int] | None:
    """First row of the numbers and how many cells each has."""
    last = _model(lines, separator)
    if _named_behind(lines, separator, len(last)) or (every and _remarked(lines[begin:], separator, len(last))):
        last = [*last, ""]
    places = [i for i, cell in enumerate(last) if LOOSE.fullmatch(cell) and not DATE.fullmatch(cell)]
    if not places or (separator.mark and len(last) < 2):
        return None
    start = seen = -1
    run = 0
    for i, line in enumerate(lines[begin : begin + _HEAD], begin):
        cells = separator.cells(line)
        cells = cells[: len(last)] if len(cells) == len(last) + 1 and not cells[-1] else cells
        alike = [cells[k] for k in places] if len(cells) == len(last) else []
        if alike and all(LOOSE.fullmatch(cell) or not cell for cell in alike) and any(alike):
            start, run = (i, 1) if start < 0 else (start, run + 1)
        elif start >= 0 and run <= _GLITCHES and not any(LOOSE.fullmatch(cell) for cell in cells if cell):
            start, run = -1, 0
        seen = i
    if start < 0 and seen < len(lines) - 1:
        return None
    return (start, len(last)) if start >= 0 else None


def _named_behind(lines: list[str], separator: Separator, count: int) -> bool:
    """Whether a row of names has one more than the rows below it have values, which all end with a mark."""
    if not separator.mark or separator.pairs or any(separator.cells(x)[count:] != [""] for x in lines[-_TAIL:][-2:]):
        return False
    rows = (separator.cells(line) for line in lines[:_TAIL])
    return any(len(row) == count + 1 and all(row) and not any(map(LOOSE.fullmatch, row)) for row in rows)


def _remarked(lines: list[str], separator: Separator, count: int) -> bool:
    """Whether a column of remarks stands behind the last mark, which few rows have: "knocked", "stop"."""
    if not separator.mark or separator.pairs:
        return False
    wide = [cells for line in lines if len(cells := separator.cells(line)) == count + 1]
    said = sum(bool(cells[-1]) and LOOSE.fullmatch(cells[-1]) is None for cells in wide)
    return 0 < said < len(wide) and len(wide) > _MOST * len(lines)


def _model(lines: list[str], separator: Separator) -> list[str]:
    """The cells of the last row, or of the one before it where the last one was cut off."""
    rows = [separator.cells(line) for line in lines[-_TAIL:]]
    if all(len(row) > 1 and not row[-1] for row in rows[-2:]):
        rows = [row[:-1] if not row[-1] else row for row in rows]
    *above, last = rows
    cut = len(above) > 1 and len(last) < len(above[-1]) == len(above[-2])
    return above[-1] if cut and any(LOOSE.fullmatch(cell) for cell in above[-1]) else last


def _sample(lines: list[str], start: int, every: bool) -> list[int]:
    if every or len(lines) - start <= _HEAD + _TAIL:
        return list(range(start, len(lines)))
    return [*range(start, start + _HEAD), *range(len(lines) - _TAIL, len(lines))]


def _values(reading: Reading, lines: list[str]) -> object:
    """What a reading makes of rows; equal where two readings differ in words, or in empty cells at the ends, alone."""
    fits = reading.numerals.pattern.fullmatch
    rows = []
    for line in lines:
        cells = reading.row(line)
        row = [reading.numerals.value(c) if c and fits(c) else c for c in cells]
        while row and row[-1] == "":
            row.pop()
        rows.append(tuple(None if v != v else v for v in row))
    return tuple(rows)


def _first_difference(readings: Sequence[Reading], lines: list[str]) -> int:
    first = max(r.start for r in readings)
    for i in range(first, len(lines)):
        if len({_values(r, [lines[i]]) for r in readings}) == len(readings):
            return i
    return first
