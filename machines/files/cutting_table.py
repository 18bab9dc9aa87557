"""What a machine file says of the operation: tool, forces and band, the cut, and what it is compared with."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

from jointlib.cutting_force.cutting_file import read_cutting_file
from jointlib.errors import InputError, together
from jointlib.io.toml import Section
from jointlib.joint import Covariance

from ..components.beam import Beam
from ..components.component import Component
from ..cutting.process.cutting import Cutting
from ..model.machine import AXES, checked_forces, checked_range

CUTTING_UNITS = {
    "tangential": "N/m^2",
    "normal": "N/m^2",
    "specific": "N/m^2",
    "immersion": "1",
    "feed": "m",
    "diameter": "m",
    "flute_length": "m",
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
CUTTING_KEYS = ("process", "material", "file", "teeth", "mode", "speed", "pitch", "helix", "runout", *CUTTING_UNITS)
"""All keys of ``[cutting]``."""


def cutting_keys(section: Section) -> dict[str, Any]:
    """The keys of ``[cutting]`` in a table of a tool, unread."""
    found = {key: section.take(key) for key in CUTTING_KEYS if section.has(key)}
    section.done()
    return found


def laid_over(section: Section) -> Path:
    """The measurement of one ``[[compare]]`` or ``[[cuts]]``."""
    path = section.path("measurement")
    section.done()
    return path


def tool_of(section: Section) -> tuple[dict[str, str], str | None, str]:
    """Degrees of freedom of the tool by axis, which of several tools it is, and the table that tells it."""
    tool = {axis: section.text(axis) for axis in AXES if section.has(axis)}
    name = section.text("name", None)
    section.done()
    stands, key = {} if section.mistakes is None else section.mistakes.places, f": {AXES[0]}:"
    told = stands.get(f"{section.where}{key}", f"{section.where}{key}").removesuffix(key)
    return tool, name, told.removeprefix(section.where.removesuffix("[tool]"))


def response_of(section: Section) -> tuple[str | None, tuple[float, ...], tuple[float, float] | None, float]:
    """Drive, forces (N) and band (Hz), each where it is given, and the spindle speed (rpm)."""
    drive, force = section.text("drive", None), section.numbers("force", "N", ())
    frequency = section.numbers("frequency", "Hz", None, length=2)
    speed = section.number("speed", "rpm", 0.0)
    section.done()
    if not speed >= 0:
        section.fault(f"speed is {speed:g} rpm, expected at least 0")
    checks: list[Callable[[], object]] = [partial(checked_forces, force, section.where)] if force else []
    if frequency is not None:
        checks.append(partial(checked_range, frequency, section.where))
    together(*checks)
    return drive, force, None if frequency is None else (frequency[0], frequency[1]), speed


def cutting_of(section: Section) -> dict[str, Any]:
    """Fields of `Cutting`, in SI."""
    fields: dict[str, Any] = {"process": section.text("process"), **cutting_values(section)}
    if section.has("file"):
        fields = {**_of_file(section, fields), **fields}
    section.done()
    try:
        Cutting(**fields)
    except InputError as error:
        said = (text.removeprefix("[cutting]: ") for text in error.sentences)
        raise InputError(*(f"{section.where}: {text}" for text in said)) from None
    return fields


def with_flutes(cutting: dict[str, Any], components: Iterable[Component], tool: Iterable[str]) -> dict[str, Any]:
    """The table with how far the edges of a tool that is given by its sizes reach, where it does not tell itself."""
    own = {dof.partition(".")[0] for dof in tool}
    told = [part.flutes for part in components if isinstance(part, Beam) and part.flutes and part.name in own]
    if cutting["process"] != "milling" or "flute_length" in cutting or len(told) != 1:
        return cutting
    return {**cutting, "flute_length": told[0]}


def cutting_values(section: Section) -> dict[str, Any]:
    """What stands in the table itself, without the process, each value for itself."""
    fields: dict[str, Any] = {}
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
    return fields


def _of_file(section: Section, given: dict[str, Any]) -> dict[str, Any]:
    """Coefficients that the cutting file of the table tells and the table does not, with their covariance.

    In turning and boring the force along the chip thickness is the one that is fed back.
    """
    path = section.path("file")
    if not path.is_file():
        section.fault(f"file refers to {path}, which does not exist")
        return {}
    read = section.mistakes.attempt if section.mistakes is not None else lambda build: build()
    found = read(lambda: read_cutting_file(path))
    if found is None:
        return {}
    milled = given["process"] == "milling"
    if milled != (found.process == "milling"):
        section.fault(f"file holds coefficients of {found.process}, expected those of {given['process']}")
        return {}
    name_of = {"normal": "specific"} if not milled else {name: name for name in _MILLED}
    taken = {key: found.values[name] for name, key in name_of.items() if name in found.values and key not in given}
    known = found.covariance
    names = [name for name in (known.names if known is not None else ()) if name_of.get(name) in taken]
    if known is None or not names:
        return taken
    rows = [known.names.index(name) for name in names]
    return {**taken, "covariance": Covariance(tuple(name_of[n] for n in names), known.matrix[rows][:, rows])}


_MILLED = ("tangential", "normal", "edge_tangential", "edge_normal")
