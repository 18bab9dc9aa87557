"""A table read although something is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from jointlib.errors import InputError
from jointlib.io.mistakes import Lost

if TYPE_CHECKING:
    from jointlib.io.toml import Section

T = TypeVar("T")


@dataclass(frozen=True)
class Doubtful(Generic[T]):
    """A table with something wrong, and what could be made of it with stand-ins; None where nothing could."""

    table: Mapping[str, Any]
    likeness: T | None


def likeness(section: Section, build: Callable[[Section], T]) -> tuple[T | None, bool]:
    """What ``build`` makes of a table, with stand-ins where something is wrong, and whether nothing is.

    A key that seems to be misspelt is told, and the table read again as if it were not: what was missing is there.
    """
    mistakes = section.mistakes
    if mistakes is None:
        return build(section), True
    if section.lost:
        return None, False
    before, refused = dict(mistakes.sentences), set(mistakes.refused)
    built, last = _tried(section, build)
    meant_by = {word: key for key in last.raw() if (word := last.seems(key)) and word not in section.table}
    if meant_by:
        mistakes.sentences, mistakes.refused = dict(before), refused
        for key in meant_by.values():
            last.unknown(key)
        as_meant = {key: word for word, key in meant_by.items()}
        table = {as_meant.get(key, key): value for key, value in section.table.items()}
        built, _ = _tried(section.within(table), build)
        about = tuple(f"{section.where}: {word}" for word in meant_by)
        for said in [said for said in mistakes.sentences if said.startswith(about) and said not in before]:
            del mistakes.sentences[said]
    return built, mistakes.sentences.keys() == before.keys()


def _tried(section: Section, build: Callable[[Section], T]) -> tuple[T | None, Section]:
    """The table read until nothing more is found; where a value is refused as it is used, with another instead."""
    mistakes = section.mistakes
    assert mistakes is not None
    while True:
        again, stood_in = section.within(section.table), mistakes.stand_ins
        try:
            return build(again), again
        except Lost:
            return None, again
        except InputError as error:
            if not mistakes.refuse(error, section.where, doubtful=mistakes.stand_ins > stood_in):
                again.likely()
                return None, again
        except Exception:
            # A stand-in is not what the code after it was written for.
            if not mistakes.stand_ins:
                raise
            return None, again
