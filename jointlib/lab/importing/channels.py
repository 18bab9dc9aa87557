"""The channels of a measurement file from the columns of the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.lab.importing.draft import Draft, Noted, Table
from jointlib.lab.importing.signals import angle_at_end, as_a_way, by_name, by_unit, ending_unit, identifier
from jointlib.lab.lab_file import Column, LabFile
from jointlib.lab.unit_words import electric, quantity_of, sensor_units, unit_of
from jointlib.measurement import QUANTITIES

_OTHER = {
    "acceleration": "g",
    "velocity": "mm/s",
    "displacement": "um",
    "position": "mm",
    "force": "kN",
    "temperature": "degC",
}
"""A unit to show how another one is said."""
_DRIVEN = {
    "A": ("a current", "14.7 N/A"),
    "N m": ("a torque; of a screw 2π over its lead", "628 N/(N m)"),
    "%": ("in per cent of a rated value", "24 N/%"),
    "V": ("in volts", "2.3 mV/N"),
    "C": ("a charge", "4 pC/N"),
}
"""What a column is that a force may be told by, and how that is said."""


def channels_of(
    draft: Draft, files: Sequence[LabFile], clock: str, units: Mapping[str, str], said: Mapping[str, Mapping[str, Any]]
) -> dict[str, Array]:
    """Fill ``draft.channels`` from the columns of the first file; the samples of every channel by its name."""
    first = files[0]
    called: dict[str, Column] = {}
    for column in first.columns:
        called[identifier(column.name, called)] = column
    settings = _by_column(said, called)
    told = {c.name: units.get(c.name, "") or c.unit or angle_at_end(c.name) for c in first.columns}
    has_force = any(by_unit(unit) == "force" for unit in told.values())
    values: dict[str, Array] = {}
    for name, column in called.items():
        if column.name == clock and name not in settings:
            continue
        why_not = _unusable(column, files)
        if why_not and name not in settings:
            draft.guesses.append(f"column {column.name!r} {why_not} and is left out")
            continue
        unit = told[column.name]
        if by_unit(unit) == "time" and np.any(np.diff(column.values) <= 0):
            draft.guesses.append(f"column {column.name!r} is a time that stands still between samples and is left out")
            continue
        if _counts(column, unit) and name not in settings:
            draft.guesses.append(f"column {column.name!r} counts the rows and is left out")
            continue
        if by_unit(unit) == "current" and name not in settings and not has_force:
            draft.guesses.append(f"column {column.name!r} {_driven(unit, f'channel.{name}')} and is left out")
            continue
        table = _channel(draft, name, column, unit, settings.get(name, {}))
        if table is not None:
            draft.channels.append(table)
            values[str(table["name"].value)] = column.values
    for name, x in values.items():
        if not np.any(x):
            draft.guesses.append(
                f"channel {name!r} is zero throughout in {first.path.name}: a sensor that is not connected?"
            )
        elif len(x) > 1 and np.ptp(x) == 0:
            draft.guesses.append(
                f"channel {name!r} is {x[0]:g} throughout in {first.path.name}: a sensor that does not move?"
            )
    return values


def _by_column(said: Mapping[str, Mapping[str, Any]], called: Mapping[str, Column]) -> dict[str, dict[str, Any]]:
    """Settings by the short name of their column, which may also be told by its heading."""
    found: dict[str, dict[str, Any]] = {}
    heads = {column.name: name for name, column in called.items()}
    for name, values in said.items():
        key = name if name in called else heads.get(name)
        if key is None:
            raise InputError(f"--set channel.{name}: no such channel, {nearest(name, called)}")
        found.setdefault(key, {}).update(values)
    return found


def _counts(column: Column, unit: str) -> bool:
    """Whether a column without a unit, whose name speaks of no quantity, rises by one from row to row."""
    silent = not (unit or column.quantity or by_name(column.name))
    return silent and len(column.values) > 2 and bool(np.all(np.diff(column.values) == 1))


def _unusable(column: Column, files: Sequence[LabFile]) -> str:
    """Why a column cannot be a channel; empty where it can."""
    for file in files:
        x = file.arrays()[column.name]
        bad = np.flatnonzero(~np.isfinite(x))
        if bad.size:
            count = f" and {bad.size - 1} more" if bad.size > 1 else ""
            return f"has no number at sample {bad[0]}{count} of {file.path.name}"
    return ""


def _channel(draft: Draft, name: str, column: Column, unit: str, said: Mapping[str, Any]) -> Table | None:
    """One table; None where the column is in a unit that no channel can have."""
    at = f"channel.{name}"
    table: Table = {"name": Noted(str(said.get("name", name)))}
    if column.name != table["name"].value:
        table["column"] = Noted(column.name)
    unit = str(said.get("unit", unit))
    known, of_name = unit_of(unit) if unit else None, by_name(column.name)
    quantity = column.quantity or by_unit(unit)
    if quantity == "displacement" and of_name == "position":
        quantity = of_name
    sensitivity = said.get("sensitivity")
    if sensitivity is not None and "quantity" not in said:
        quantity = _sensed(str(sensitivity)) or quantity
    if unit and known is None and not said:
        what = f"is in {unit!r}, which no channel is read in,"
        if electric(unit):
            what = _driven(unit, at)
        elif (way := as_a_way(unit)) is not None:
            gain, length = way
            what = f"is an angle (--set {at}.gain={gain:g}, and .unit={length}: at a lever of 1 m)"
        draft.guesses.append(f"column {column.name!r} {what} and is left out")
        return None
    ending = "" if unit else ending_unit(column.name)
    if ending and "quantity" not in said and sensitivity is None:
        quantity = by_name(column.name.rpartition("_")[0])
    if quantity is None and "quantity" not in said:
        guessed = of_name if of_name in QUANTITIES and of_name != "time" else "voltage"
        why = (
            f"the heading {column.name!r} reads like it" if of_name == guessed else "neither heading nor unit tells it"
        )
        draft.guess(
            table, "quantity", guessed, why, f"{at}.quantity={'acceleration' if guessed != 'acceleration' else 'force'}"
        )
        quantity = guessed
    else:
        quantity = str(said.get("quantity", quantity))
        table["quantity"] = Noted(quantity)
    if sensitivity is not None:
        _raw_unit(draft, table, at, unit, known, said)
    else:
        if ending and "unit" not in said:
            last, other = column.name.rpartition("_")[2], _OTHER.get(quantity, "mV")
            draft.guess(
                table, "unit", _written(unit_of(ending) or ""), f"the heading ends in {last!r}", f"{at}.unit={other}"
            )
        else:
            _unit(draft, table, at, unit, known, quantity, said)
    if quantity == "voltage" and of_name in ("acceleration", "force", "displacement", "velocity") and not said:
        like = {"acceleration": "100 mV/g", "force": "2.3 mV/N"}.get(of_name, "10 V/mm")
        draft.guesses.append(f"channel {name!r} is in volts: its sensor is said by --set {at}.sensitivity='{like}'")
    if column.factor != 1.0 and "gain" not in said:
        table["gain"] = Noted(float(column.factor), "units of the file (set 164)")
    draft.override(table, {key: value for key, value in said.items() if key not in ("name", "quantity")})
    return table


def _driven(unit: str, at: str) -> str:
    """What a column is that tells a force by a sensitivity."""
    told, like = _DRIVEN[electric(unit) or "A"]
    return f"is {told} (--set {at}.sensitivity={like!r} makes it a force)"


def _unit(
    draft: Draft, table: Table, at: str, unit: str, known: str | None, quantity: str, said: Mapping[str, Any]
) -> None:
    if "unit" in said:
        return
    fits = known is not None and quantity_of(known) in (
        quantity,
        "displacement" if quantity == "position" else quantity,
    )
    if fits:
        told = _written(known or "")
        table["unit"] = Noted(told, "" if told == unit else f"written {unit!r}")
    elif unit and "gain" not in said:
        raise InputError(
            f"--set {at}.quantity: column is in {unit!r}, which is no unit of {quantity}, expected .unit too"
        )
    else:
        draft.guess(
            table,
            "unit",
            QUANTITIES.get(quantity, ""),
            "the file says no unit",
            f"{at}.unit={_OTHER.get(quantity, 'mV')}",
        )


def _raw_unit(draft: Draft, table: Table, at: str, unit: str, known: str | None, said: Mapping[str, Any]) -> None:
    """What the column is in beside a sensitivity: volts, a charge, a current, a torque or %."""
    if "unit" in said:
        return
    raw = electric(unit)
    told = unit if raw in ("V", "C", "A") else raw or (known if known and quantity_of(known) == "voltage" else None)
    if told:
        table["unit"] = Noted(told, "" if told == unit else f"written {unit!r}")
    elif unit:
        raise InputError(
            f"--set {at}.sensitivity: the column is in {unit!r}, expected volts, a charge, a current, a torque or %; "
            "leave the sensitivity out, or say .unit too"
        )
    else:
        draft.guess(table, "unit", _electric(str(said["sensitivity"])), "the file says no unit", f"{at}.unit=mV")


def _electric(sensitivity: str) -> str:
    """V, C or A, as a sensor gives it."""
    sensor = sensor_units(sensitivity)
    return (electric(sensor[1]) if sensor else None) or "V"


def _written(unit: str) -> str:
    """A unit as people write it in measurement files."""
    return {"g_0": "g", "mg_0": "mg", "inch": "in", "thou": "mil"}.get(unit, unit)


def _sensed(sensitivity: str) -> str | None:
    """The quantity that a sensor measures, from its ``100 mV/g``."""
    sensor = sensor_units(sensitivity)
    known = unit_of(sensor[2]) if sensor else None
    return quantity_of(known) if known else None
