"""What a dynamometer makes of a force: its FRF, measured over true force, taken out of the lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.readers import read_columns
from jointlib.lab.dialect import Told

_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Transfer:
    """H = measured force over force, dimensionless, on ascending lines in Hz."""

    frequency: Array
    value: ComplexArray

    @property
    def highest(self) -> float:
        """Hz up to which it is known."""
        return float(self.frequency[-1])

    def inverse(self, frequency: Array) -> ComplexArray:
        """1/H at other lines, by a spline: of one resonance it is a parabola, which a spline meets exactly.

        Below the first line H is taken for 1 at 0 Hz.
        """
        f, value = self.frequency, 1 / self.value
        if f[0] > 0:
            f, value = np.concatenate([[0.0], f]), np.concatenate([[1.0 + 0j], value])
        return np.asarray(
            scipy.interpolate.CubicSpline(f, value.real)(frequency)
            + 1j * scipy.interpolate.CubicSpline(f, value.imag)(frequency)
        )


def read_transfer(path: Path, told: Told | None = None) -> Transfer:
    """The first three columns of a table: frequency in Hz, real and imaginary part."""
    columns = list(read_columns(path, told).values())
    if len(columns) < 3:
        raise InputError(f"{path}: holds {len(columns)} columns, expected frequency in Hz, real and imaginary part")
    frequency, value = columns[0], columns[1] + 1j * columns[2]
    if not np.all(np.isfinite(value)) or not np.all(np.abs(value) > 0):
        raise InputError(f"{path}: holds values that are 0 or no number, expected measured force over force")
    if len(frequency) < _FEWEST or not np.all(np.diff(frequency) > 0) or not frequency[0] >= 0:
        raise InputError(f"{path}: expected at least {_FEWEST} lines in ascending frequency from 0 Hz on")
    return Transfer(frequency, value)
