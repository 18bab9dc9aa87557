"""Receptance files of the CutPro kind (``.frf``): text, one file per axis, frequency in Hz and m/N, e^(+jωt).

The layout is that of sample files in circulation, not confirmed by the vendor: three columns f, Re, Im between blanks
or tabs, no header line, and the words ``Freq Hz Real m/N Imag m/N`` at the end of the *first data row*. The lines
start at 0 Hz with a uniform step in those samples.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of
from jointlib.io.atomic import write_text

SUFFIX = ".frf"
_WORDS = ("Freq", "Hz", "Real", "m/N", "Imag", "m/N")
_UNIFORM = 1e-6


def read_cutpro(path: Path) -> tuple[Array, ComplexArray]:
    """Lines in Hz and receptance in m/N of a ``.frf`` file."""
    text = bytes_of(path, "a receptance").decode("latin-1")
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        cells = line.split()
        if not cells:
            continue
        try:
            row = [float(cell) for cell in cells[:3]]
        except ValueError:
            row = []
        if len(row) != 3:
            shown = line.strip() if len(line) < 60 else f"{line.strip()[:57]}..."
            raise InputError(f"{path}: line {number} is {shown!r}, expected frequency, real and imaginary part")
        if cells[3:]:
            _check_words(path, number, cells[3:], first=not rows)
        rows.append(row)
    if len(rows) < 2:
        raise InputError(f"{path}: has {len(rows)} rows of numbers, expected at least two lines of frequency")
    f, real, imaginary = np.array(rows).T
    return f, real + 1j * imaginary


def _check_words(path: Path, number: int, words: list[str], first: bool) -> None:
    """Behind the numbers stand column names and units, in the first row only; the last word is sometimes a slip."""
    said = " ".join(words)
    if not first:
        raise InputError(f"{path}: line {number} goes on with {said!r}, expected three numbers")
    if len(words) != len(_WORDS) or tuple(words[:3]) != _WORDS[:3] or words[4] != _WORDS[4]:
        raise InputError(f"{path}: its first row ends in {said!r}, expected {' '.join(_WORDS)!r}")
    if words[3] != "m/N":
        raise InputError(f"{path}: its values are in {words[3]}, expected a receptance in m/N")


def write_cutpro(path: Path, frequency: Array, receptance: ComplexArray) -> None:
    """Write a receptance (m/N) whole or not at all; the lines in Hz must have a uniform step."""
    f, H = np.asarray(frequency, dtype=float), np.asarray(receptance, dtype=complex)
    step = np.diff(f)
    if len(f) < 2 or np.ptp(step) > _UNIFORM * abs(step[0]) or step[0] <= 0:
        raise InputError(f"{path}: lines of frequency with steps that differ, expected one step throughout")
    lines = [f"{a:.10g}\t{h.real:.10e}\t{h.imag:.10e}" for a, h in zip(f.tolist(), H.tolist(), strict=True)]
    lines[0] += "\t" + "\t".join(_WORDS)
    write_text(path, "\n".join(lines) + "\n")
