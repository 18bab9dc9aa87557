"""Records of measured frequency responses: where the force acts and what moves, which a file hardly says."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from jointlib.errors import InputError
from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.lab.importing.signals import by_name
from jointlib.lab.lab_file import LabFile
from jointlib.units import scale

_QUANTITIES = {"m/N": "receptance", "m/s/N": "mobility", "m/s^2/N": "accelerance"}


def holds_responses(file: LabFile) -> bool:
    """Whether a file holds frequency responses: those of a universal file, or lines under a frequency."""
    if file.responses:
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
            draft.guess(table, "force", "1 N", "no file says the peak of the force", f"{at}.force='10 N'")
            if pair is None:
                _quantity(draft, table, file, at)
            draft.records.append(table)


def of_unit(unit: str) -> str | None:
    """What a unit of motion over force says, ``um/N`` as well as ``m/N``."""
    plain = re.sub(r"[()\s]", "", unit).replace("²", "^2").replace("\u03bc", "µ").replace("·", "*")
    for known, quantity in _QUANTITIES.items():
        with suppress(InputError):
            scale(plain, known, "")
            return quantity
    return None


def _quantity(draft: Draft, table: Table, file: LabFile, at: str) -> None:
    heads = " ".join(c.name.casefold() for c in file.columns)
    found = next((q for c in file.columns if (q := of_unit(c.unit)) is not None), None)
    named = next((q for q in _QUANTITIES.values() if q in heads), None)
    if found or named:
        table["quantity"] = Noted(found or named)
    else:
        draft.guess(table, "quantity", "receptance", "neither headings nor units tell it", f"{at}.quantity=accelerance")
