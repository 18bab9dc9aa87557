"""TOML documents read key by key: units, nearest names for typos, one sentence for each thing that is wrong."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from jointlib.errors import InputError, nearest
from jointlib.io.atomic import no_name
from jointlib.io.likeness import Doubtful, likeness
from jointlib.io.mistakes import Absent, Lost, Mistakes, shortened
from jointlib.meanings import meant, not_covered
from jointlib.units import quantity, scale

T = TypeVar("T")
_NUMBER = (0.5, 0.25)  # stands in for a number that cannot be read
_WORD = ("unknown", "unknown_too", "unknown_three")
MOST = 10**12  # what is counted is no more than that


class Section:
    """One table of a document; every key is taken once and :meth:`done` refuses what is left.

    ``where`` starts every message: the file, then the path of keys. With ``mistakes`` a fault is noted there, something
    stands in for the value and the reading goes on; without, it is raised.
    """

    def __init__(self, table: dict[str, Any], where: str, folder: Path, mistakes: Mistakes | None = None) -> None:
        self.where = where
        self.folder = folder
        self.mistakes = mistakes
        self.table = table
        self._left = dict(table)
        self.counted: dict[str, list[int]] = {}  # numbers of the tables [[key]] where some were taken out
        self._known: set[str] = set()
        self.lost = self._finished = False
        self._guessed_kind = False  # its kind is misspelt: that other keys are missing or unknown is not sure

    def read(self, build: Callable[[Section], T]) -> T | None:
        """What ``build`` makes of this table; None where something is wrong with it, which is then noted."""
        built, sound = self.likeness(build)
        return built if sound else None

    def likeness(self, build: Callable[[Section], T]) -> tuple[T | None, bool]:
        """What ``build`` makes of this table, with stand-ins where something is wrong, and whether nothing is."""
        return likeness(self, build)

    def each(self, key: str, build: Callable[[Section], T], needed: bool = False) -> tuple[list[T], list[Doubtful[T]]]:
        """What ``build`` makes of every table ``[[key]]``, and the tables that something is wrong with."""
        found: list[T] = []
        lost: list[Doubtful[T]] = []
        if needed and not self._left.get(key):
            other = self._other(key)
            self.fault(f"no [[{key}]], expected at least one" + (f", did you mean it by {other!r}?" if other else ""))
            self._left.pop(key, None)
            if other is None:
                return [], [Doubtful({}, None)]
            self._left[key] = self._left.pop(other)
        for section in self.sections(key):
            built, sound = section.likeness(build)
            if built is not None and sound:
                found.append(built)
            else:
                lost.append(Doubtful(section.table, built))
        return found, lost

    def within(self, table: dict[str, Any], at: str = "") -> Section:
        """Another table that is read as a part of this one."""
        return Section(table, f"{self.where}: {at}" if at else self.where, self.folder, self.mistakes)

    def fault(self, said: str, sure: bool = False) -> None:
        """Something wrong with the table, told in half a sentence; ``sure`` where no stand-in can be the reason."""
        if self.mistakes is None:
            raise InputError(f"{self.where}: {said}")
        self.mistakes.note(f"{self.where}: {said}", sure=sure)

    def has(self, key: str) -> bool:
        """True if the key is there and not yet taken."""
        self._known.add(key)
        return key in self._left

    def take(self, key: str, default: Any = ...) -> Any:
        """The raw value of a key; without a default it must be there."""
        self._known.add(key)
        if key in self._left:
            value = self._left.pop(key)
            if self.mistakes is not None and f"{self.where}: {key}" in self.mistakes.refused:
                return self._absent()
            return value
        if default is ...:
            other = self._other(key)
            if other or not self._guessed_kind:
                meant_by = f", did you mean it by {other!r}?" if other else ""
                self.fault(f"key {key!r} is missing{meant_by}", sure=True)
            return self._left.pop(other) if other else self._absent()
        return default

    def _other(self, key: str) -> str | None:
        """The key that stands there for one that is missing, if it seems so."""
        same = [word for word in self._left if meant(word, (key,))]
        return next(iter(same or difflib.get_close_matches(key, self._left, n=1, cutoff=0.7)), None)

    def _absent(self) -> Any:
        assert self.mistakes is not None
        return self.mistakes.stand_in((Absent(0), Absent(1)))

    def _wrong(self, value: Any, said: str, instead: tuple[Any, Any]) -> Any:
        """Refuse a value, unless it was before; what stands in for it."""
        if not isinstance(value, Absent):
            self.fault(said, sure=True)
        assert self.mistakes is not None
        return self.mistakes.stand_in(instead)

    def _guessed(self, instead: tuple[Any, Any]) -> Any:
        """A word in place of another, on which it may depend what is read from there on."""
        assert self.mistakes is not None
        self.mistakes.guessed = True
        return self.mistakes.stand_in(instead)

    def text(self, key: str, default: Any = ..., choices: tuple[str, ...] = ()) -> str:
        """A string, one of ``choices`` if given."""
        value, instead = self.take(key, default), (choices[0], choices[-1]) if choices else _WORD[:2]
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, str):
            self._wrong(value, f"{key} is {value!r}, expected a string", instead)
            return str(self._guessed(instead))
        if choices and value not in choices:
            near = nearest(value, choices)
            self.fault(f"{key} is {value!r}, {near}", sure=True)
            close = self._near(near, choices)
            self._guessed_kind |= close is not None
            return close or str(self._guessed(instead))
        return value

    def _near(self, said: str, choices: Sequence[str]) -> str | None:
        """The word that was probably meant."""
        return next((word for word in choices if said == f"did you mean {word!r}?"), None)

    def kind(self, find: Callable[[str, str], T], words: Sequence[str]) -> T:
        """What the word under ``kind`` stands for, by ``find(word, where)``, which refuses what is not among words."""
        word = self.text("kind")
        if word in _WORD and self.mistakes is not None:
            raise Lost
        try:
            return find(word, self.where)
        except InputError as error:
            if self.mistakes is None:
                raise
            self.mistakes.note(*error.sentences)
            near = self._near(nearest(word, words), words)
            if near is None:
                raise Lost from None
            self._guessed_kind = True
            return find(near, self.where)

    def flag(self, key: str, default: bool = False) -> bool:
        """true or false."""
        value = self.take(key, default)
        said = f"{key} is {value!r}, expected true or false"
        return value if isinstance(value, bool) else bool(self._wrong(value, said, (default, not default)))

    def integer(self, key: str, default: Any = ..., lower: int = 0, upper: int = MOST) -> int:
        """A whole number from ``lower`` to ``upper``."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, int) or isinstance(value, bool) or not lower <= value <= upper:
            most = f" and at most {upper}" if type(value) is int and value > upper else ""
            said = f"{key} is {value!r}, expected a whole number of at least {lower}{most}"
            return int(self._wrong(value, said, (lower, lower + 1)))
        return value

    def _quantity(self, value: Any, unit: str, spot: str) -> float:
        try:
            return quantity(value, unit, f"{self.where}: {spot}")
        except InputError as error:
            if self.mistakes is None:
                raise
            return float(self._wrong(value, str(error).removeprefix(f"{self.where}: "), _NUMBER))

    def scale(self, key: str, unit: str, expected: str) -> float:
        """SI value of one ``unit``, the word under ``key``."""
        try:
            return scale(unit, expected, f"{self.where}: {key}")
        except InputError as error:
            if self.mistakes is None:
                raise
            return float(self._wrong(unit, str(error).removeprefix(f"{self.where}: "), _NUMBER))

    def number(self, key: str, unit: str, default: Any = ...) -> float:
        """A value in ``unit`` (SI; Hz and rpm for frequency and spindle speed)."""
        value = self.take(key, default)
        return value if value is default else self._quantity(value, unit, key)

    def numbers(self, key: str, unit: str, default: Any = ..., length: int | None = None) -> tuple[float, ...]:
        """A list of values in ``unit``."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        if not isinstance(value, list) or (length is not None and len(value) != length):
            wanted = f"a list of {length} values" if length is not None else "a list"
            instead = ((0.5,) * (length or 1), (0.25,) * (length or 2))
            return tuple(self._wrong(value, f"{key} is {value!r}, expected {wanted}", instead))
        return tuple(self._quantity(v, unit, f"{key}[{i}]") for i, v in enumerate(value))

    def matrix(self, key: str, unit: str, default: Any = ...) -> tuple[tuple[float, ...], ...]:
        """A list of rows of one length."""
        value = self.take(key, default)
        if value is default:
            return value  # type: ignore[no-any-return]
        rows = value if isinstance(value, list) else []
        if not rows or not all(isinstance(row, list) and len(row) == len(rows[0]) > 0 for row in rows):
            instead = (((0.5,),), ((0.5, 0.0), (0.0, 0.5)))
            return tuple(self._wrong(value, f"{key} is {value!r}, expected a list of rows of equal length", instead))
        return tuple(
            tuple(self._quantity(v, unit, f"{key}[{i}][{j}]") for j, v in enumerate(row)) for i, row in enumerate(rows)
        )

    def words(self, key: str, default: Any = ...) -> tuple[str, ...]:
        """A list of strings."""
        value = self.take(key, default)
        if value is not default and not (isinstance(value, list) and all(isinstance(v, str) for v in value)):
            value = self._wrong(value, f"{key} is {value!r}, expected a list of strings", (_WORD[:1], _WORD[1:]))
        return value if value is default else tuple(value)

    def section(self, key: str) -> Section:
        """A sub-table; empty if it is not there."""
        value = self.take(key, {})
        found = self.within(value if isinstance(value, dict) else {}, f"[{key}]")
        if not isinstance(value, dict):
            found.lost = bool(self._wrong(value, f"{key} is {shortened(value)}, expected a table", (True, True)))
        return found

    def sections(self, key: str) -> Iterator[Section]:
        """Every table of an array of tables ``[[key]]``."""
        value = self.take(key, [])
        if not isinstance(value, list) or not all(isinstance(v, dict) for v in value):
            value = self._wrong(value, f"{key} is {shortened(value)}, expected tables [[{key}]]", ([None], [None]))
        for number, table in zip(self.counted.get(key, range(1, len(value) + 1)), value, strict=True):
            label = table.get("name", table.get("kind", table.get("file", ""))) if table is not None else None
            tag = f" ({label})" if isinstance(label, str) and label else ""
            section = self.within(table or {}, f"[[{key}]] {number}{tag}")
            section.lost = table is None
            yield section

    def raw(self) -> dict[str, Any]:
        """The table as it was parsed, without the keys already taken; what is changed in it is read changed."""
        return self._left

    def keys(self) -> tuple[str, ...]:
        """Keys not yet taken."""
        return tuple(self._left)

    def path(self, key: str, default: Any = ...) -> Path:
        """A file name relative to the document."""
        value = self.text(key, default)
        if value is not default and (wrong := no_name(value)):
            value = self._wrong(value, f"{key} is {wrong}, expected the name of a file", _WORD[:2])
        return value if value is default else self.folder / value

    def done(self) -> None:
        """Refuse the keys that nobody asked for, each with the nearest valid one, or with what is assumed instead."""
        self._finished = True
        for key in self._left:
            if self.seems(key) or not self._guessed_kind:
                self.unknown(key)

    def expect(self, *words: str) -> None:
        """Tell the keys that seem to be others among these, and take them for those."""
        self._known, self._finished = self._known | set(words), True
        for key in [key for key in self._left if key not in words]:
            word = self.seems(key)
            if word is not None and word not in self._left:
                self.unknown(key)
                self._left[word] = self._left.pop(key)

    def seems(self, key: str) -> str | None:
        """The key of this table that is probably meant by one that it does not know."""
        if key in self._known:
            return None
        cutoff = 0.8 if not self._finished else 0.7 if self._guessed_kind else 0.5
        close = difflib.get_close_matches(key, self._known, n=1, cutoff=cutoff)
        return (meant(key, self._known) if self._finished else None) or next(iter(close), None)

    def likely(self) -> None:
        """Refuse what seems to be misspelt, where not all keys were asked for."""
        for key in self._left:
            if self.seems(key):
                self.unknown(key)

    def unknown(self, key: str) -> None:
        """Refuse a key that this table does not have."""
        assumed = not_covered(key)
        if assumed is None or meant(key, self._known):
            self.fault(f"unknown key {key!r}, {nearest(key, self._known)}", sure=True)
        else:
            self.fault(f"{key} is not covered, {assumed}; leave it out to get the answer without it", sure=True)
