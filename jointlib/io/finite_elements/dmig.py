"""Nastran DMIG entries, from bulk data or punch files: matrices whose rows are grid points and components."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

from jointlib.foreign.door import bytes_of
from jointlib.io.finite_elements.fortran import real

Label = tuple[int, int]
"""Grid point and component 1 to 6; 0 is a scalar point."""


def read_dmig(path: Path) -> dict[str, tuple[scipy.sparse.csc_matrix, tuple[Label, ...]]]:
    """Every matrix of the file by name, with the grid point and component of its rows.

    The entries' fields (MSC Nastran Quick Reference Guide, DMIG): a header ``NAME 0 IFO TIN TOUT``, then one entry
    per column ``NAME GJ CJ – G1 C1 A1 B1 G2 C2 A2 …``, in fields of 8 columns, of 16 (``DMIG*``) or parted by commas.
    Of a symmetric matrix (IFO 6) one triangle is given.
    """
    forms: dict[str, int] = {}
    entries: dict[str, list[tuple[Label, Label, float]]] = {}
    for number, fields in _entries(bytes_of(path, "a matrix").decode("latin-1").splitlines()):
        try:
            name = fields[0].upper()
            if fields[1] == "0":
                forms[name] = int(fields[2])
                if forms[name] not in (1, 6):
                    raise ValueError(f"matrix {name} has form {forms[name]}, expected 1 (square) or 6 (symmetric)")
                if int(fields[3]) not in (1, 2):
                    raise ValueError(f"matrix {name} has type {fields[3]}, expected 1 or 2 (real)")
                entries.setdefault(name, [])
                continue
            if name not in forms:
                raise ValueError(f"matrix {name} has no header entry before it")
            column = (int(fields[1]), int(fields[2] or 0))
            for i in range(4, len(fields), 4):
                grid, component, value = (*fields[i : i + 3], "", "")[:3]
                if grid:
                    entries[name].append(((int(grid), int(component or 0)), column, real(value)))
        except (ValueError, IndexError) as error:
            text = str(error) if str(error).startswith("matrix") else "the DMIG entry cannot be read"
            raise ValueError(f"line {number}: {text}") from None
    return {name: _assembled(found, forms[name]) for name, found in entries.items()}


def _assembled(
    entries: list[tuple[Label, Label, float]], form: int
) -> tuple[scipy.sparse.csc_matrix, tuple[Label, ...]]:
    labels = tuple(sorted({label for row, column, _ in entries for label in (row, column)}))
    place = {label: i for i, label in enumerate(labels)}
    rows, columns, values = [], [], []
    for row, column, value in entries:
        rows.append(place[row])
        columns.append(place[column])
        values.append(value)
        if form == 6 and row != column:
            rows.append(place[column])
            columns.append(place[row])
            values.append(value)
    return scipy.sparse.csc_matrix(
        scipy.sparse.coo_matrix(
            (np.array(values), (np.array(rows, dtype=int), np.array(columns, dtype=int))),
            shape=(len(labels), len(labels)),
        )
    ), labels


def _entries(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Line number and fields of each DMIG entry, continuations joined."""
    number, fields = 0, list[str]()
    for i, line in enumerate(lines, 1):
        text = line.split("$")[0].rstrip()
        if not text:
            continue
        word = text[:8].split(",")[0].strip().upper()
        if word in ("DMIG", "DMIG*"):
            if fields:
                yield number, fields
            number, fields = i, _fields(text)
        elif fields and (word[:1] in "+*" or not word):
            fields += _fields(text)
        elif fields:
            yield number, fields
            fields = []
    if fields:
        yield number, fields


def _fields(text: str) -> list[str]:
    """Fields 2 to 9 of a line, as many as belong to it."""
    if "," in text:
        found = [part.strip() for part in text.split(",")[1:9]]
        return found + [""] * (8 - len(found))
    width = 16 if re.match(r"\S*\*", text[:8]) else 8
    return [text[8 + width * k : 8 + width * (k + 1)].strip() for k in range(64 // width)]
