"""Everything that is wrong with a file, found in one reading.

A value that cannot be used is told, and something stands in for it so that the reading goes on. What is said because of
a stand-in is no fault of the file: a file with faults is read twice, with different ones, and what is said both times
is told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, TypeVar

from jointlib.errors import InputError
from jointlib.io.toml_lines import TomlLines, shown

T = TypeVar("T")
_LONGEST = 60
_OF_A_KEY = re.compile(
    r"(?P<where>.*?): (?P<key>\w+)(?:\[\d+\])*(?: (?:is|are|has|names|runs|refers)\b|: ).*", re.DOTALL
)


class Absent:
    """Stands in for a value whose kind nobody told; reading anything from it says nothing more."""

    def __init__(self, number: int) -> None:
        self._number = number

    def __repr__(self) -> str:
        return f"nothing that could be read ({self._number})"


def shortened(value: object) -> str:
    """A value as a message shows it."""
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


class Lost(Exception):
    """The rest of a table cannot be read, and why has been told."""


class Mistakes:
    """What one reading of a file, and of those that belong to it, found wrong."""

    def __init__(self, number: int) -> None:
        self.number: Final = number
        """0 or 1: which of the two sets of stand-ins."""
        self.sentences: dict[str, bool] = {}
        """What is told, and whether no stand-in can be the reason."""
        self.texts: dict[str, str] = {}
        """The documents by name, for their lines."""
        self.places: dict[str, str] = {}
        """Where keys stand in their file, as messages begin, that are read elsewhere."""
        self.unopened = False
        """Whether a file that this one is built on could not be opened."""
        self.stand_ins = 0
        """How many values something stands in for."""
        self.guessed = False
        """Whether a word stands in on which it may depend what else is read."""
        self.refused: set[str] = set()
        """Keys, with their place before them, whose value nothing could be made of when it was used."""

    def note(self, *sentences: str, sure: bool = False) -> None:
        """Tell a fault, once; what is said of a whole value after one of its entries follows from that."""
        for said in sentences:
            match = _OF_A_KEY.fullmatch(said)
            key = f"{match['where']}: {match['key']}" if match else said
            told = (f"{key}[", f"{key}: ", f"{key} is")
            if said.startswith(told[0]) or not any(other.startswith(told) for other in self.sentences):
                self.sentences[said] = sure

    def stand_in(self, values: tuple[Any, Any]) -> Any:
        """The one of two values that this reading takes."""
        self.stand_ins += 1
        return values[self.number]

    def refuse(self, error: InputError, where: str, doubtful: bool) -> bool:
        """Tell what was refused of a table; true if it is of keys that something can now stand in for.

        Where something stands in already, what is ``doubtful`` and of no key may only follow from that.
        """
        keys = set()
        for said in error.sentences:
            match = _OF_A_KEY.fullmatch(said.removeprefix(where)) if said.startswith(where) else None
            if match is not None:
                within = match["where"] if "[[" in match["where"] else ""
                keys.add(f"{where}{within}: {match['key']}")
            if match is not None or not doubtful or not said.startswith(where):
                self.note(said)
        new = keys - self.refused
        self.refused |= new
        return bool(new)

    def made_up(self, name: str) -> bool:
        """Whether a word stands in for another."""
        return self.stand_ins > 0 and name.startswith("unknown")

    def attempt(self, read: Callable[[], T]) -> T | None:
        """What a reading gives; None where it was refused, which is then told, or where a stand-in misled it."""
        try:
            return read()
        except Lost:
            return None
        except InputError as error:
            self.note(*error.sentences)
        except Exception:
            # A stand-in is not what the code after it was written for.
            if not self.stand_ins:
                raise
        return None


def all_at_once(
    read: Callable[[Mistakes], T],
    changes: Mapping[str, Any] | None = None,
    others: Callable[[], Iterable[Callable[[Mistakes], object]]] = tuple,
    whole: bool = False,
) -> T:
    """What ``read`` makes of a file, or one `InputError` with a sentence for everything that is wrong with it.

    Lines are told where the file is read as it stands, without ``changes``. ``others`` are further readings, asked for
    where something is wrong, or of the ``whole`` file: each tells what is wrong with a part that this one leaves out.
    """
    found, told, texts = _read_twice(read)
    if found is not None and not told and not whole:
        return found
    for other in others():
        _, more, further = _read_twice(other)
        told, texts = {**told, **more}, {**texts, **further}
    if found is not None and not told:
        return found
    raise InputError(*_in_order(list(told), {} if changes else texts))


def _read_twice(read: Callable[[Mistakes], T]) -> tuple[T | None, dict[str, None], dict[str, str]]:
    """What was read, the sentences on what is wrong, and the texts that were read."""
    readings: list[Mistakes] = []
    for number in (0, 1):
        mistakes = Mistakes(number)
        found = mistakes.attempt(lambda mistakes=mistakes: read(mistakes))  # type: ignore[misc]
        if not mistakes.sentences and found is not None:
            return found, {}, mistakes.texts
        readings.append(mistakes)
        if not mistakes.stand_ins:
            break
    first, last = readings[0], readings[-1]
    every = {**last.sentences, **first.sentences}
    kept = [
        said
        for said, sure in every.items()
        if (said in first.sentences and said in last.sentences) or (sure and not first.guessed)
    ]
    told = (_where_it_stands(said, first.places) for said in kept or first.sentences)
    return None, dict.fromkeys(told), first.texts


def _where_it_stands(said: str, places: Mapping[str, str]) -> str:
    """A sentence on a key with the place where its file has it."""
    for read, stands in places.items():
        if said.startswith(read) and not re.match(r"\w", said[len(read) :]):
            return stands + said[len(read) :]
    return said


def _in_order(sentences: Sequence[str], texts: Mapping[str, str]) -> list[str]:
    """By file and line, each with its line at the end."""
    out = []
    for said in sentences:
        name = next((name for name in texts if said.startswith(f"{name}: ")), "")
        number = TomlLines(texts[name]).line(said.removeprefix(f"{name}: ")) if name else 0
        told = f"{said} {shown(texts[name], number)}" if number else said
        out.append((list(texts).index(name) if name else len(texts), number, told))
    return [told for _, _, told in sorted(out, key=lambda one: one[:2])]
