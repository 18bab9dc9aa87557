"""At which rate the samples of a file were taken: its time column, its header, or the lines above its table."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.lab.importing.preamble import rates_above
from jointlib.lab.importing.signals import by_name, by_unit, ending_unit
from jointlib.lab.lab_file import Column, LabFile
from jointlib.lab.numerals import Numerals
from jointlib.lab.sampling import rate_of_times, refuse_gap, rounded_rate
from jointlib.lab.unit_words import unit_of

_AGREE = 1e-3
_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}


@dataclass(frozen=True)
class Clock:
    """Rate in Hz, None where nothing tells it; who told it; the column of times, empty where there is none."""

    rate: float | None
    told_by: str
    column: str = ""
    assumed: str = ""
    """What is guessed of the column."""


def clock_of(file: LabFile, units: Mapping[str, str], said: float | None = None) -> Clock:
    """The clock of a file; sources that differ are refused, ``said`` stands above all."""
    column = _times(file, units)
    name = column.name if column is not None else ""
    told: list[tuple[float, str]] = []
    assumed = ""
    if column is not None:
        unit = unit_of(units.get(name, "") or column.unit or ending_unit(name)) or ""
        is_clock = file.table is not None and name in file.table.clocks
        if unit not in _SECONDS and not is_clock:
            assumed = f"the times in column {name!r} are taken as seconds"
        what = f"{file.path}: the time in column {name!r}"
        scaled: Array = column.values * (1.0 if is_clock else _SECONDS.get(unit, 1.0))
        if said is not None:
            refuse_gap(scaled, what)
        else:
            told.append((_rate(scaled, what), f"column {name!r}"))
    if said is not None:
        return Clock(said, "as set", name)
    told += [(c.rate, f"channel {c.name!r}") for c in file.columns if c.rate is not None]
    if file.table is not None:
        numerals: Numerals = file.table.reading.numerals
        told += [(rate, f"line {line!r}") for rate, line in rates_above(file.table.above, numerals)]
    for rate, source in told:
        if not 0 < rate < math.inf:
            raise InputError(f"{file.path}: {rate:g} Hz by {source}, expected a rate above 0 (or --set sample_rate=…)")
        if abs(rate / told[0][0] - 1) > _AGREE:
            said_by = f"{told[0][0]:g} Hz by {told[0][1]} and {rate:g} Hz by {source}"
            raise InputError(f"{file.path}: two sample rates, {said_by}, expected one (or --set sample_rate=…)")
    if not told:
        return Clock(None, "", name)
    best = next((t for t in told if not t[1].startswith("column")), told[0])
    return Clock(rounded_rate(best[0]), best[1], name, assumed)


def _rate(time: Array, what: str) -> float:
    try:
        return rate_of_times(time, what)
    except InputError as error:
        uneven = "uneven" in str(error)
        raise InputError(f"{error}{' (--set sample_rate=… takes them as even)' if uneven else ''}") from None


def _times(file: LabFile, units: Mapping[str, str]) -> Column | None:
    """The column of times: clock times, else by its heading or unit; of several the first that rises evenly, as a
    controller writes its own beside that of the recorder."""
    clocks = file.table.clocks if file.table is not None else ()
    timed = [c for c in file.columns if c.name in clocks]
    timed += [c for c in file.columns if by_unit(units.get(c.name, "") or c.unit) == "time"]
    silent = [c for c in file.columns if not (units.get(c.name, "") or c.unit)]
    timed += [c for c in silent if by_name(c.name) == "time" or by_unit(ending_unit(c.name)) == "time"]
    return next((c for c in timed if _is_even(c.values)), next(iter(timed), None))


def _is_even(time: Array) -> bool:
    try:
        rate_of_times(time, "")
    except InputError:
        return False
    return True
