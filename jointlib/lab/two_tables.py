"""Files that hold one table below another, which would be read as one or as the last alone."""

from __future__ import annotations

import re
from collections.abc import Sequence

_NUMBERS = re.compile(r"(?=[^\d]*\d)[\d\s.,;:|+\-eE'\"/]*[\d;,|\"]\s*")
_REMARKED = re.compile(rf"(?P<numbers>{_NUMBERS.pattern}?)[;,|\t]\s*(?:\"[^\"]*[^\W\d][^\"]*\"|[^\W\d][^;,|\t]*)")
_ROWS = 3
"""Rows of numbers that make a table; fewer may stand in the text above one."""


def tables(lines: Sequence[str]) -> list[tuple[int, int]]:
    """First and last line, counted from 1, of every block of rows that hold numbers alone.

    Empty lines belong to the block around them, and rows with a remark behind as many numbers as the row above has.
    """
    found: list[tuple[int, int]] = []
    first = last = rows = 0
    for i, line in enumerate(lines, 1):
        remarked = _REMARKED.fullmatch(line) if rows else None
        if _NUMBERS.fullmatch(line) or (remarked and _shape(remarked["numbers"]) == _shape(lines[last - 1])):
            first, last, rows = (first if rows else i), i, rows + 1
        elif line.strip():
            if rows >= _ROWS:
                found.append((first, last))
            rows = 0
    return [*found, (first, last)] if rows >= _ROWS else found


def _shape(row: str) -> list[str]:
    """What separates its numbers, behind which a remark may stand."""
    numbers = _REMARKED.fullmatch(row)
    return re.findall(r"[;,|\t]", (numbers["numbers"] if numbers else row).rstrip(" ;,|\t"))


def in_several(lines: Sequence[str], begin: int | None = None) -> str | None:
    """What is wrong with a text that holds several tables; None where it holds one or none.

    ``begin``: the line, counted from 0, where the table that is read begins; the others stand above it.
    """
    found = tables(lines[:begin])
    if begin is not None and found:
        found.append((begin + 1, len(lines) - (not lines[-1])))
    if len(found) < 2:
        return None
    first, second = found[:2]
    return (
        f"lines {first[0]} to {first[1]} and {second[0]} to {second[1]} are tables of their own"
        f"{f', {len(found)} in all' if len(found) > 2 else ''}, expected one a file: cut it in {len(found)}"
    )
