"""Tables ``[[cut]]`` of a measurement of test cuts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.cuts.tried_cut import VERDICTS, TriedCut
from jointlib.errors import InputError
from jointlib.io.mistakes import Lost
from jointlib.io.tables.cut_table import cut_keys
from jointlib.io.toml import Section
from jointlib.measurement import RecordSource


def tried_cut(section: Section, shared: Mapping[str, Any]) -> TriedCut:
    """One cut, by its own keys over those of all."""
    name = section.text("name", None)
    verdict = section.text("verdict", None, choices=VERDICTS)
    frequency = section.number("chatter_frequency", "Hz", None)
    file, rows = section.path("file", None), section.take("rows", None)
    if rows is not None and not (isinstance(rows, list) and len(rows) == 2 and all(type(r) is int for r in rows)):
        section.fault(f"rows is {rows!r}, expected [first, end) of the record")
        rows = None
    own = {**shared, **cut_keys(section)}
    section.done()
    turning = own.get("process", "milling") == "turning"
    missing = [key for key in ("speed", "depth", *(() if turning else ("teeth",))) if key not in own]
    for key in missing:
        section.fault(f"{key} is missing, expected it in the cut or in [cutting]")
    if missing:
        raise Lost
    record = None if file is None else RecordSource(file, "fit", None if rows is None else (rows[0], rows[1]))
    try:
        return TriedCut(
            name or f"cut at {own['speed']:g} rpm, {1e3 * own['depth']:g} mm",
            own["speed"],
            own["depth"],
            1 if turning else own["teeth"],
            own.get("mode"),
            own.get("immersion"),
            own.get("feed"),
            verdict,
            frequency,
            record,
            own.get("diameter"),
            own.get("process", "milling"),
        )
    except InputError as error:
        raise InputError(*(f"{section.where}: {said}" for said in error.sentences)) from None


def records_of(cuts: Sequence[TriedCut]) -> list[RecordSource]:
    """The records that the cuts have."""
    return [cut.record for cut in cuts if cut.record is not None]
