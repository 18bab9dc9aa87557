"""The table ``[text]`` of a measurement file: how its text records are written, where that can be taken in two ways."""

from __future__ import annotations

from jointlib.io.toml import Section
from jointlib.lab.dialect import Told
from jointlib.lab.separator import TOLD


def dialect_of(section: Section) -> Told:
    """What the table says; what it leaves out is found in the records."""
    separator = section.text("separator", None, choices=tuple(TOLD))
    decimal = section.text("decimal", None, choices=(".", ","))
    thousands = section.text("thousands", None, choices=("", ",", ".", " ", "'"))
    if decimal is not None and decimal == thousands:
        section.fault(f"thousands is {thousands!r}, the decimal mark too, expected two marks")
    encoding = section.text("encoding", None)
    header = section.integer("header", None)
    section.done()
    return Told(None if separator is None else TOLD[separator], decimal, thousands, encoding, header)
