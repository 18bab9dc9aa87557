"""TDMS files of LabVIEW and DIAdem, read by npTDMS."""

from __future__ import annotations

import io
import logging
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.foreign.door import bytes_of, foreign
from jointlib.lab.lab_file import Column, LabFile, needed, refuse_twice
from jointlib.lab.sampling import rounded_rate

_UNITS = ("unit_string", "NI_UnitDescription", "unit", "Unit")


def read_tdms(path: Path) -> LabFile:
    """Channels by name, with their group before them where there are several groups."""
    nptdms = needed("nptdms", path)
    needed("nptdms.log", path).log_manager.set_level(logging.CRITICAL)  # what is wrong is said in our words
    data = bytes_of(path, "a TDMS file")

    def read() -> tuple[Any, list[Any], list[tuple[str, str, Any, dict[str, Any]]]]:
        file = nptdms.TdmsFile.read(io.BytesIO(data))
        groups = [group for group in file.groups() if group.channels()]
        return file, groups, [(group.name, c.name, c[:], c.properties) for group in groups for c in group.channels()]

    file, groups, found = foreign(path, "a TDMS file", read)
    if file.file_status.incomplete_final_segment:
        raise InputError(f"{path}: ends in the middle of its data, expected a whole TDMS file")
    columns = tuple(
        _column(f"{group}/{name}" if len(groups) > 1 else name, values, properties)
        for group, name, values, properties in found
        if np.asarray(values).dtype.kind in "fiu"
    )
    refuse_twice(path, (c.name for c in columns))
    others = [name for _, name, values, _ in found if np.asarray(values).dtype.kind not in "fiu"]
    notes = tuple(f"channel {name!r} holds no numbers and is left out" for name in others)
    return LabFile(path, columns, notes, grouped=len(groups) > 1)


def _column(name: str, values: Any, properties: dict[str, Any]) -> Column:
    step = properties.get("wf_increment")
    unit = next((str(properties[key]) for key in _UNITS if properties.get(key)), "")
    rate = rounded_rate(1 / float(step)) if isinstance(step, int | float) and step > 0 else None
    return Column(name, np.asarray(values, dtype=float), unit, rate=rate)
