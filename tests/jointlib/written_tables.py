"""Writes tables of numbers in the dialects of laboratories; shares nothing with what reads them."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path


@dataclass(frozen=True)
class Style:
    """How a table is written."""

    separator: str = ","
    decimal: str = "."
    thousands: str = ""
    form: str = ".9g"
    encoding: str = "utf-8"
    end: str = "\n"
    units: str = "none"
    """none, brackets, parentheses, row, bracketed row, stroke or preamble."""
    preamble: tuple[str, ...] = ()
    blank_line: bool = False
    quoted: bool = False
    trailing: bool = False
    """A separator after the last cell of every row."""
    comment: str = ""

    def number(self, value: float) -> str:
        """One value, its digits before the decimal mark in groups of three where that is the style."""
        text = f"{value:{self.form}}"
        mantissa, e, exponent = text.partition("e")
        whole, point, rest = mantissa.partition(".")
        sign = "-" if whole.startswith("-") else ""
        digits = whole.lstrip("-")
        if self.thousands and not e:
            groups = []
            while len(digits) > 3:
                groups.insert(0, digits[-3:])
                digits = digits[:-3]
            digits = self.thousands.join([digits, *groups])
        return sign + digits + (self.decimal if point else "") + rest + e + exponent

    def table(self, names: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[float]]) -> bytes:
        """The file."""
        forms = {"brackets": "{} [{}]", "parentheses": "{} ({})", "stroke": "{}/{}"}
        form = forms.get(self.units)
        heads = [form.format(n, u) if form else n for n, u in zip(names, units, strict=True)]
        lines = list(self.preamble)
        lines += [f"Unit of {n}: {u}" for n, u in zip(names, units, strict=True)] if self.units == "preamble" else []
        lines.append(self.comment + self.row(heads))
        lines += [self.row(units)] if self.units == "row" else []
        lines += [self.row([f"[{u}]" for u in units])] if self.units == "bracketed row" else []
        lines += [""] if self.blank_line else []
        lines += [self.row([self.number(v) for v in row]) for row in rows]
        return (self.end.join(lines) + self.end).encode(self.encoding)

    def row(self, cells: Sequence[str]) -> str:
        shown = [f'"{cell}"' for cell in cells] if self.quoted else list(cells)
        return self.separator.join(shown) + (self.separator if self.trailing else "")

    def read_back(self, value: float) -> float:
        """The number that the file holds, whatever its marks: the value in the digits that were written."""
        return float(f"{value:{self.form}}")

    def save(self, path: Path, names: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[float]]) -> Path:
        path.write_bytes(self.table(names, units, rows))
        return path


FORMS = (".0f", ".1f", ".2f", ".3f", ".6f", ".3e", "g", ".12g")


def odd_table(rng: random.Random) -> tuple[str, list[list[float]]]:
    """A table as nobody should write it: any mark as separator, in numbers and between thousands; and its numbers.

    Columns have digits of their own; names are missing, and what stands above looks like numbers. No more than that:
    blanks between both columns and thousands tell nobody which is which.
    """
    separator = rng.choice([",", ";", "\t", " ", "|", ", ", "; ", "  "])
    decimal, thousands = rng.choice(".,"), rng.choice(["", "", "", ",", ".", " ", "'"])
    if thousands == decimal or (thousands == " " and separator.strip(" ") == ""):
        thousands = ""
    style = Style(separator, decimal, thousands, quoted=rng.random() < 0.2 and separator.strip() != "")
    columns = [(rng.choice(FORMS), 10 ** rng.uniform(-2, 6)) for _ in range(rng.randint(1, 5))]
    texts, numbers = [], []
    for i in range(rng.choice([1, 2, 3, 5, 20, 600])):
        row = [(f, rng.choice([1, 1, 1, -1]) * rng.random() * size * (rng.random() < 0.95)) for f, size in columns]
        if rng.random() < 0.3:
            row[0] = ".3f", i / 1000
        styles = [(replace(style, form=form), value) for form, value in row]
        texts.append(style.row([one.number(value) for one, value in styles]))
        numbers.append([one.read_back(value) for one, value in styles])
    head = [] if rng.random() < 0.3 else [separator.join(("t", "acc", "F", "pos", "x")[: len(columns)])]
    above = rng.choice([[], ["note"], ["Rate;51200", "Operator;M"], ["1;2", "3,5"]]) if head else []
    return "\n".join([*above, *head, *texts]) + "\n", numbers
