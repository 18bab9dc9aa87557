"""Numbers in the fixed columns of Fortran formats, as matrix files hold them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

_FORMAT = re.compile(r"(\d*)\s*(?:I|[EDFG])(\d+)(?:\.(\d+))?(?:E\d+)?\)?\s*$")
_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


def columns(text: str) -> tuple[int, int]:
    """Numbers per line and their width, from a format like ``(1P,5E16.9)`` or ``(10I8)``."""
    plain = text.strip().upper().lstrip("(")
    plain = re.sub(r"^-?\d*P\s*,?\s*", "", plain)
    match = _FORMAT.match(plain)
    if match is None or int(match[2]) == 0:
        raise ValueError(f"format {text.strip()!r} is not one of numbers in fixed columns")
    return int(match[1] or 1), int(match[2])


def real(word: str) -> float:
    """A number as Fortran writes it: ``1.5D+03``, ``1.5+3`` and ``1.5E+03`` are the same."""
    plain = word.strip().upper().replace("D", "E")
    if "E" not in plain:
        plain = _EXPONENT.sub(r"E\1", plain)
    return float(plain)


def fixed(lines: Sequence[str], start: int, count: int, per_line: int, width: int) -> tuple[Array, int]:
    """``count`` numbers from line ``start`` on, and the line after them."""
    used = -(-count // per_line)
    words = []
    for line in lines[start : start + used]:
        words += [line[i : i + width] for i in range(0, min(len(line.rstrip()), per_line * width), width)]
    if len(words) < count:
        raise ValueError(f"ends in line {len(lines)}, where {count} numbers from line {start + 1} on were announced")
    # Some writers do not keep to the columns they announce; blanks then part the numbers.
    parted = [word for line in lines[start : start + used] for word in line.split()]
    for found in (words[:count], parted):
        try:
            if len(found) == count:
                return np.array([real(word) for word in found]), start + used
        except ValueError:
            continue
    raise ValueError(f"lines {start + 1} to {start + used} hold something that is no number")
