"""Columns of clock times and dates, as loggers write them, in seconds since the first row."""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence

import numpy as np

from jointlib.arrays import Array

_TIME = (
    r"(?:(?P<minutes>\d{1,3}):(?P<after>\d{2}[.,]\d+)|"
    r"(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2}(?:[.,]\d+)?))?\s*(?P<half>[AaPp][Mm])?)"
)
_DATE = r"(?P<iso>\d{4}-\d{2}-\d{2})|(?P<dots>\d{1,2}\.\d{1,2}\.\d{4})|(?P<slashes>\d{1,4}/\d{1,2}/\d{1,4})"
CLOCK = re.compile(rf"(?:(?:{_DATE})[T ]\s*)?{_TIME}(?:Z|[+-]\d{{2}}:?\d{{2}})?")
"""A time of day, with or without its date; minutes and seconds where these have decimals."""
DATE = re.compile(_DATE)
_DAY = 86400.0


def seconds(cells: Sequence[str]) -> Array | None:
    """Seconds since the first cell; None where they are no clock times, or dates whose order nobody can tell."""
    out = np.empty(len(cells))
    days: dict[str, float | None] = {}
    first_day: str | None = None
    for i, cell in enumerate(cells):
        match = CLOCK.fullmatch(cell.strip())
        if match is None:
            return None
        of_day = _of_day(match)
        date = match["iso"] or match["dots"] or match["slashes"] or ""
        first_day = date if first_day is None else first_day
        if date not in days:
            days[date] = 0.0 if date == first_day else _days_between(first_day, date)
        day = days[date]
        if day is None:
            return None
        out[i] = day * _DAY + of_day
    return np.asarray(np.round(out - out[0], 9))


def _of_day(match: re.Match[str]) -> float:
    """Seconds since midnight, or since whenever minutes were counted from."""
    if match["minutes"]:
        return 60.0 * int(match["minutes"]) + float(match["after"].replace(",", "."))
    hour = int(match["h"]) % 12 + 12 * (match["half"].lower() == "pm") if match["half"] else int(match["h"])
    return 3600.0 * hour + 60.0 * int(match["m"]) + float((match["s"] or "0").replace(",", "."))


def _days_between(first: str, then: str) -> float | None:
    try:
        return float((_day(then) - _day(first)).days)
    except ValueError:
        return None


def _day(date: str) -> datetime.date:
    if "." in date:
        day, month, year = (int(part) for part in date.split("."))
        return datetime.date(year, month, day)
    return datetime.date.fromisoformat(date)
