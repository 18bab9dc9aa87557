"""A measurement file before it is written: values, what is said beside each, and the guesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Noted:
    """A value with a comment."""

    value: Any
    comment: str = ""


Table = dict[str, Noted]


@dataclass
class Draft:
    """Tables in the order of the file; filled while the records are looked at."""

    top: Table = field(default_factory=dict)
    text: Table = field(default_factory=dict)
    bodies: Table = field(default_factory=dict)
    estimate: Table = field(default_factory=dict)
    cutting: Table = field(default_factory=dict)
    channels: list[Table] = field(default_factory=list)
    records: list[Table] = field(default_factory=list)
    cuts: list[Table] = field(default_factory=list)
    guesses: list[str] = field(default_factory=list)
    """Sentences on what the files do not say, and on what is not as usual."""

    def guess(self, table: Table, key: str, value: Any, why: str, change: str) -> None:
        """A value that the files do not say: why it is taken, and what sets it otherwise."""
        table[key] = Noted(value, f"guess: {why}")
        self.guesses.append(f"{change.partition('=')[0]} = {plain(value)} is a guess: {why}; --set {change}")

    def override(self, table: Table, values: Mapping[str, Any]) -> None:
        """What is said on the command line; no guess is left of it."""
        for key, value in values.items():
            table[key] = Noted(value)

    def forget(self, *begun: str) -> None:
        """Drop the guesses on keys that are said after all."""
        self.guesses = [said for said in self.guesses if not said.startswith(tuple(f"{key} = " for key in begun))]


def plain(value: Any) -> str:
    """A value in a sentence."""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, str) else f"{value:g}" if isinstance(value, float) else str(value)


def names_of(table: Table) -> dict[str, Any]:
    """The values of a table without their comments."""
    return {key: noted.value for key, noted in table.items()}
