"""What a file may say of flutes: pitches, helices, and what their flanks rub."""

from __future__ import annotations

import math
from numbers import Integral, Real

from jointlib.errors import InputError

UNLIKE = ("pitch", "helix", "process_damping", "indentation", "wear_land", "clearance")
"""Keys of a cut by edges that are not straight and even, or that rub."""
_ROUND, _EVEN = 0.01, 1e-7
"""Degrees by which pitches may miss a turn in all, and differ and still be the same."""


def uneven(pitch: tuple[float, ...] | None, helix: float | tuple[float, ...] | None) -> str:
    """What, in words, keeps teeth from following one another alike; empty where nothing does."""
    for several, words in ((pitch, "unequal pitches"), (helix, "a helix a flute")):
        if isinstance(several, tuple) and max(several) - min(several) > _EVEN:
            return words
    return ""


def unlike(pitch: tuple[float, ...] | None, helix: float | tuple[float, ...] | None, damping: float | None) -> str:
    """What, in words, makes a cut another than that of straight and even teeth that rub on nothing."""
    wound = any(helix) if isinstance(helix, tuple) else bool(helix)
    there = (bool(uneven(pitch, None)), wound, bool(damping))
    words = ("unequal pitches", "helix", "process damping")
    found = [word for word, one in zip(words, there, strict=True) if one]
    return " and ".join([", ".join(found[:-1]), found[-1]] if len(found) > 1 else found)


def checked_pitch(pitch: object, teeth: object) -> None:
    """Refuse pitches in degrees that are not one a tooth and 360 together."""
    if not isinstance(pitch, (tuple, list)):
        raise InputError(f"[cutting]: pitch is {pitch!r}, expected a list of angles in degrees, one a tooth")
    angles = [_number("pitch", angle) for angle in pitch]
    for angle in angles:
        if angle <= 0:
            raise InputError(f"[cutting]: pitch holds {angle:g} degrees, expected more than 0")
    if isinstance(teeth, Integral) and len(angles) != teeth:
        raise InputError(f"[cutting]: pitch has {len(angles)} angles, expected one a tooth, {teeth}")
    if abs(sum(angles) - 360) > _ROUND:
        raise InputError(f"[cutting]: pitch is {sum(angles):g} degrees in all, expected 360")


def checked_helix(helix: object, teeth: object, diameter: float | None) -> None:
    """Refuse helices in degrees that are not one for all or one a tooth, or that lack a diameter to wind round."""
    several = isinstance(helix, (tuple, list))
    each = [_number("helix", angle) for angle in (helix if isinstance(helix, (tuple, list)) else [helix])]
    for angle in each:
        if not 0 <= angle < 90:
            raise InputError(f"[cutting]: helix is {angle:g} degrees, expected from 0 to below 90")
    if several and isinstance(teeth, Integral) and len(each) != teeth:
        raise InputError(f"[cutting]: helix has {len(each)} angles, expected one, or one a tooth, {teeth}")
    if any(each) and diameter is None:
        raise InputError("[cutting]: helix needs 'diameter', of the cutter, which is missing")


def checked_runout(runout: object, teeth: object) -> None:
    """Refuse radii in m that are not one a tooth."""
    if not isinstance(runout, (tuple, list)):
        raise InputError(f"[cutting]: runout is {runout!r}, expected a list of radii in m beside the mean, one a tooth")
    for radius in runout:
        _number("runout", radius)
    if isinstance(teeth, Integral) and len(runout) != teeth:
        raise InputError(f"[cutting]: runout has {len(runout)} radii, expected one a tooth, {teeth}")


def checked_damping(damping: object, diameter: float | None) -> None:
    """Refuse process damping in N/m below 0, or without the diameter that the cutting speed follows from."""
    if _number("process_damping", damping) < 0:
        raise InputError(f"[cutting]: process_damping is {damping!r}, expected at least 0, in N/m")
    if damping and diameter is None:
        raise InputError(
            "[cutting]: process_damping needs 'diameter', of the cutter or in turning of the workpiece, for the "
            "cutting speed; it is missing"
        )


def _number(key: str, value: object) -> float:
    if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
        raise InputError(f"[cutting]: {key} is {value!r}, expected a finite number")
    return float(value)
