"""The controls of a machine file: joints, bundles, the stick-out of the tool, the cut."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.errors import InputError
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.units import number_and_unit, quantity, shown
from jointlib.units import scale as size_of

from ..bundles import expand
from ..cutting.process.cutting import Cutting
from ..files.machine_file import documents
from ..harmonic_balance.assembly import Assembly
from ..model.joint_places import bundles, rows_of
from ..model.machine import Machine
from ..operating.operating_point import operating_point
from ..tool.chatter_band import frequency_range
from .choices import tool_controls
from .controls import AMPLITUDE, Control, bounds, in_si

_FACTOR, _GEOMETRY = 4.0, 2.0
_LARGEST, _SMALL = 2e-4, 1e-3
_ABOUT_ZERO: Mapping[str, tuple[float, float]] = {
    "N": (0.0, 1e3),
    "N/m": (0.0, 1e8),
    "N s/m": (0.0, 1e4),
    "m": (0.0, 1e-5),
    "m/s": (0.0, 1e-3),
    "N/m^2": (-1e12, 1e12),
    "N/m^3": (-1e17, 1e17),
    "N s^2/m^2": (0.0, 1e5),
}
"""How far a joint parameter that is zero may be turned, in SI."""
_SHOWN: Mapping[str, tuple[float, str]] = {
    "rad": (math.pi / 180, "deg"),
    "m/N^(2/3)": (1e-6, "µm/N^(2/3)"),
    "1": (1.0, ""),
}
_CUTTING: Mapping[str, tuple[str, str, float]] = {
    "teeth": ("teeth", "", 1.0),
    "immersion": ("radial immersion", "%", 0.01),
    "feed": ("feed", "mm", 1e-3),
    "diameter": ("diameter", "mm", 1e-3),
    "tangential": ("tangential pressure", "N/mm²", 1e6),
    "normal": ("normal pressure", "N/mm²", 1e6),
    "specific": ("specific pressure", "N/mm²", 1e6),
    "exponent": ("exponent of the chip", "", 1.0),
    "feed_direction": ("direction of the feed", "deg", math.pi / 180),
}
"""Label, unit and its size in SI of the numbers of ``[cutting]``."""
_ENDS: Mapping[str, tuple[float, float]] = {
    "immersion": (1.0, 100.0),
    "exponent": (0.3, 1.0),
    "feed_direction": (-180.0, 180.0),
}
_SI = ("N", "m", "N/m", "N s/m", "rad", "N/m^2", "N/m^3", "m/N^(2/3)", "kg")
_LENGTHS = re.compile(r"[kcmµu]?m|deg|rad")


def controls_of(machine: Machine, changes: Mapping[str, Any] | None = None) -> tuple[Control, ...]:
    """Every control of a machine that was read from a file, with changes, and whose joints are known."""
    assert machine.source is not None
    tables = documents(machine.source, changes)
    joints = (*_joint_controls(machine, tables), *_stick_out_controls(machine, tables))
    tools = tool_controls(machine, changes or {})
    return (*tools, _amplitude_control(machine), *_axis_controls(machine), *joints, *_cutting_controls(machine))


def _axis_controls(machine: Machine) -> Iterator[Control]:
    """The position of every axis that has a travel."""
    for axis in machine.axes:
        if axis.travel is not None:
            place, low, high = (_plain(1e3 * x) for x in (axis.position, *axis.travel))
            key = f"axis.{axis.name}.position"
            yield Control(key, "position", f"axis {axis.name}", "mm", place, low, high, scale=1e-3)


def _named(tables: Sequence[Section], kind: str) -> Iterator[tuple[dict[str, Any], Path]]:
    """Every ``[[component]]``, ``[[connection]]`` or ``[[bundle]]`` of a machine and its parts, with its folder."""
    return ((table, section.folder) for section in tables for table in section.raw().get(kind, []))


def _amplitude_control(machine: Machine) -> Control:
    """From rest to the feed, or 200 µm, ended where a joint leaves its range on half the lines of the band."""
    feed = (machine.cutting or {}).get("feed")
    assembly = Assembly(machine, tuple(machine.tool.values()), tuple(machine.tool.values()))
    largest = _LARGEST if feed is None else float(feed)
    limits = [limit.amplitude for limit in assembly.limits]
    if np.any(np.isfinite(limits)):
        point = operating_point(machine, np.linspace(*frequency_range(machine), 100), _SMALL * largest)
        share = point.joint_amplitude[:, list(assembly.nonlinear)] / (_SMALL * largest) / limits
        largest = min(largest, 1 / max(float(np.median(np.max(share, axis=1))), 1e-30))
    return Control(AMPLITUDE, "amplitude", "tool", "µm", 0.0, 0.0, float(f"{largest * 1e6:.2g}"), scale=1e-6)


def _joint_controls(machine: Machine, tables: Sequence[Section]) -> tuple[Control, ...]:
    """Every parameter of every joint; connections whose names begin alike and whose joints are alike share theirs.

    Of a bundle the numbers in its own table, and the parameters of its rows where it was given a joint.
    """
    given = {table["name"]: (table, folder) for table, folder in _named(tables, "bundle")}
    joints = {c.name: c.joint for c in machine.flexible}
    bundled = {row for name in given for row in rows_of(machine, name)} - {
        t["name"] for t, _ in _named(tables, "connection")
    }
    groups = {row: group for group, rows in bundles(machine.flexible).items() for row in rows}
    places = dict.fromkeys(
        _place(machine, name, groups[row], joints) for row, name in enumerate(joints) if name not in bundled
    )
    out = [c for place in places for c in _of_joint(machine, "connection", place, joints)]
    for name, (table, folder) in given.items():
        out += _of_bundle(machine, name, table, folder)
        if "joint" in table:
            out += _of_joint(machine, "bundle", name, joints)
    return tuple(out)


def _place(machine: Machine, name: str, group: str, joints: Mapping[str, Joint | None]) -> str:
    """What stands for a connection and others whose joints are equal: the shortest beginning of its name, up to a dot
    or underscore, or what joins the same two nodes."""
    starts = [name[: match.start()] for match in re.finditer(r"[._]", name)]
    for start in (*starts, group):
        held = rows_of(machine, start)
        laws = [getattr(joints[row], "laws", None) for row in held]
        if start not in joints and name in held and None not in laws and laws.count(laws[0]) == len(laws) > 1:
            return start
    return name


def _of_joint(machine: Machine, kind: str, place: str, joints: Mapping[str, Joint | None]) -> Iterator[Control]:
    held = rows_of(machine, place)
    rows, own = [joints[name] for name in held], next(c for c in machine.connections if c.name == held[0])
    joint = rows[0]
    if joint is None:
        raise InputError(f"{machine.where}: the joint of {place!r} is not known yet, expected it identified")
    if any(other is None or other.laws != joint.laws for other in rows):
        return
    names = [name.partition(".")[2] for name in joint.parameters]
    for (name, value), short in zip(joint.parameters.items(), names, strict=True):
        unit = own.own_unit(joint.units[name])
        scale, word = _SHOWN[unit] if unit in _SHOWN else (1 / shown(unit)[0], shown(unit)[1])
        factor = _GEOMETRY if unit == "rad" else _FACTOR
        zero = _ABOUT_ZERO.get(unit)
        about_zero = None if zero is None else (zero[0] / scale, zero[1] / scale)
        ends = bounds(value / scale, factor, about_zero, _holds(joint, name, scale))
        if ends is not None:
            label = short if names.count(short) == 1 else name.replace(".", ": ")
            each = " of each row" if kind == "bundle" else ""
            key = f"{kind}.{place}.joint.{name}"
            yield Control(key, label.replace("_", " ") + each, place, word, _plain(value / scale), *ends, scale=scale)


def _plain(value: float) -> float:
    """An identified value as people quote it; what is not turned stays as it was identified."""
    return float(f"{value:.6g}")


def _holds(joint: Joint, name: str, scale: float) -> Callable[[float], bool]:
    def allowed(number: float) -> bool:
        try:
            joint.with_parameters({name: in_si(number, scale)})
        except InputError:
            return False
        return True

    return allowed


def _of_bundle(machine: Machine, name: str, table: dict[str, Any], folder: Path) -> Iterator[Control]:
    """The numbers of a bundle's table, in the units in which they stand there."""
    for key, entry in table.items():
        if key == "name" or isinstance(entry, bool) or not isinstance(entry, str | int | float):
            continue
        parts = number_and_unit(entry) if isinstance(entry, str) else (float(entry), "")
        if parts is None:
            continue
        value, unit = parts

        size = _size(unit)
        if size is None:
            continue

        def allowed(number: float, key: str = key, size: float = size) -> bool:
            try:
                for row in expand(Section({**table, key: in_si(number, size)}, name, folder)):
                    row.row(machine.components)  # what it holds may be out of reach
            except InputError:
                return False
            return True

        ends = bounds(value, _GEOMETRY if _LENGTHS.fullmatch(unit) else _FACTOR, None, allowed)
        if ends is not None:
            path = f"bundle.{name}.{key}"
            yield Control(path, key.replace("_", " "), name, pretty(unit), value, *ends, scale=size)


