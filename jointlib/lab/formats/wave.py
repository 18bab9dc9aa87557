"""WAV files: samples as fractions of the full scale, and their rate."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, foreign
from jointlib.lab.lab_file import Column, LabFile

_FULL = {"i2": 2.0**15, "i4": 2.0**31, "i8": 2.0**63}


def read_wave(path: Path) -> LabFile:
    """Channels ``channel 1``, ``channel 2`` …, integers divided by their full scale."""
    from scipy.io import wavfile

    data = bytes_of(path, "a WAV file")

    def read() -> tuple[int, Any]:
        try:
            return wavfile.read(io.BytesIO(data))
        except (wavfile.WavFileWarning, ValueError) as error:
            cut = any(word in str(error) for word in ("EOF", "multiple of element size", "cannot reshape"))
            if not cut and isinstance(error, ValueError):
                raise
            said = "ends in the middle of its samples" if cut else f"has a part that is not understood ({error})"
            raise InputError(f"{path}: {said}, expected a whole WAV file") from None

    rate, samples = foreign(path, "a WAV file", read)
    values = np.atleast_2d(samples.T)
    if samples.dtype.kind == "u":
        values = (values.astype(float) - 128.0) / 128.0
    elif samples.dtype.kind == "i":
        values = values.astype(float) / _FULL[samples.dtype.str[1:]]
    columns = tuple(Column(f"channel {k}", v.astype(float), rate=float(rate)) for k, v in enumerate(values, 1))
    return LabFile(path, columns, ("a WAV file holds fractions of the full scale, not the unit of a sensor",))
