"""How numbers are written: decimal point or comma, and what stands between thousands."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

BLANKS = " \u00a0\u202f"
_EXPONENT = r"(?:[eEdD][+-]?\d+)?"
_NO_NUMBER = r"[+-]?(?:nan|inf|infinity|1\.#\w+)"
NO_NUMBER = re.compile(_NO_NUMBER, re.IGNORECASE)
"""What programs write where they have no number."""
LOOSE = re.compile(rf"[+\-−]?[\d.,'{BLANKS}]*\d[\d.,'{BLANKS}]*{_EXPONENT}|{_NO_NUMBER}", re.IGNORECASE)
"""A number in some way of writing."""
_WORDS = {".": "points", ",": "commas", " ": "blanks", "'": "apostrophes"}


@dataclass(frozen=True)
class Numerals:
    """A way of writing numbers; ``thousands`` is empty where digits are not grouped."""

    decimal: str = "."
    thousands: str = ""

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """A number that is written so; one in groups does not begin with 0."""
        d, t = re.escape(self.decimal), f"[{BLANKS}]" if self.thousands == " " else re.escape(self.thousands)
        whole = rf"\d+{d}?\d*|{d}\d+" if self.decimal == "." else rf"\d+(?:{d}\d+)?|{d}\d+"
        plain = rf"[+\-−]?(?:{whole}){_EXPONENT}"
        grouped = rf"|[+\-−]?[1-9]\d{{0,2}}(?:{t}\d{{3}})+(?:{d}\d*)?" if self.thousands else ""
        return re.compile(rf"{plain}{grouped}|{_NO_NUMBER}", re.IGNORECASE)

    @cached_property
    def _group(self) -> re.Pattern[str]:
        mark = f"[{BLANKS}]" if self.thousands == " " else re.escape(self.thousands)
        return re.compile(rf"(?<=\d){mark}(?=\d{{3}}(?!\d))")

    def plain(self, text: str) -> str:
        """Numbers of a text with decimal points, not grouped; of text in columns, not grouped by their separator."""
        if self.thousands:
            text = self._group.sub("", text)
        if self.decimal != ".":
            text = text.replace(self.decimal, ".")
        if "−" in text:
            text = text.replace("−", "-")
        if "D" in text or "d" in text:
            text = re.sub(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", text)
        return text

    def value(self, cell: str) -> float:
        """The number in a cell; nan where a program had none."""
        text = self.plain(cell.strip())
        return float("nan") if "#" in text else float(text)

    @property
    def marks(self) -> str:
        """All marks inside a number."""
        return self.decimal + self.thousands

    @property
    def words(self) -> str:
        """As a message tells it."""
        mark = "decimal comma" if self.decimal == "," else "decimal point"
        return f"{mark}, {_WORDS[self.thousands]} between thousands" if self.thousands else mark


EVERY = tuple(Numerals(d, t) for t in ("", ",", ".", " ", "'") for d in (".", ",") if d != t)
"""All ways that are looked for, the plain ones first."""