def _size(unit: str) -> float | None:
    """One of a unit in SI; None where it is none that joints have."""
    for si in _SI if unit else ():
        with contextlib.suppress(InputError):
            return size_of(unit, si, "")
    return None if unit else 1.0


def pretty(unit: str) -> str:
    """A unit of a file as it is printed."""
    return unit.replace("um", "µm").replace("^2", "²").replace("^3", "³")


def _stick_out_controls(machine: Machine, tables: Sequence[Section]) -> tuple[Control, ...]:
    """The stick-out of a tool by its sizes; the free length of each beam that carries the tool or the workpiece.

    That is its last segment, and what stands on it.
    """
    held = {tuple(side.split(".")[:2]) for dof in machine.tool.values() for side in dof.split(" - ")}
    out = []
    for table, _ in _named(tables, "component"):
        if table.get("kind") == "tool" and table["name"] in {component for component, *_ in held}:
            out.append(_stick_out_of_sizes(table))
            continue
        stations = (
            [name for component, name in held if component == table["name"]] if table.get("kind") == "beam" else []
        )
        if not stations:
            continue
        name, where = table["name"], f"component {table['name']}"
        lengths = [quantity(s["length"], "m", where) for s in table["segment"]]
        start, last = sum(lengths[:-1]), len(lengths) - 1
        base = f"component.{name}"
        at = {
            s["name"]: ("", sum(lengths))
            if s["at"] == "end"
            else (f"{base}.station[{i}].at", quantity(s["at"], "m", where))
            for i, s in enumerate(table["station"])
        }
        beyond = {station: (path, place) for station, (path, place) in at.items() if place > start + 1e-9}
        if not all(station in beyond for station in stations):
            continue
        nearest_to_start = min(place for _, place in beyond.values()) - start
        length = lengths[-1]
        low = max(length / _GEOMETRY, length - 0.9 * nearest_to_start)
        moves = ((f"{base}.segment[{last}].length", length), *(moved for moved in beyond.values() if moved[0]))
        ends = float(f"{low * 1e3:.3g}"), float(f"{length * 1e3 * _GEOMETRY:.3g}")
        out.append(Control(f"{base}.stick_out", "stick-out", name, "mm", length * 1e3, *ends, scale=1e-3, moves=moves))
    return tuple(out)


