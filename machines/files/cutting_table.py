"""What a machine file says of the operation: tool, forces and band, the cut, and what it is compared with."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from jointlib.errors import InputError, together
from jointlib.io.toml import Section

from ..cutting.process.cutting import Cutting
from ..model.machine import AXES, checked_forces, checked_range

CUTTING_UNITS = {
    "tangential": "N/m^2",
    "normal": "N/m^2",
    "specific": "N/m^2",
    "immersion": "1",
    "feed": "m",
    "diameter": "m",
    "exponent": "1",
    "feed_direction": "rad",
    "process_damping": "N/m",
    "indentation": "N/m^3",
    "wear_land": "m",
    "clearance": "deg",
    "edge_tangential": "N/m",
    "edge_normal": "N/m",
}
"""Keys of ``[cutting]`` that are numbers, and their units."""
CUTTING_KEYS = ("process", "material", "teeth", "mode", "speed", "pitch", "helix", "runout", *CUTTING_UNITS)
"""All keys of ``[cutting]``."""


def laid_over(section: Section) -> Path:
    """The measurement of one ``[[compare]]``."""
    path = section.path("measurement")
    section.done()
    return path


def tool_of(section: Section) -> tuple[dict[str, str], str | None]:
    """Degrees of freedom of the tool by axis, and which of several tools it is."""
    tool = {axis: section.text(axis) for axis in AXES if section.has(axis)}
    name = section.text("name", None)
    section.done()
    return tool, name


def response_of(section: Section) -> tuple[str | None, tuple[float, ...], tuple[float, float] | None]:
    """Drive, forces (N) and band (Hz), each where it is given."""
    drive, force = section.text("drive", None), section.numbers("force", "N", ())
    frequency = section.numbers("frequency", "Hz", None, length=2)
    section.done()
    checks: list[Callable[[], object]] = [partial(checked_forces, force, section.where)] if force else []
    if frequency is not None:
        checks.append(partial(checked_range, frequency, section.where))
    together(*checks)
    return drive, force, None if frequency is None else (frequency[0], frequency[1])


def cutting_of(section: Section) -> dict[str, Any]:
    """Fields of `Cutting`, in SI."""
    fields: dict[str, Any] = {"process": section.text("process")}
    if section.has("teeth"):
        fields["teeth"] = section.integer("teeth", lower=1, upper=1000)
    if section.has("material"):
        fields["material"] = section.text("material")
    if section.has("mode"):
        fields["mode"] = section.text("mode")
    for key, unit in CUTTING_UNITS.items():
        if section.has(key):
            fields[key] = section.number(key, unit)
    if section.has("pitch"):
        fields["pitch"] = section.numbers("pitch", "deg")
    if section.has("runout"):
        fields["runout"] = section.numbers("runout", "m")
    if section.has("helix"):
        several = isinstance(section.table.get("helix"), list)
        fields["helix"] = section.numbers("helix", "deg") if several else section.number("helix", "deg")
    if section.has("speed"):
        fields["speed"] = section.numbers("speed", "rpm", length=2)
    section.done()
    try:
        Cutting(**fields)
    except InputError as error:
        said = (text.removeprefix("[cutting]: ") for text in error.sentences)
        raise InputError(*(f"{section.where}: {text}" for text in said)) from None
    return fields
