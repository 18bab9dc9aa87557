"""A table ``[[channel]]`` of a measurement file: which column it is, and what a number in it means."""

from __future__ import annotations

from jointlib.cutting_force.cut import AXES
from jointlib.io.key_places import OF_CHANNEL, refuse_elsewhere
from jointlib.io.toml import Section
from jointlib.lab.unit_words import bracketed, electric, quantity_of, sensor_units, unit_of
from jointlib.measurement import FORCES, QUANTITIES, Channel

CHANNEL_ROLES = {
    "rig": ("a1", "a2", "a3", "P"),
    FORCES: tuple(dict.fromkeys(axis for axes in AXES.values() for axis in axes)),
}
"""What a channel can be to a kind of measurement that knows its channels by name; others know them by quantity."""
_POUNDS = ("lbf", "lb", "lbs", "pound", "pounds", "kip", "ozf")
_DIRECTIONS = tuple(f"{sign}{axis}" for sign in ("", "+", "-") for axis in "xyz")
_KELVIN = {"degC": (1.0, 273.15), "degF": (5 / 9, 459.67 * 5 / 9)}
"""Factor and offset to K of units whose zero is another."""


def channel_of(section: Section, kind: str) -> Channel:
    """The channel that a table declares: value in SI = factor · column + offset."""
    name = section.text("name")
    role = section.text("role", None, choices=CHANNEL_ROLES.get(kind, ()))
    column = section.text("column", None) or name
    quantity = section.text("quantity", choices=tuple(QUANTITIES))
    si = QUANTITIES[quantity]
    sensitivity = section.text("sensitivity", None)
    offset, silent = 0.0, not section.has("unit")
    if sensitivity is not None:
        unit, factor = _sensed(section, sensitivity, si)
    else:
        unit = section.text("unit", si)
        if kind == FORCES and unit in _POUNDS:
            section.fault(
                f"unit is {unit!r}, expected N or kN: a coefficient is a force over an area in SI (1 lbf is 4.44822 N: "
                'unit = "N" with gain = 4.44822)'
            )
            unit = si
        read = unit_of(unit) if quantity_of(unit_of(unit) or "") in (quantity, _ALIKE.get(quantity)) else None
        if kind == "path" and unit == "V" and si != "V":
            # A circuit in volts stands for displacement and force: consistent units are enough there.
            si, factor = unit, 1.0
        elif read in _KELVIN:
            factor, offset = _KELVIN[read]
        else:
            factor = section.scale("unit", read or unit, si)
    heading = bracketed(column)
    if silent and unit_of(heading) not in (None, unit_of(unit)):
        section.fault(f"unit is not given and the heading {column!r} says {heading!r}, expected unit = {heading!r}")
    direction = section.text("direction", None, choices=_DIRECTIONS)
    full_scale = section.number("range", "1", None)
    if full_scale is not None and full_scale <= 0:
        section.fault(f"range is {full_scale:g}, expected a positive full scale")
    gain = section.number("gain", "1", 1.0)
    if gain == 0:
        section.fault(f"gain is 0, expected a factor from the column to {unit}")
    channel = Channel(
        name=role or name,
        quantity=quantity,
        unit=unit,
        si_unit=si,
        factor=factor * gain * (-1.0 if (direction or "").startswith("-") else 1.0),
        body=section.text("body", None),
        full_scale=None if full_scale is None else full_scale * factor,
        remove_mean=section.flag("remove_mean"),
        is_input=section.flag("input"),
        column=column,
        label=name,
        offset=offset,
        dof=section.text("dof", None),
        transfer=section.path("transfer", None),
    )
    refuse_elsewhere(section, kind, OF_CHANNEL)
    section.done()
    return channel


_ALIKE = {"position": "displacement"}
"""Quantities that are told in the units of another."""


def _sensed(section: Section, sensitivity: str, si: str) -> tuple[str, float]:
    """Unit of the column, and SI over it, of a sensor that gives so much per unit, as ``100 mV/g`` or ``4 pC/N``, or
    of a motor that gives so much for its current, as ``14.7 N/A``."""
    sensor = sensor_units(sensitivity)
    if sensor is None or not sensor[0]:
        section.fault(
            f"sensitivity is {sensitivity!r}, expected volts, coulombs or amperes per unit, as '100 mV/g', or a unit "
            "per ampere, as '14.7 N/A'",
            sure=True,
        )
        return section.text("unit", "V"), 1.0
    number, given, per, inverse = sensor
    raw = electric(given) or "V"
    over = section.scale("sensitivity", given, raw)
    under = section.scale("sensitivity", unit_of(per) or per, si)
    unit = section.text("unit", raw)
    scale = section.scale("unit", unit, raw)
    return unit, scale * number * under / over if inverse else scale / (number * over / under)
