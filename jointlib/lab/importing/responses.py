"""Records of measured frequency responses: where the force acts and what moves, which a file hardly says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jointlib.frf import Quantity
from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.lab.importing.signals import by_name
from jointlib.lab.lab_file import LabFile
from jointlib.lab.response_arrays import is_frequency
from jointlib.lab.response_columns import peak_over, quantity_of, role_of
from jointlib.units import scale


def holds_responses(file: LabFile) -> bool:
    """Whether a file holds frequency responses: those of a universal file, lines under a frequency, or complex numbers
    beside one."""
    if file.responses or (file.spectra and any(is_frequency(c.name) for c in file.columns)):
        return True
    return len(file.columns) >= 3 and by_name(file.columns[0].name) == "frequency"


def response_records(draft: Draft, files: Sequence[tuple[str, LabFile]]) -> None:
    """One record for every response of every file."""
    for written, file in files:
        pairs: Sequence[tuple[str, str] | None] = file.responses or (None,)
        for pair in pairs:
            table: Table = {"file": Noted(written)}
            at = f"record.{Path(written).stem}"
            several = pair is not None and len(file.responses) > 1
            for key, place in (("drive", pair[1] if pair else None), ("response", pair[0] if pair else None)):
                dof = f"node{place.replace('+', '.').replace('-', '.').lower()}" if place else "tool.x"
                why = f"the file says {place}" if place else "no file says the place in the machine"
                draft.guess(table, key, dof, why, f"{at}.{key}=tool.x")
            if pair is not None and several:
                table |= {"response_at": Noted(pair[0]), "drive_at": Noted(pair[1])}
            _force(draft, table, file, at, len(files) > 1)
            if pair is None:
                _quantity(draft, table, file, at)
            draft.records.append(table)


def _force(draft: Draft, table: Table, file: LabFile, at: str, several: bool) -> None:
    """What was asked of the shaker: the largest force of a column, as it loses some at a resonance."""
    column = next((c for c in file.columns if role_of(c.name) == "force"), None)
    if column is not None:
        over = peak_over(column.name)
        peak = over * float(np.max(column.values)) * scale(column.unit or "N", "N", f"{file.path}: {column.name!r}")
        times = " times √2" if over != 1.0 else ""
        # Two digits: records asked for one force are repeats of each other.
        table["force"] = Noted(
            f"{float(f'{peak:.2g}'):g} N", f"largest of {column.name!r}{times}, which tells that of each line"
        )
        return
    why = "no file says the peak of the force"
    if several:
        why += "; records with one force count as repeats, and what depends on its size as their noise"
    draft.guess(table, "force", "1 N", why, f"{at}.force='10 N'")


def _quantity(draft: Draft, table: Table, file: LabFile, at: str) -> None:
    heads = " ".join(name.casefold() for name in (*(c.name for c in file.columns), *file.spectra))
    found = next((of_unit[1].word for c in file.columns if (of_unit := quantity_of(c.unit)) is not None), None)
    named = next((q.word for q in Quantity if q.word in heads), None)
    if found or named:
        table["quantity"] = Noted(found or named)
    else:
        draft.guess(table, "quantity", "receptance", "neither headings nor units tell it", f"{at}.quantity=accelerance")
