"""Conditions under which every design of a study is judged: tools, where the axes stand, and what is cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from jointlib.errors import nearest
from jointlib.io.toml import Section

from ..files.cutting_table import CUTTING_UNITS
from ..files.named_tools import USE


@dataclass(frozen=True, eq=False)
class Case:
    """One tool, position of the axes and material; a design counts with its worst case."""

    name: str = ""
    """As people read it, ``x 200 mm, steel``; empty where there is one case only."""
    position: Mapping[str, float] = field(default_factory=dict)
    """m from where the machine file is drawn, by axis."""
    material: str = ""
    tool: str = ""
    """Which of several named tools; empty: the one that the machine file says."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Values in SI (rpm for speeds) by path into the machine file."""


def read_cases(conditions: Section, tools: Sequence[str] = ()) -> tuple[Case, ...]:
    """Every combination of ``tool``, ``position`` and ``[[conditions.material]]``, the materials changing fastest.

    ``tools``, where given, take the place of those that the file names.
    """
    named = _tools(conditions)
    tools = tools or named
    places = _positions(conditions.section("position"))
    materials = _materials(conditions)
    several = [axis for axis, values in places.items() if len(values) > 1]
    cases = []
    for tool, at_places in product(tools or ("",), product(*places.values())):
        position = dict(zip(places, at_places, strict=True))
        changed: dict[str, Any] = {USE: tool} if tool else {}
        changed |= {f"axis.{axis}.position": place for axis, place in position.items()}
        for material, cut in materials.items():
            words = [f"tool {tool}"] if len(tools) > 1 else []
            words += [f"{axis} {position[axis] * 1e3:.6g} mm" for axis in several]
            words += [material] if len(materials) > 1 else []
            cases.append(Case(", ".join(words), position, material, tool, {**changed, **cut}))
    return tuple(cases)


def _tools(conditions: Section) -> tuple[str, ...]:
    """Tools by name, one or a list."""
    if isinstance(conditions.table.get("tool"), str):
        return (conditions.text("tool"),)
    found = conditions.words("tool", ())
    if conditions.has("tool") and not found:
        conditions.fault("tool is empty, expected names of tools")
    if len(set(found)) < len(found):
        conditions.fault("tool names one twice, expected different ones")
    return found


def _positions(table: Section) -> dict[str, tuple[float, ...]]:
    axes = table.keys()
    found = {axis: table.numbers(axis, "m") for axis in axes}
    for axis, values in found.items():
        if not values:
            table.fault(f"{axis} is empty, expected at least one position in m")
        if len(set(values)) < len(values):
            table.fault(f"{axis} names a position twice, expected different ones")
    return found


def _materials(conditions: Section) -> dict[str, dict[str, Any]]:
    """Changes of the cut by material; one without a name where the study names none."""
    found: dict[str, dict[str, Any]] = {}
    for section in conditions.sections("material"):
        name = section.text("name")
        if not name or name in found:
            section.fault(f"name is {name!r}, expected a word of its own for every material")
        cut: dict[str, Any] = {}
        given = section.keys()
        for key in given:
            if key == "speed":
                cut["cutting.speed"] = list(section.numbers(key, "rpm", length=2))
            elif key in CUTTING_UNITS:
                cut[f"cutting.{key}"] = section.number(key, CUTTING_UNITS[key])
            else:
                section.fault(f"unknown key {key!r}, {nearest(key, ['speed', *CUTTING_UNITS])}")
        if not given:
            section.fault("says nothing of the cut, expected keys of [cutting] such as tangential")
        found[name] = cut
    return found or {"": {}}
