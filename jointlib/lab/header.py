"""Names and units above the numbers of a text table."""

from __future__ import annotations

import re
from dataclasses import dataclass

from jointlib.lab.numerals import LOOSE
from jointlib.lab.separator import Separator
from jointlib.lab.unit_words import bracketed, is_unit, unit_of

_ABOVE = 8
_COMMENT = "#%/!;* "


@dataclass(frozen=True)
class Header:
    """Column names with the unit of each, empty where none is said; ``line`` counts from 0."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    line: int
    blank_names: bool = False


def header_above(lines: list[str], start: int, separator: Separator, count: int) -> Header | None:
    """The names directly above the first row of numbers; None where no row above has a name for each column.

    A row of units below the names is told by its words. Lines in another dialect than the numbers are tried too, and
    comment lines last.
    """
    above = [i for i in range(start - 1, max(-1, start - 1 - _ABOVE), -1) if lines[i].strip()]
    for strip in ("", _COMMENT):
        block: list[tuple[int, list[str]]] = []
        for i in above:
            cells = _cells(lines[i].strip("\n").lstrip(strip) if strip else lines[i], separator, count)
            if cells is None:
                break
            block.append((i, cells))
        found = _names(block)
        if found is not None:
            return found
    return None


def count_matches(lines: list[str], start: int, separator: Separator, count: int) -> bool:
    """Whether a row of names above, cut as the numbers are, has as many cells as they."""
    for i in range(start - 1, max(-1, start - 1 - _ABOVE), -1):
        line = lines[i].strip(" \r\n" if separator.mark == "\t" else None)
        if not line.strip():
            continue
        if not separator.mark or separator.pairs:
            found = len(Separator(",").cells(line)) if separator.pairs else 1 + bool(re.search(r"[;,\t|]", line))
        else:
            cells = _cells(line, separator, count, strictly=True)
            found = count if cells else 0
        return found == count and not LOOSE.fullmatch(line)
    return False


def _names(block: list[tuple[int, list[str]]]) -> Header | None:
    """Names and units from the rows above the numbers, the lowest first."""
    textual = [(i, cells) for i, cells in block if not any(LOOSE.fullmatch(c) for c in cells if c) and any(cells)]
    labelled = len(block) > 0 and len(block[0][1]) > 2  # as a row "sensor; 100; 10,2" below the names
    between = [row for row in block[: block.index(textual[0])] if row[1][0]] if textual else block
    if not textual or any(LOOSE.fullmatch(cells[0]) for _, cells in between) or (between and not labelled):
        return None
    units: list[str] | None = None
    chosen = textual[0]
    for k, (_, cells) in enumerate(textual[:-1]):
        if _mostly_units(cells):
            units, chosen = cells, textual[k + 1]
            break
    if units is None and len(textual) > 1 and all(unit_of(c) for c in textual[1][1]):
        units = textual[1][1]  # above the names
    line, names = chosen
    inside = [bracketed(name) for name in names]
    said = [bracketed(f"[{u.strip('[]() ')}]") if u else "" for u in units] if units else inside
    filled = tuple(name or f"column {k}" for k, name in enumerate(names, 1))
    return Header(filled, tuple(a or b for a, b in zip(said, inside, strict=True)), line, not all(names))


def _mostly_units(cells: list[str]) -> bool:
    """Whether a row is one of units: one among several that nobody knows makes it none of names."""
    said = [c for c in cells if c]
    known = sum(map(is_unit, said))
    return known > 0 and (known == len(said) or (known > 2 and known == len(said) - 1))


def _cells(line: str, separator: Separator, count: int, strictly: bool = False) -> list[str] | None:
    """A row cut into ``count`` cells, as the numbers are or in another way."""
    own = Separator(separator.mark, quoted=True) if separator.mark.strip() or separator.mark == "\t" else separator
    marked = next((mark for mark in "\t;|" if mark in line.strip()), None)
    if separator.mark == " " and marked:
        own = Separator(marked, quoted=True)
    ways = [own, *(Separator(m, quoted=True) for m in "\t;,|"), Separator(" ")]
    for way in ways:
        cells = [cell.strip().strip('"').strip() for cell in way.cells(line)]
        while len(cells) > count and not cells[-1]:
            cells.pop()
        if len(cells) == count:
            return cells
        if way is own and (strictly or (len(cells) > 1 and own.mark != " ")):
            return None
    if separator.mark != " ":
        return None
    wide = re.split(r"\s{2,}|\t", line.strip())
    if len(wide) == count:
        return wide
    joined = re.sub(r"\s+(?=[\[(])", "\0", line.strip()).split()
    return [cell.replace("\0", " ") for cell in joined] if len(joined) == count else None
