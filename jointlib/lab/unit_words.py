"""Units as laboratories write them, and what they say of the quantity."""

from __future__ import annotations

import re

from jointlib.units import number_and_unit

_PLAIN = {
    "g": "g_0",
    "gn": "g_0",
    "g_n": "g_0",
    "g0": "g_0",
    "g_0": "g_0",
    "mg": "mg_0",
    "m/s²": "m/s^2",
    "m/s2": "m/s^2",
    "m/s^2": "m/s^2",
    "m/s**2": "m/s^2",
    "m/s/s": "m/s^2",
    "m/sec2": "m/s^2",
    "m/sec^2": "m/s^2",
    "m s-2": "m/s^2",
    "ms-2": "m/s^2",
    "ms^-2": "m/s^2",
    "m s^-2": "m/s^2",
    "m·s⁻²": "m/s^2",
    "m*s^-2": "m/s^2",
    "m*s-2": "m/s^2",
    "m·s^-2": "m/s^2",
    "m·s-2": "m/s^2",
    "m.s-2": "m/s^2",
    "m.s^-2": "m/s^2",
    "mps2": "m/s^2",
    "mm/s²": "mm/s^2",
    "mm/s2": "mm/s^2",
    "mm/s^2": "mm/s^2",
    "in/s²": "inch/s^2",
    "in/s2": "inch/s^2",
    "in/s^2": "inch/s^2",
    "m/s": "m/s",
    "m/sec": "m/s",
    "mm/s": "mm/s",
    "um/s": "um/s",
    "in/s": "inch/s",
    "ips": "inch/s",
    "m/min": "m/min",
    "mm/min": "mm/min",
    "m": "m",
    "meter": "m",
    "meters": "m",
    "mm": "mm",
    "millimeter": "mm",
    "millimeters": "mm",
    "um": "um",
    "µm": "um",
    "μm": "um",
    "micron": "um",
    "microns": "um",
    "nm": "nm",
    "in": "inch",
    "inch": "inch",
    "mil": "thou",
    "mils": "thou",
    "n": "N",
    "newton": "N",
    "newtons": "N",
    "kn": "kN",
    "kilonewton": "kN",
    "kilonewtons": "kN",
    "mn": "mN",
    "lbf": "lbf",
    "lb": "lbf",
    "lbs": "lbf",
    "kgf": "kgf",
    "kp": "kgf",
    "v": "V",
    "volt": "V",
    "volts": "V",
    "mv": "mV",
    "uv": "uV",
    "µv": "uV",
    "a": "A",
    "amp": "A",
    "amps": "A",
    "ampere": "A",
    "amperes": "A",
    "ma": "mA",
    "k": "K",
    "°c": "degC",
    "degc": "degC",
    "deg_c": "degC",
    "deg c": "degC",
    "celsius": "degC",
    "°f": "degF",
    "degf": "degF",
    "deg_f": "degF",
    "deg f": "degF",
    "fahrenheit": "degF",
    "s": "s",
    "sec": "s",
    "second": "s",
    "seconds": "s",
    "sek": "s",
    "ms": "ms",
    "msec": "ms",
    "us": "us",
    "µs": "us",
    "min": "min",
}
"""The unit as this program takes it, by what people write in small letters."""
_OF = {
    "acceleration": {"g_0", "mg_0", "m/s^2", "mm/s^2", "inch/s^2"},
    "velocity": {"m/s", "mm/s", "um/s", "inch/s", "m/min", "mm/min"},
    "displacement": {"m", "mm", "um", "nm", "inch", "thou"},
    "force": {"N", "kN", "mN", "lbf", "kgf"},
    "voltage": {"V", "mV", "uV"},
    "current": {"A", "mA"},
    "temperature": {"K", "degC", "degF"},
    "time": {"s", "ms", "us", "min"},
}
_FREQUENCY = {"hz": "Hz", "khz": "kHz"}
_OTHER = {"-", "1", "%", "rad", "deg", "°", "rpm", "1/min", "bar", "pa", "mpa", "kpa", "nm/rad", "dim", "pc"}
_BRACKETS = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)")
_IN = re.compile(r"(?:\s+in\s+|\s*/\s*)\(?([^\s()/]+(?:/[^\s()]+)?)\)?$")