def _stick_out_of_sizes(table: dict[str, Any]) -> Control:
    """The stick-out of a tool by its sizes: its flutes stay outside the holder."""
    where = f"component {table['name']}"
    length, flutes = (quantity(table[key], "m", where) for key in ("stick_out", "flute_length"))
    low, high = max(length / _GEOMETRY, flutes), length * _GEOMETRY
    ends = math.ceil(round(1e4 * low, 6)) / 10, float(f"{1e3 * high:.3g}")
    path = f"component.{table['name']}.stick_out"
    return Control(path, "stick-out", table["name"], "mm", 1e3 * length, *ends, scale=1e-3)


def _cutting_controls(machine: Machine) -> tuple[Control, ...]:
    """The numbers of ``[cutting]`` that the file gives."""
    if machine.cutting is None or machine.source is None:
        return ()
    out = []
    for key, (label, unit, scale) in _CUTTING.items():
        si = machine.cutting.get(key)
        if si is None or (key == "immersion" and machine.cutting["mode"] == "slot"):
            continue
        value = _plain(float(si) / scale)
        if key == "teeth":
            ends = 1.0, float(max(12, 2 * si)), False
        elif key in _ENDS:
            ends = *_ENDS[key], False
        else:
            found = bounds(value, _FACTOR, (0.0, 1e3), _cuts(machine, key, scale))
            if found is None:
                continue
            ends = found
        whole = key == "teeth"
        out.append(Control(f"cutting.{key}", label, "cutting", unit, value, *ends, whole=whole, scale=scale))
    return tuple(out)


def _cuts(machine: Machine, key: str, scale: float) -> Callable[[float], bool]:
    def allowed(number: float) -> bool:
        try:
            Cutting(**{**(machine.cutting or {}), key: in_si(number, scale)})
        except InputError:
            return False
        return True

    return allowed
