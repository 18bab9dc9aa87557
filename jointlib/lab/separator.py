"""What stands between the columns of a text table."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

from jointlib.lab.numerals import Numerals

WORDS = {";": "semicolons", ",": "commas", "\t": "tabs", "|": "bars", " ": "blanks", "": "nothing"}
TOLD = {";": ";", ",": ",", "tab": "\t", "\t": "\t", "|": "|", "blank": " ", " ": " ", "none": ""}
"""Words of ``separator`` in files."""


@dataclass(frozen=True)
class Separator:
    """A mark between columns; ``quoted`` where cells may stand in quotation marks.

    ``pairs``: commas stand between columns and in every number, so that two pieces make one.
    """

    mark: str
    quoted: bool = False
    pairs: bool = False
    spaced: bool = False
    """The comma is followed by a blank, and those without are decimal."""
    joined: int | None = None
    """A column that is one number with the next, the mark between them being a part of it."""

    def cells(self, line: str) -> list[str]:
        """The cells of a row."""
        if self.quoted:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self.mark, skipinitialspace=True), [])]
        if self.mark == " ":
            found = re.split(r"[ \t]+", line.strip(" \t"))
            if self.joined is not None:
                found[self.joined : self.joined + 2] = [" ".join(found[self.joined : self.joined + 2])]
            return found
        if not self.mark:
            return [line.strip().strip('"').strip()]
        pieces = line.split(", " if self.spaced else self.mark)
        if self.joined is not None:
            pieces[self.joined : self.joined + 2] = [self.mark.join(pieces[self.joined : self.joined + 2])]
        if self.pairs:
            return [",".join(pieces[i : i + 2]).strip() for i in range(0, len(pieces), 2)]
        return [piece.strip() for piece in pieces]

    def allows(self, numerals: Numerals) -> bool:
        """Whether numbers may be written so between such marks."""
        if self.quoted or not self.mark:
            return True
        if self.spaced:
            return "," in numerals.marks
        if self.pairs:
            return numerals == Numerals(",")
        return self.mark not in (numerals.decimal, numerals.thousands)

    @property
    def words(self) -> str:
        """As a message tells it."""
        return "commas and blanks" if self.spaced else WORDS[self.mark]


def candidates(quoted: bool, told: str | None) -> list[Separator]:
    """What may stand between columns, ``told`` alone where that is known; cells may be ``quoted``."""
    marks = [";", "\t", ",", "|", " ", ""] if told is None else [told]
    found = [Separator(mark) for mark in marks]
    if "," in marks:
        found += [Separator(",", spaced=True), Separator(",", pairs=True)]
    return found + [Separator(mark, quoted=True) for mark in marks if quoted and mark not in (" ", "")]
