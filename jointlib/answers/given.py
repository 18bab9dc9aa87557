"""What a program may hand over where a verb takes words: files or what was read of them, numbers or quantities."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from jointlib.io.joint_file import read_joint
from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.measurement import Measurement
from jointlib.units import frequency_range, quantity, within

File: TypeAlias = Path | str
Quantity: TypeAlias = float | str
"""In SI, Hz or rpm, or a string with its unit."""
Quantities: TypeAlias = Quantity | Sequence[Quantity] | np.ndarray[Any, Any]
Span: TypeAlias = str | Sequence[Quantity] | tuple[float, float, int | None]
"""``"1 kHz:7 kHz"``, ``"1 kHz:7 kHz:400"`` with the number of lines, or the two or three in a sequence."""


def joint_of(joint: Joint | File) -> Joint:
    """A joint, or that of a file."""
    return joint if isinstance(joint, Joint) else read_joint(Path(joint))


def measurement_of(measurement: Measurement | File) -> Measurement:
    """A measurement, or that of a file."""
    return measurement if isinstance(measurement, Measurement) else read_measurement(Path(measurement))


def files_of(files: File | Iterable[File]) -> tuple[Path, ...]:
    """Paths of one file or of several."""
    return (Path(files),) if isinstance(files, str | os.PathLike) else tuple(Path(file) for file in files)


def several(
    value: Quantities, unit: str, where: str, lower: float | None = None, upper: float | None = None
) -> tuple[float, ...]:
    """One quantity or a sequence of them as floats in SI (Hz, rpm), each from ``lower`` to ``upper``."""
    given = [value] if isinstance(value, str) or np.ndim(value) == 0 else list(value)  # type: ignore[arg-type]
    plain = [one.item() if isinstance(one, np.generic) else one for one in given]
    return tuple(within(quantity(one, unit, where), lower, upper, unit, where, one) for one in plain)


def one(
    value: Quantity | None, unit: str, where: str, lower: float | None = None, upper: float | None = None
) -> float | None:
    """A quantity as a float, None where there is none."""
    return None if value is None else several(value, unit, where, lower, upper)[0]


def span(value: Span | None, where: str) -> tuple[float, float, int | None] | None:
    """Lowest and highest frequency in Hz and the number of lines, None where it is not given."""
    if value is None:
        return None
    parts = value.split(":") if isinstance(value, str) else [part for part in value if part is not None]
    return frequency_range([str(p) for p in parts], where, ":".join(map(str, parts)))
