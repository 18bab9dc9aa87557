"""What a column measures: by its unit, else by its name, and what is guessed in that."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable

from jointlib.lab.unit_words import quantity_of, unit_of, without_unit
from jointlib.units import scale

_WORDS = (
    ("time", r"^(t|time|zeit|temps|tiempo|x_value|timestamp|elapsed|clock)$|^(time|zeit|temps)[ _]|[ _](time|zeit)$"),
    ("frequency", r"^(f|freq|frequency|frequenz|fr[eé]quence|hz)$|^freq|frequen"),
    ("acceleration", r"^(a\d*|ax|ay|az)$|\bacc|accel|beschl|^acc|_acc"),
    ("force", r"^(p|f\d*|f[xyzcfp]|force|kraft)$|force|kraft|hammer|load|\blast\b|impact"),
    ("velocity", r"^v\d*$|veloc|speed|geschw|\bvel"),
    ("displacement", r"^[zxy]\d*$|disp|defl|\bweg\b|verschiebung|auslenkung|travel|lvdt"),
    ("position", r"pos|\bq\w*\b"),
    ("temperature", r"temp"),
    ("voltage", r"volt|spannung|tension|^u\d*$"),
    ("current", r"current|strom|courant|corriente|^i\d*$"),
)
"""Words in a heading, and the quantity that they speak of; the first that fits."""


def by_name(heading: str) -> str | None:
    """The quantity that a heading speaks of."""
    word = without_unit(heading).casefold().strip()
    return next((quantity for quantity, words in _WORDS if re.search(words, word)), None)


_ANGLE = re.compile(r"(deg|°|rad|rev|rpm)((?:[/_]| per |p)s(?:ec)?)?", re.IGNORECASE)


def angle_at_end(heading: str) -> str:
    """The unit of an angle or of its rate that a heading ends in, as ``pos_deg`` and ``speed_rad_s``; else none."""
    found = re.search(f"_{_ANGLE.pattern}$", heading, re.IGNORECASE)
    return found[0][1:].replace("_", "/") if found else ""


def as_a_way(unit: str) -> tuple[float, str] | None:
    """Gain and unit that make an angle the way, or its rate the speed, at a lever of 1 m; None of any other unit."""
    found = _ANGLE.fullmatch(unit.strip())
    if found is None:
        return None
    word = found[1].casefold()
    if word == "rpm":
        return scale(word, "rad/s", unit), "m/s"
    return math.tau if word == "rev" else scale(word, "rad", unit), "m/s" if found[2] else "m"


def ending_unit(heading: str) -> str:
    """The unit that a heading ends in, as ``disp_in`` and ``t_s``, if what stands before it speaks of its quantity."""
    before, mark, ending = heading.rpartition("_")
    quantity = by_name(before)
    if mark and quantity == "temperature" and ending in ("C", "c"):
        return "degC"
    known = unit_of(ending) if mark else None
    like = "displacement" if quantity == "position" else quantity
    return ending if known is not None and quantity is not None and quantity_of(known) == like else ""


def by_unit(unit: str) -> str | None:
    """The quantity that a unit measures."""
    known = unit_of(unit) if unit else None
    return quantity_of(known) if known else None


def identifier(heading: str, taken: Iterable[str]) -> str:
    """A short name for a column, of letters, digits and underscores, unlike those that are taken."""
    plain = without_unit(heading).replace("µ", "u").replace("μ", "u").replace("ß", "ss")
    ascii_ = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
    word = re.sub(r"\W+", "_", ascii_).strip("_").lower() or "channel"
    held, number, name = set(taken), 2, word
    while name in held:
        name, number = f"{word}_{number}", number + 1
    return name
