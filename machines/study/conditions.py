"""Conditions under which every design of a study is judged: where the axes stand, and what is cut."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from jointlib.errors import nearest
from jointlib.io.toml import Section

from ..operation import CUTTING_UNITS


@dataclass(frozen=True, eq=False)
class Case:
    """One position of the axes and one material; a design counts with its worst case."""

    name: str = ""
    """As people read it, ``x 200 mm, steel``; empty where there is one case only."""
    position: Mapping[str, float] = field(default_factory=dict)
    """m from where the machine file is drawn, by axis."""
    material: str = ""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Values in SI (rpm for speeds) by path into the machine file."""


def read_cases(conditions: Section) -> tuple[Case, ...]:
    """Every combination of ``position`` and ``[[conditions.material]]``, the materials changing fastest."""
    places = _positions(conditions.section("position"))
    materials = _materials(conditions)
    several = [axis for axis, values in places.items() if len(values) > 1]
    cases = []
    for combination in product(*places.values()):
        position = dict(zip(places, combination, strict=True))
        moved = {f"axis.{axis}.position": at for axis, at in position.items()}
        for material, cut in materials.items():
            words = [f"{axis} {position[axis] * 1e3:.6g} mm" for axis in several]
            words += [material] if len(materials) > 1 else []
            cases.append(Case(", ".join(words), position, material, {**moved, **cut}))
    return tuple(cases)


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
