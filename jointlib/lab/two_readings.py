"""The sentence on a table that can be read in two ways: both readings of one row, and how to say which is meant."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.lab.dialect import Reading
from jointlib.lab.numerals import Numerals
from jointlib.lab.separator import TOLD

_CELLS = 6


def in_two_ways(readings: Sequence[Reading], line: str, number: int) -> str:
    """Line, readings in words with their numbers, and the keys that decide between them."""
    said = "; or ".join(f"as {_numbers(r, line)} ({_words(r, readings)}: {_keys(r, readings)})" for r in readings[:3])
    row = line if len(line) <= 60 else f"{line[:57]}..."
    return f"line {number}, {row!r}, can be read in {'two' if len(readings) == 2 else 'several'} ways: {said}"


def _numbers(reading: Reading, line: str) -> str:
    cells = reading.row(line)
    fits, value = reading.numerals.pattern.fullmatch, reading.numerals.value
    told = [f"{value(cell):.10g}" if cell and fits(cell) else cell for cell in cells]
    return " and ".join(filter(None, [", ".join(told[:_CELLS]), "more" if len(told) > _CELLS else ""]))


def _words(reading: Reading, others: Sequence[Reading]) -> str:
    """What is unlike the other readings, in words."""
    if len({(r.separator.mark, r.separator.joined, r.count) for r in others}) == 1:
        return reading.numerals.words
    return "one column" if reading.count == 1 else f"{reading.separator.words} between {reading.count} columns"


def _keys(reading: Reading, others: Sequence[Reading]) -> str:
    """The keys of ``[text]`` that only this reading agrees with."""
    if reading.separator.joined is not None:
        return "write the table with another separator"
    if any(r.separator.joined is not None for r in others):
        return f'[text] separator = "{reading.separator.mark.replace(" ", "blank")}"'
    word = next(word for word, mark in TOLD.items() if mark == reading.separator.mark)
    keys = []
    if len({r.separator.mark for r in others}) > 1:
        keys.append(f'separator = "{word}"')
    numerals: Numerals = reading.numerals
    alike = [r for r in others if r is not reading and r.separator.mark == reading.separator.mark]
    if any(r.numerals.decimal != numerals.decimal for r in alike):
        keys.append(f'decimal = "{numerals.decimal}"')
    elif any(r.numerals.thousands != numerals.thousands for r in alike):
        keys.append(f'thousands = "{numerals.thousands}"')
    elif alike:
        keys.append(f'decimal = "{numerals.decimal}"')
    return "[text] " + " ".join(keys)
