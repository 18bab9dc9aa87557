"""What a number of the ``[cutting]`` table may be, refused in a sentence."""

from __future__ import annotations

import math
from numbers import Real

from jointlib.errors import InputError, nearest

_SOFTEST, _IN_MM = 1e6, 10.0
"""N/m²: no material cuts with less, and a coefficient between the two was meant in N/mm²."""


def refuse(said: list[str]) -> None:
    if said:
        raise InputError(*said)


def finite(key: str, value: object) -> float:
    if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
        raise InputError(f"[cutting]: {key} is {value!r}, expected a finite number in SI units")
    return float(value)


def positive(key: str, value: object) -> None:
    if finite(key, value) <= 0:
        raise InputError(f"[cutting]: {key} is {value!r}, expected more than 0")


def turned(key: str, value: object) -> None:
    if abs(finite(key, value)) > 2 * math.pi:
        raise InputError(
            f'[cutting]: {key} is {value!r} rad, expected at most a turn either way; in degrees it is "{value} deg"'
        )


def pressure(key: str, value: object) -> None:
    positive(key, value)
    if _IN_MM <= float(value) < _SOFTEST:  # type: ignore[arg-type]
        raise InputError(
            f"[cutting]: {key} is {value!r} N/m², far below any material; expected about 1e8 to 1e10: "
            f'if it is meant in N/mm², write {float(value) * 1e6:g} or "{value} N/mm^2"'  # type: ignore[arg-type]
        )


def word(key: str, value: object, valid: tuple[str, ...]) -> None:
    if value not in valid:
        raise InputError(f"[cutting]: {key} is {value!r}, {nearest(str(value), valid)}")


def speed_range(speed: object) -> tuple[float, float]:
    if not isinstance(speed, (tuple, list)) or len(speed) != 2:
        raise InputError(f"[cutting]: speed is {speed!r}, expected [low, high] in rpm")
    low, high = (finite("speed", value) for value in speed)
    if not 0 < low < high:
        raise InputError(f"[cutting]: speed is [{low:g}, {high:g}] rpm, expected 0 < low < high")
    return low, high
