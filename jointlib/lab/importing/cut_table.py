"""A shop's table of test cuts, a row each, in the words of its headings."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from jointlib.errors import InputError
from jointlib.lab.dialect import Told
from jointlib.lab.encoding import text_of
from jointlib.lab.importing.cut_words import VERDICT_WORDS, column_of, plain_word, unit_in, verdict_of
from jointlib.lab.numerals import EVERY, LOOSE, Numerals
from jointlib.lab.open_file import TEXT

_MARKS = ";\t|,"
_ABOVE = 30
"""Lines among which the headings are looked for."""
_NUMBERS = ("speed", "depth", "immersion", "feed", "teeth", "diameter", "chatter_frequency")
NONE = {"", "-", "–", "—", "/", "?", "n/a", "na", "nan", "k.a.", "none", "keine", "aucune"}
"""Cells that hold nothing."""


@dataclass(frozen=True)
class Column:
    """A column that is used: its place, what its heading says and the unit in it."""

    place: int
    heading: str
    unit: str


@dataclass(frozen=True)
class CutRow:
    """One row: numbers as they stand, by key, and words."""

    line: int
    numbers: Mapping[str, float]
    words: Mapping[str, str]


@dataclass(frozen=True)
class CutTable:
    """The rows of a table of cuts."""

    path: Path
    columns: Mapping[str, Column]
    rows: tuple[CutRow, ...]
    left_out: tuple[str, ...]
    """Headings that say nothing of a cut."""
    numerals: Numerals


def cut_tables(paths: Sequence[Path], told: Told) -> list[CutTable]:
    """The files as tables of cuts, all of them or none."""
    if not all(path.suffix.lower().lstrip(".") in TEXT for path in paths):
        return []
    tables = [table for path in paths if (table := cut_table(path, told)) is not None]
    return tables if len(tables) == len(paths) else []


def cut_table(path: Path, told: Told) -> CutTable | None:
    """The table of cuts in a text file; None where no headings name a speed and a depth beside a verdict or a record.

    Raises `InputError` where numbers can be read in two ways.
    """
    text, _ = text_of(path, told.encoding)
    lines = [(i, line) for i, line in enumerate(text.split("\n"), 1) if line.strip() and line.lstrip()[0] != "#"]
    for mark in told.separator or _MARKS:
        cells = [(i, [cell.strip() for cell in next(csv.reader([line], delimiter=mark))]) for i, line in lines]
        for at, (_, names) in enumerate(cells[:_ABOVE]):
            columns = _columns(names)
            if {"speed", "depth"} <= set(columns) and {"verdict", "file"} & set(columns):
                return _made(path, names, columns, cells[at + 1 :], told)
    return None


def _columns(names: Sequence[str]) -> dict[str, Column]:
    found: dict[str, Column] = {}
    for place, name in enumerate(names):
        key = column_of(name)
        if key == "feed" and unit_in(name).casefold() in ("hz", "khz"):
            key = "chatter_frequency"  # f [Hz]
        if key is not None and key not in found:
            found[key] = Column(place, name, unit_in(name))
    return found


def _made(
    path: Path, names: Sequence[str], columns: dict[str, Column], below: Sequence[tuple[int, list[str]]], told: Told
) -> CutTable:
    def cell(row: Sequence[str], key: str) -> str:
        return row[columns[key].place] if key in columns and columns[key].place < len(row) else ""

    said = {key: unit_in(f"[{cell(below[0][1], key).strip('[]() ')}]") for key in columns} if below else {}
    if any(said.values()) and _all_words(below[0][1]):
        below = below[1:]
        columns = {key: replace(c, unit=c.unit or said[key]) for key, c in columns.items()}
    numbers = [key for key in _NUMBERS if key in columns]
    written = {key: [(i, cell(row, key)) for i, row in below if _holds(cell(row, key))] for key in numbers}
    numerals = _numerals(path, columns, written, told)
    fits, rows = numerals.pattern.fullmatch, []
    for i, row in below:
        held = {key: cell(row, key) for key in numbers if _holds(cell(row, key))}
        wrong = next((key for key, text in held.items() if not fits(text)), None)
        if wrong is not None:
            raise InputError(
                f"{path}: line {i}: {columns[wrong].heading!r} is {held[wrong]!r}, expected a number ({numerals.words})"
            )
        words = {key: cell(row, key) for key in columns if key not in _NUMBERS}
        if held or any(words.values()):
            rows.append(CutRow(i, {key: numerals.value(text) for key, text in held.items()}, words))
    if not rows:
        raise InputError(f"{path}: no row below the headings, expected a cut in each")
    used = {column.place for column in columns.values()}
    left = tuple(name for place, name in enumerate(names) if place not in used and name)
    return CutTable(path, columns, tuple(rows), left, numerals)


def _holds(cell: str) -> bool:
    return cell.casefold() not in NONE


def _all_words(row: Sequence[str]) -> bool:
    return not any(re.fullmatch(r"[\d.,]+", cell) for cell in row)


def _numerals(
    path: Path, columns: Mapping[str, Column], written: Mapping[str, list[tuple[int, str]]], told: Told
) -> Numerals:
    """The one way in which all numbers can be read."""
    ways = [n for n in EVERY if told.decimal in (None, n.decimal) and told.thousands in (None, n.thousands)]
    texts = [(key, i, text) for key, cells in written.items() for i, text in cells if LOOSE.fullmatch(text)]
    fit = [n for n in ways if all(n.pattern.fullmatch(text) for _, _, text in texts)]
    if not fit:
        return ways[0] if ways else Numerals()
    for key, i, text in texts:
        values = {n.value(text): n for n in reversed(fit)}
        if len(values) > 1:
            said = " or ".join(f"{value:g} ({n.words})" for value, n in sorted(values.items()))
            raise InputError(
                f"{path}: line {i}: {columns[key].heading!r} is {text!r}, which is {said}, expected --set "
                "text.decimal=',' or '.'"
            )
    return fit[0]


def verdicts(table: CutTable, told: Mapping[str, str]) -> list[str | None]:
    """The verdict of every row, None where it has none, by the words of ``told`` before those that are known."""
    if "verdict" not in table.columns:
        return [None] * len(table.rows)
    column = table.columns["verdict"]
    given = {plain_word(word): verdict for word, verdict in told.items()}
    found: list[str | None] = []
    for row in table.rows:
        word = row.words["verdict"]
        verdict = given.get(plain_word(word)) or verdict_of(word, column.heading)
        if verdict is None and _holds(word):
            some = ", ".join(f"{v} ({', '.join(list(words)[:4])})" for v, words in VERDICT_WORDS.items())
            raise InputError(
                f"{table.path}: line {row.line}: {column.heading!r} is {word!r}, expected {some}, or "
                f"--set verdict.{word.replace(' ', '_')}=chatter to say what it means"
            )
        found.append(verdict)
    return found
