"""Where things stand in a TOML document: the line of every key, and of what a sentence about the document speaks of."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Place = tuple[str | int, ...]
"""Keys and numbers of entries from the top of a document."""
_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY = re.compile(r"[ \t]*(?:\"((?:[^\"\\]|\\.)*)\"|'([^']*)'|([\w-]+))[ \t]*")
_STRING = re.compile(r'"""(?:[^\\]|\\.)*?"""+|\'\'\'.*?\'\'\'+|"(?:[^"\\]|\\.)*"|\'[^\']*\'', re.DOTALL)
_BARE = re.compile(r"[^,\]}\n#]*")
_TABLES = re.compile(r"\[\[([\w.-]+)\]\](?: (\d+))?(?: \((.*?)\))?(?:: |$)")
_TABLE = re.compile(r"\[([\w.-]+)\](?:: |$)")
_NAMED = re.compile(r"(?:\w+ )?([a-z]+)s? ('[^']*')[: ]")
_CHANNEL = re.compile(r"(channel) (\S+): ")
_WORD = re.compile(r"'([^']*)'|\"([^\"]*)\"|([A-Za-z_][\w-]*)((?:\[\d+\])*)")
_WIDEST = 72
_MADE_OF = {"connection": ("bundle",)}
"""Tables that become others of which a message speaks."""


@dataclass(frozen=True)
class TomlLines:
    """The lines of a document that `tomllib` has read without complaint."""

    text: str

    @cached_property
    def table(self) -> dict[str, Any]:
        """What stands in it."""
        return tomllib.loads(self.text)

    @cached_property
    def lines(self) -> dict[Place, int]:
        """Line, counted from 1, of every key, table and entry of a list."""
        return _Reading(self.text.replace("\r\n", "\n")).document()

    def line(self, said: str) -> int:
        """The line, from 1, that a sentence, its file left out, speaks of; 0 where it is of the whole."""
        return self.lines.get(self.place(said), 0)

    def place(self, said: str) -> Place:
        """What a sentence speaks of: it begins with tables and keys, as `jointlib.io.toml.Section` words them."""
        place: Place = ()
        table: Any = self.table
        while isinstance(table, dict):
            found = self._inside(table, said)
            if found is None:
                break
            step, said = found
            place += step
            table = _at(table, step)
        return place + (_mentioned(table, said) if isinstance(table, dict) else ())

    def _inside(self, table: dict[str, Any], said: str) -> tuple[Place, str] | None:
        """The table or key that a sentence begins with, and the rest of it."""
        if match := _TABLES.match(said):
            key = match[1].rpartition(".")[2]
            rows = _tables(table, key)
            if match[2] and int(match[2]) <= len(rows):
                return (key, int(match[2]) - 1), said[match.end() :]
            named = [i for i, row in enumerate(rows) if str(row.get("name")) == match[3]]
            return ((key, named[-1]), said[match.end() :]) if named else None
        if match := _TABLE.match(said):
            steps = tuple(match[1].split("."))
            if isinstance(_at(table, steps), dict):
                return steps, said[match.end() :]
        if (match := _NAMED.match(said)) and (match[1] in _MADE_OF or _tables(table, match[1])):
            names = re.findall(r"'([^']*)'", said)[:2] if said.startswith(f"{match[1]}s ") else [match[2][1:-1]]
            found = _named(table, match[1], names)
            return (found, said[match.end() :]) if found else ((), "")
        if match := _CHANNEL.match(said):
            rows = _tables(table, match[1])
            named = [i for i, row in enumerate(rows) if row.get("name") == match[2]]
            return ((match[1], named[-1]), said[match.end() :]) if named else None
        key, colon, rest = said.partition(": ")
        return ((key,), rest) if colon and isinstance(table.get(key), dict) else None


def shown(text: str, number: int) -> str:
    """A line as a message tells it."""
    line = text.splitlines()[number - 1].strip() if 0 < number <= len(text.splitlines()) else ""
    line = "".join(c if c.isprintable() else "?" for c in line)
    return f"(line {number}: {line if len(line) <= _WIDEST else line[: _WIDEST - 1] + '…'})"


def _mentioned(table: dict[str, Any], said: str) -> Place:
    """The key of a table that the sentence names first, or the entry that it quotes."""
    words = [(m[1] or m[2] or "", m[3] or m[1] or m[2] or "", m[4] or "") for m in _WORD.finditer(said)]
    for _, word, entries in words:
        if word in table:
            return _existing(table, (word, *(int(n) for n in re.findall(r"\d+", entries))))
    quoted = {text for text, _, _ in words if text}
    return next((place for place, value in _strings(table, ()) if value in quoted and place[-1] != "name"), ())


def _existing(table: Any, place: Place) -> Place:
    for i, step in enumerate(place):
        fits = isinstance(table, dict) if isinstance(step, str) else isinstance(table, list) and step < len(table)
        if not fits:
            return place[:i]
        table = table[step]
    return place


def _strings(value: Any, place: Place) -> Iterable[tuple[Place, str]]:
    if isinstance(value, str):
        yield place, value
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from _strings(inner, (*place, key))


def _tables(table: dict[str, Any], key: str) -> list[dict[str, Any]]:
    rows = table.get(key)
    return rows if isinstance(rows, list) and all(isinstance(row, dict) for row in rows) else []


def _named(table: dict[str, Any], kind: str, names: Sequence[str]) -> Place:
    """The last table of one of these names, the last name first; else the one that it was made of.

    A bundle ``guide`` becomes the connections ``guide.n1``, one with several places ``guide_2.n1``.
    """
    for name in reversed(names):
        whole = name.rpartition(".")[0]
        for key in (kind, *_MADE_OF.get(kind, ())):
            for wanted in (name, whole, re.sub(r"_\d+$", "", whole)):
                found = [i for i, row in enumerate(_tables(table, key)) if wanted and row.get("name") == wanted]
                if found:
                    return key, found[-1]
    return ()


def _at(table: Any, place: Place) -> Any:
    """What stands at a place; None where there is nothing."""
    for step in place:
        if isinstance(table, dict):
            table = table.get(str(step))
        else:
            table = table[step] if isinstance(table, list) and isinstance(step, int) else None
    return table


class _Reading:
    """One pass over a document; what is not valid has been refused before."""

    def __init__(self, text: str) -> None:
        self._text, self._at = text, 0
        self._found: dict[Place, int] = {}
        self._counts: dict[Place, int] = {}

    def document(self) -> dict[Place, int]:
        top: Place = ()
        self._skip()
        while self._at < len(self._text):
            if self._text[self._at] == "[":
                top = self._header()
            else:
                self._pair(top)
            self._skip()
        return self._found

    def _skip(self) -> None:
        match = _BLANK.match(self._text, self._at)
        self._at = match.end() if match else self._at

    def _note(self, place: Place) -> None:
        self._found.setdefault(place, self._text.count("\n", 0, self._at) + 1)

    def _keys(self) -> list[str]:
        keys = []
        while match := _KEY.match(self._text, self._at):
            keys.append(next(part for part in match.groups() if part is not None))
            self._at = match.end()
            if self._text[self._at : self._at + 1] != ".":
                break
            self._at += 1
        return keys

    def _header(self) -> Place:
        begun, several = self._at, self._text.startswith("[[", self._at)
        self._at += 2 if several else 1
        *above, last = self._keys()
        end = self._at + (2 if several else 1)
        place: Place = ()
        for key in above:
            place += (key,)
            if place in self._counts:
                place += (self._counts[place] - 1,)
        place += (last,)
        self._at = begun
        for i in range(1, len(place)):
            self._note(place[:i])
        if several:
            self._counts[place] = self._counts.get(place, 0) + 1
            self._note(place)
            place += (self._counts[place] - 1,)
        self._note(place)
        self._at = end
        return place

    def _pair(self, top: Place) -> None:
        begun, keys = self._at, self._keys()
        end, self._at = self._at, begun
        for i in range(len(keys)):
            self._note((*top, *keys[: i + 1]))
        self._at = end + 1  # the sign =
        self._skip()
        self._value((*top, *keys))

    def _value(self, place: Place) -> None:
        opening = self._text[self._at : self._at + 1]
        if opening in ("[", "{"):
            self._several(place, opening == "[")
            return
        match = _STRING.match(self._text, self._at) or _BARE.match(self._text, self._at)
        self._at = match.end() if match else len(self._text)

    def _several(self, place: Place, listed: bool) -> None:
        """A list, or a table in a line."""
        self._at += 1
        number = 0
        self._skip()
        while self._at < len(self._text) and self._text[self._at] not in "]}":
            if listed:
                self._note((*place, number))
                self._value((*place, number))
                number += 1
            else:
                self._pair(place)
            self._skip()
            if self._text[self._at : self._at + 1] == ",":
                self._at += 1
            self._skip()
        self._at += 1
