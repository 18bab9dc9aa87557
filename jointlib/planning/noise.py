"""Noise as it is given on the command line: a size with its unit, for one channel or all of a kind."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from jointlib.errors import InputError
from jointlib.units import number_and_unit, quantity

_DECIBEL = re.compile(r"\s*([+-]?[\d.]+)\s*dB\s*")


def noise_of(given: Sequence[str], units: Mapping[str, str]) -> tuple[dict[str, float], float | None]:
    """Standard deviations in SI by channel, and decibels below the signal where those are given.

    ``a1=0.02m/s^2`` is for one channel, ``0.02m/s^2`` for all channels of that unit, ``60dB`` for those not named.
    """
    found: dict[str, float] = {}
    wide: dict[str, float] = {}
    decibel = None
    for text in given:
        name, equals, value = text.rpartition("=")
        if equals and name not in units:
            raise InputError(f"--noise: no channel {name!r}, expected one of {', '.join(units)}")
        below = _DECIBEL.fullmatch(value)
        if below and not equals:
            decibel = float(below[1])
            if decibel <= 0:
                raise InputError(f"--noise: {text!r}, expected decibels below the signal above 0")
            continue
        parts = number_and_unit(value)
        if parts is None or not parts[1]:
            raise InputError(f"--noise: {text!r} has no unit, expected one as 0.02m/s^2, 0.1N, a1=0.02m/s^2 or 60dB")
        of = [name] if equals else list(units)
        fits = {n: x for n in of if (x := _in(value, units[n])) is not None}
        if not fits:
            expected = " or ".join(dict.fromkeys(units[n] for n in of))
            raise InputError(f"--noise: {text!r}, expected a unit like {expected}, or dB")
        if min(fits.values()) <= 0:
            raise InputError(f"--noise: {text!r}, expected noise above 0")
        (found if equals else wide).update(fits)
    return {**wide, **found}, decibel


def _in(value: str, unit: str) -> float | None:
    try:
        return quantity(value, unit, "--noise")
    except InputError:
        return None
