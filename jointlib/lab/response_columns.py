"""Frequency responses in columns as analysers write them: real and imaginary, or magnitude and phase, in any unit."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import Quantity
from jointlib.units import scale

_ROLES = {
    "frequency": r"^(f|freq\w*|frequenz|fr[ée]quence)$",
    "real": r"^(re|real\w*|realteil|réel\w*)$",
    "imaginary": r"^(im|imag\w*|imaginärteil)$",
    "magnitude": r"^(mag\w*|amp\w*|abs\w*|betrag|modulus|module|level|gain|\|h\||h)$",
    "phase": r"^(ph\w*|arg\w*|angle|winkel)$",
    "variance": r"^variance$",
    "deviation": r"^deviation$",
    "alike": r"^alike$",
    "force": r"^(force|kraft|effort)$",
    "coherence": r"^(coh\w*|koh\w*|gamma2?|γ²?)$",
}
_BRACKETS = re.compile(r"[\[(]([^\[\]]*)[\])]\s*$")
_DECIBELS = re.compile(r"db(?:\s*(?:ref|rel|re)\.?\s*(?:1\s*)?(.*))?$", re.IGNORECASE)
_RMS = re.compile(r"(?<![^\W_])(rms|r\.m\.s\.|effektiv|eff\.?)(?![^\W_])", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]+|\|h\|", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Response:
    """One response; values in SI where the headings say a unit, else as they stand."""

    frequency: Array
    value: ComplexArray
    variance: Array | None
    quantity: Quantity | None
    unit: str
    """As the headings say it; empty where they say none."""
    alike: Array | None = None
    """Lines that err together with each."""
    force: Array | None = None
    """N, peak of the force that each line was measured with."""


def response_of(path: Path, columns: Mapping[str, Array], units: Sequence[str]) -> Response | None:
    """The response that headings tell; None where they do not, so that the order of the columns must.

    Two readings of a phase, in degrees or in radians, are refused where neither its unit nor its range decides.
    """
    found: dict[str, tuple[Array, str, str]] = {}
    for (heading, values), unit in zip(columns.items(), units, strict=True):
        role = role_of(heading)
        if role is None or role in found:
            continue
        bracket = _BRACKETS.search(heading)
        found[role] = values, (unit or (bracket[1] if bracket else "")).strip(), heading
    if "frequency" not in found:
        return None
    if {"real", "imaginary"} <= found.keys():
        parts = [found["real"], found["imaginary"]]
        if parts[0][1] != parts[1][1]:
            raise InputError(f"{path}: {parts[0][2]!r} and {parts[1][2]!r} have two units, expected one")
        factor, quantity = _of_unit(path, parts[0][1], parts[0][2])
        value: ComplexArray = np.asarray(factor * (parts[0][0] + 1j * parts[1][0]))
        unit = parts[0][1]
    elif {"magnitude", "phase"} <= found.keys():
        size, unit, heading = found["magnitude"]
        decibels = _DECIBELS.match(unit)
        if decibels is not None:
            unit, size = (decibels[1] or "").strip(" ()[]"), 10 ** (size / 20)
        elif np.any(size < 0):
            raise InputError(
                f"{path}: {heading!r} has values below 0, expected a magnitude, or its unit in the heading: "
                f"{heading.strip()} [dB]"
            )
        factor, quantity = _of_unit(path, unit, heading)
        value = np.asarray(factor * size * np.exp(1j * _phase(path, *found["phase"])))
    else:
        return None
    alike = found["alike"][0] if "alike" in found else None
    if alike is not None and not np.all((alike >= 1) & np.isfinite(alike)):
        raise InputError(f"{path}: 'alike' is {np.min(alike):g}, expected how many lines err together, 1 or more")
    frequency, variance = _frequency(path, *found["frequency"]), _variance(path, found, factor)
    return Response(frequency, value, variance, quantity, unit, alike, _force(path, found))


def _force(path: Path, found: Mapping[str, tuple[Array, str, str]]) -> Array | None:
    if "force" not in found:
        return None
    values, unit, heading = found["force"]
    return np.asarray(values * peak_over(heading) * (scale(unit, "N", f"{path}: {heading!r}") if unit else 1.0))


def peak_over(heading: str) -> float:
    """Peak of a sine over what a column with this heading holds: √2 where it says rms, else 1."""
    return float(np.sqrt(2)) if _RMS.search(heading) else 1.0


def role_of(heading: str) -> str | None:
    """What a column is, by the words of its heading before its unit; an H beside another one is but a name."""
    words = _WORD.findall(_BRACKETS.sub("", heading))
    for word in sorted(words, key=lambda word: word.casefold() == "h"):
        for role, pattern in _ROLES.items():
            if re.match(pattern, word, re.IGNORECASE):
                return role
    return None


def quantity_of(unit: str) -> tuple[float, Quantity] | None:
    """SI over a unit of motion over force, as ``um/N`` or ``g/N``, and what it is of; None for another unit."""
    plain = re.sub(r"[()\s]", "", unit).replace("²", "^2").replace("\u03bc", "µ").replace("·", "*")
    for quantity in Quantity:
        try:
            return scale(plain, quantity.value, ""), quantity
        except InputError:
            continue
    return None


def _of_unit(path: Path, unit: str, heading: str) -> tuple[float, Quantity | None]:
    """SI over a unit of motion over force, and what it is of."""
    if not unit or unit in ("-", "1"):
        return 1.0, None
    found = quantity_of(unit)
    if found is not None:
        return found
    raise InputError(f"{path}: {heading!r} is in {unit!r}, expected motion over force, such as um/N, mm/s/N or g/N")


def _frequency(path: Path, values: Array, unit: str, heading: str) -> Array:
    if unit.casefold() in ("rad/s", "1/s"):
        return np.asarray(values / (2 * np.pi))
    if unit.casefold() in ("rpm", "1/min"):
        return np.asarray(values / 60)
    word = {"hz": "Hz", "khz": "kHz", "": "Hz"}.get(unit.casefold())
    if word is None:
        raise InputError(f"{path}: {heading!r} is in {unit!r}, expected Hz, kHz, rad/s or rpm")
    return np.asarray(values * scale(word, "Hz", str(path)))


def _phase(path: Path, values: Array, unit: str, heading: str) -> Array:
    word = unit.casefold()
    if word in ("rad", "radian", "radians"):
        return values
    if word in ("deg", "°", "grad", "degree", "degrees"):
        return np.asarray(np.deg2rad(values))
    if word:
        raise InputError(f"{path}: {heading!r} is in {unit!r}, expected deg or rad")
    if np.ptp(values) > 2 * np.pi:
        return np.asarray(np.deg2rad(values))
    raise InputError(
        f"{path}: {heading!r} runs from {np.min(values):g} to {np.max(values):g}, which may be degrees or radians; "
        f"expected its unit in the heading: {heading.strip()} [deg] or {heading.strip()} [rad]"
    )


def _variance(path: Path, found: Mapping[str, tuple[Array, str, str]], factor: float) -> Array | None:
    if "variance" in found:
        return np.asarray(found["variance"][0] * factor**2)
    if "deviation" not in found:
        return None
    deviation = found["deviation"][0]
    if not np.all(deviation >= 0):
        raise InputError(f"{path}: a deviation is {np.min(deviation):g}, expected at least 0")
    return np.asarray((deviation * factor) ** 2)