def unit_of(text: str) -> str | None:
    """The unit that a word stands for, as this program takes it; None where it is none that a channel can have."""
    word = text.strip().strip('"').strip("[]() ").replace("\u03bc", "µ")
    if word in ("MN", "mN"):
        return {"MN": "MN", "mN": "mN"}[word]
    if word == "G":
        return "g_0"
    if electric(word) == _TORQUE:
        return None  # Nm are no nanometres.
    return _PLAIN.get(word.casefold().replace("\u03bc", "µ"))


def quantity_of(unit: str) -> str | None:
    """The quantity that a unit measures."""
    return next((quantity for quantity, units in _OF.items() if unit in units), None)


_BARE = str.maketrans("", "", "()")
_ELECTRIC = re.compile(r"[munpkµ]?([VCA])")
_TORQUE = "N m"
_TORQUES = re.compile(r"N[ ·*.⋅-]?[mM]")


def electric(unit: str) -> str | None:
    """V, C or A of a unit of voltage, charge or current, N m of a torque, which drives tell as they do currents, and %;
    None of any other."""
    if unit.strip() == "%":
        return "%"
    if _TORQUES.fullmatch(unit.strip()):
        return _TORQUE
    match = _ELECTRIC.fullmatch(unit.strip().replace("\u03bc", "µ"))
    return match[1] if match else None


def sensor_units(sensitivity: str) -> tuple[float, str, str, bool] | None:
    """Number, electrical and mechanical unit of a sensor's ``100 mV/g``, or of a motor's ``14.7 N/A``, ``628 N/(N m)``
    or ``24 N/%``, and whether the mechanical one comes first; None where no such ratio stands there."""
    parts = number_and_unit(sensitivity)
    over, _, under = (part.strip() for part in (parts[1] if parts else "").translate(_BARE).partition("/"))
    if parts is None or not over or not under:
        return None
    over, under = (_TORQUE if electric(part) == _TORQUE else part for part in (over, under))
    if electric(over):
        return parts[0], over, under, False
    return (parts[0], under, over, True) if electric(under) else None


def is_unit(text: str) -> bool:
    """Whether a word is a unit, of a channel or of something else."""
    word = text.strip().strip("[]() ")
    folded = word.casefold()
    return (
        unit_of(word) is not None
        or electric(word) == _TORQUE
        or folded in _FREQUENCY
        or folded in _OTHER
        or _ratio(word)
    )


def _ratio(word: str) -> bool:
    """One unit over another, as ``m/N`` or ``g/N``."""
    over, slash, under = word.partition("/")
    return bool(slash) and unit_of(over) is not None and unit_of(under) is not None


def bracketed(name: str) -> str:
    """The unit that a heading says, in brackets or behind ``in`` or a stroke; empty where it says none."""
    inside = [m[1] if m[1] is not None else m[2] for m in _BRACKETS.finditer(name)]
    for text in reversed(inside):
        if is_unit(text):
            return text.strip()
    if inside and name.strip().endswith("]"):
        return inside[-1].strip()
    match = _IN.search(name.strip())
    return match[1] if match and is_unit(match[1]) else ""


def without_unit(name: str) -> str:
    """A heading without its unit."""
    unit = bracketed(name)
    if not unit:
        return name.strip()
    cut = re.sub(rf"\s*[\[(]\s*{re.escape(unit)}\s*[\])]", "", name)
    if cut == name:
        match = _IN.search(name.strip())
        cut = name.strip()[: match.start()] if match else name
    return cut.strip() or name.strip()
