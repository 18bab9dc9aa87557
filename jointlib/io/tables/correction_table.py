"""Tables ``[[correction]]`` of a measurement file: faults found earlier, and the masses that they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointlib.corrections import faults
from jointlib.errors import InputError, nearest
from jointlib.fault import Fault
from jointlib.io.toml import Section
from jointlib.measurement import Channel, Correction, Mass
from jointlib.path_fault import PathFault


def correction_of(
    section: Section, kind: str, channels: Sequence[Channel], unread: Sequence[Any], bodies: Mapping[str, Mass]
) -> Correction:
    known = faults(kind)
    family = section.text("family", choices=tuple(known))
    fault = known[family]
    on = fault.on if isinstance(fault, Fault) else "channel"
    sites: dict[str, str | None] = {key: section.text(key, None) for key in ("channel", "body") if key == on}
    units = {c.name: c.si_unit for c in channels}
    roles = {c.label: c.name for c in channels if c.label is not None}
    sites = {key: roles.get(site, site) if site is not None else None for key, site in sites.items()}
    for key, site in sites.items():
        if site is None:
            section.fault(f"{key} is missing, expected the {key} that has the {family}")
        valid = units if key == "channel" else bodies
        if site is not None and site not in valid and not (key == "channel" and unread):
            section.fault(f"{key} is {site!r}, {nearest(site, valid)}")
    own = units.get(sites.get("channel") or "", "1")
    values = {name: section.number(name, _unit(unit, own)) for name, unit in fault.parameters.items()}
    record = section.text("record", None)
    section.done()
    return Correction(family, sites.get("channel"), sites.get("body"), values, record)


def _unit(unit: str, of_channel: str) -> str:
    """SI unit of a parameter; "channel" in it stands for the unit of the channel."""
    return of_channel if unit == "channel" else unit.replace("channel", f"({of_channel})")


def mended(bodies: Mapping[str, Mass], corrections: Sequence[Correction], kind: str, where: str) -> Mapping[str, Mass]:
    """The masses with what was found to be missing, before anything uses them."""
    known = faults(kind) if corrections else {}
    for correction in corrections:
        fault = known[correction.family]
        if isinstance(fault, Fault) and fault.on == "body":
            try:
                bodies = fault.mended_masses(bodies, correction.site, correction.parameters)
            except InputError as error:
                raise InputError(f"{where}: {error}") from None
    return bodies


def carriage(declared: Mass | None, corrections: Sequence[Correction], kind: str) -> Mass | None:
    """What moves along a path, with the masses that were found to be missing."""
    known = faults(kind) if corrections else {}
    for correction in corrections:
        fault = known[correction.family]
        if isinstance(fault, PathFault) and fault.inertia:
            before = declared or Mass(0.0)
            declared = before if before.value is None else Mass(before.value + correction.parameters["mass"])
    return declared
