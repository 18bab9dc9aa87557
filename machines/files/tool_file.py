"""Tool files: ``schema = "jointlib/tool/1"``, a cutter with its holder, put into the spindle of a machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.mistakes import Lost, Mistakes
from jointlib.io.toml import Section
from jointlib.io.toml_file import parsed, read_toml
from jointlib.units import quantity

from ..components.cutters.cutting_tool import HOLDER, MATERIALS
from ..components.nodes import DIRECTIONS
from .component_file import names_a_file
from .cutting_table import cutting_keys, cutting_values

FILE_KEYS = ("file", "holder", "stick_out")
"""Keys of ``[tool]`` and ``[[tools]]`` that name a tool file, and what takes the place of values in it."""
CUTTER, HELD = "cutter", "holder"
"""Components that a tool file puts into a machine."""
_SHANK, _NOSE = "shank", "nose"
"""Connections of it: ``shank_x`` … between cutter and holder, ``nose.x`` … in the spindle."""
_TILTED = 1e-9
_OURS = (f"component.{CUTTER}.", f"component.{HELD}.", f"connection.{_SHANK}_")


def within_tool(path: str) -> bool:
    """Whether a path of a change leads into what a tool file puts into a machine."""
    return path.startswith(_OURS)


@dataclass(frozen=True)
class Place:
    """Where a machine holds its tool: the component, point (m), direction from the tip, and what it holds."""

    component: str
    at: Array
    axis: Array
    holds: tuple[str, ...]

    @property
    def across(self) -> tuple[str, str]:
        """The two machine directions that lie most across the axis, in order."""
        along = int(np.argmax(np.abs(self.axis)))
        first, second = (word for i, word in enumerate(DIRECTIONS[:3]) if i != along)
        return first, second


@dataclass(frozen=True)
class ShankJoint:
    """Springs and dampers between shank and holder in bending; along and about the axis it is rigid.

    Parameters
    ----------
    stiffness, rotation
        N/m of a deflection, N m/rad of a rotation.
    damping, rotation_damping
        N s/m, and N m s/rad.
    """

    stiffness: float
    rotation: float
    damping: float = 0.0
    rotation_damping: float = 0.0

    def connections(self, place: Place) -> Iterator[dict[str, Any]]:
        """The tables ``[[connection]]`` from cutter to holder."""
        for word in DIRECTIONS:
            turns = word.startswith("r")
            k, c = (self.rotation, self.rotation_damping) if turns else (self.stiffness, self.damping)
            laws = [{"kind": "linear", "stiffness": k}, *([{"kind": "viscous", "damping": c}] if c else [])]
            held = {"joint": {"law": laws}} if word[-1] in place.across else {"rigid": True}
            yield {"name": f"{_SHANK}_{word}", "between": [f"{CUTTER}.shank.{word}", f"{HELD}.front.{word}"], **held}


def put_in(documents: Sequence[Section], stands: str) -> Section | None:
    """The parts of the tool file that ``[tool]`` of a machine names, as a parts file would hold them; None without one.

    ``stands`` is where the table of the tool stands in its file, as messages begin. Tip, name and cutting of the tool
    go into the tables of the machine, where it does not tell them itself.
    """
    machine = documents[-1]
    table = machine.raw().get("tool")
    if not isinstance(table, dict) or "file" not in table:
        return None
    place = machine.section("spindle").read(lambda section: _place(section, documents))
    given = {key: table.pop(key) for key in FILE_KEYS if key in table}
    own = Section(given, stands, machine.folder, machine.mistakes)
    opened = _opened(own, "tool")
    behind = opened if opened is None or not (own.has("holder") or opened.has("holder")) else _behind(own, opened)
    if machine.mistakes is not None:  # else it has been raised
        machine.mistakes.unopened |= behind is None or place is None
    if opened is None or behind is None:
        return None
    place = place or Place(_NOSE, np.zeros(3), np.eye(3)[2], DIRECTIONS)
    if own.has("stick_out"):
        opened.raw()["stick_out"] = own.take("stick_out")
        _said(machine, f"{_where(opened, 1, CUTTER)}: stick_out", f"{stands}: stick_out")
    _cut(machine, opened)
    name = opened.text("name", None)
    if name is not None:
        table.setdefault("name", name)
    for axis, word in zip(("x", "y"), place.across, strict=True):
        table.setdefault(axis, f"{CUTTER}.tip.{word}")
    return _parts(opened, behind, place)


def _parts(opened: Section, behind: Section, place: Place) -> Section:
    """Cutter, holder and what joins them as tables; what is said of them is said of the tool file."""
    cutter: dict[str, Any] = {"name": CUTTER, "kind": "tool", "axis": place.axis.tolist()}
    sections, first = behind.take("section", []), _where(opened, 1, CUTTER)
    joint = behind.section("joint").read(_shank_joint) if behind.has("joint") else None
    if behind is not opened:
        for key in ("section", "joint"):
            if opened.has(key):
                opened.fault(f"{key} stands beside a holder file, expected it in that file alone")
                opened.take(key)
        behind.text("name", None)
        behind.done()
    if joint is not None and not sections:
        behind.fault("[joint] lies between shank and holder, expected [[section]] of a holder with it")
    cutter |= opened.raw()
    parts, joins, held = [cutter], [], CUTTER
    if joint is None or not sections:
        cutter |= {"at": place.at.tolist(), **({"section": sections} if sections else {})}
        _said(opened, f"{first}: [[section]]", f"{behind.where}: [[section]]")
    else:
        start = place.at - _length(sections) * place.axis / np.linalg.norm(place.axis)
        cutter["at"] = start.tolist()
        parts.append(_bar(sections, start, place, cutter))
        joins, held = list(joint.connections(place)), HELD
        _said(opened, f"{_where(opened, 2, HELD)}: [[segment]]", f"{behind.where}: [[section]]")
    _said(opened, f"{first}:", f"{opened.where}:")
    rigid = {"name": _NOSE, "between": [held, place.component], "at": place.at.tolist(), "rigid": True}
    joins.append({**rigid, "holds": list(place.holds)})
    return Section({"component": parts, "connection": joins}, opened.where, opened.folder, opened.mistakes)


def alone(path: Path, kind: str, mistakes: Mistakes) -> Section:
    """The tables that a file of kind tool or holder stands for, without a machine; its components are at the origin."""
    place = Place("spindle", np.zeros(3), np.eye(3)[2], DIRECTIONS)
    opened = read_toml(path, kind, mistakes)
    if kind == "tool":
        behind = _opened(opened, "holder") if opened.has("holder") else opened
        cutting_keys(opened.section("cutting"))
        opened.text("name", None)
        if behind is None:
            raise Lost
        return _parts(opened, behind, place)
    opened.text("name", None)
    sections = opened.take("section", [])
    if opened.has("joint"):
        opened.section("joint").read(_shank_joint)
    opened.done()
    if sections == []:
        opened.fault("no [[section]], expected at least one")
        raise Lost
    _said(opened, f"{_where(opened, 1, HELD)}: [[segment]]", f"{opened.where}: [[section]]")
    _said(opened, f"{_where(opened, 1, HELD)}:", f"{opened.where}:")
    bar = _bar(sections, place.at, place, {})
    return Section({"component": [bar]}, opened.where, opened.folder, mistakes)


def _bar(sections: Any, start: Array, place: Place, cutter: Mapping[str, Any]) -> dict[str, Any]:
    """The holder as a beam with stations front, at the shank, and face; it damps and turns as the cutter does."""
    of_it = MATERIALS[HOLDER]
    steel = {"name": HOLDER, "young": of_it.young, "poisson": of_it.poisson, "density": of_it.density}
    return {
        "name": HELD,
        "kind": "beam",
        "start": start.tolist(),
        "axis": place.axis.tolist(),
        "held": ["face"],
        "material": [{**steel, "loss_factor": cutter.get("loss_factor", 0.0)}],
        "segment": sections,
        "station": [{"name": "front", "at": 0.0}, {"name": "face", "at": "end"}],
        **{key: cutter[key] for key in ("up_to", "turns") if key in cutter},
    }


def _length(sections: Any) -> float:
    """m of the sections; one whose length cannot be read is refused where it is made a beam."""
    total = 0.0
    for section in sections if isinstance(sections, list) else []:
        try:
            total += quantity(section["length"], "m", "length")
        except (InputError, KeyError, TypeError):
            continue
    return total


def _opened(section: Section, kind: str) -> Section | None:
    """The file that a table names by ``file`` or ``holder``; None where it cannot be opened, which is told."""
    key = "file" if kind == "tool" else kind
    path = section.path(key)
    if not path.is_file():
        section.fault(f"{key} refers to {path}, which does not exist")
        return None
    mistakes = section.mistakes
    if mistakes is None:
        return read_toml(path, kind)
    return mistakes.attempt(lambda: read_toml(path, kind, mistakes))


def _behind(own: Section, opened: Section) -> Section | None:
    """The holder file: that which the machine names for this tool, else that of the tool file."""
    if not own.has("holder"):
        return _opened(opened, "holder")
    opened.take("holder", None)
    for key in ("section", "joint"):
        opened.take(key, None)
    return _opened(own, "holder")


def _place(section: Section, documents: Sequence[Section]) -> Place:
    """The ``[spindle]`` of a machine; by default the component of that name, or the only one, at the origin."""
    rows = [row for each in documents for row in _tables(each.raw().get("component"))]
    by_name = {str(row.get("name")): (row, each) for each in documents for row in _tables(each.raw().get("component"))}
    default = "spindle" if "spindle" in by_name or len(rows) != 1 else str(rows[0].get("name"))
    name = section.text("component", default)
    if name not in by_name:
        section.fault(f"component is {name!r}, {nearest(name, by_name)}, which holds the tool")
        raise Lost
    at, axis = section.numbers("at", "m", (0.0, 0.0, 0.0), length=3), section.numbers("axis", "1", (0.0, 0.0, 1.0), 3)
    holds = section.words("holds", None)
    section.done()
    if not np.linalg.norm(axis) > 0:
        section.fault(f"axis is {list(axis)}, expected a direction that is not zero")
        raise Lost
    if np.max(np.abs(axis)) < (1 - _TILTED) * np.linalg.norm(axis):
        section.fault(
            f"axis is {list(axis)}, expected the tool along x, y or z of the machine: feed, normal and the shank's "
            "joint lie along the other two"
        )
        raise Lost
    return Place(name, np.array(at), np.array(axis), _held(*by_name[name]) if holds is None else holds)


def _held(row: dict[str, Any], document: Section) -> tuple[str, ...]:
    """The directions of a component that names its dofs; else all six."""
    table = row
    file = row.get("file")
    file = file[0] if isinstance(file, list) and file else file
    if names_a_file(Section({"file": file}, "", document.folder)):
        try:
            table = parsed(document.folder / str(file))[1]
        except InputError:  # told where the component is read
            return DIRECTIONS
    dofs = table.get("dofs")
    if not isinstance(dofs, list):
        return DIRECTIONS
    return tuple(word for word in DIRECTIONS if any(str(dof).rpartition(".")[2] == word for dof in dofs)) or DIRECTIONS


def _shank_joint(section: Section) -> ShankJoint:
    stiffness, rotation = section.number("stiffness", "N/m"), section.number("rotation", "N m/rad")
    damping, turned = section.number("damping", "N s/m", 0.0), section.number("rotation_damping", "N m s/rad", 0.0)
    section.done()
    for key, value in (("stiffness", stiffness), ("rotation", rotation)):
        if not value > 0:
            section.fault(f"{key} is {value:g}, expected more than 0; without [joint] shank and holder are one piece")
    for key, value in (("damping", damping), ("rotation_damping", turned)):
        if not value >= 0:
            section.fault(f"{key} is {value:g}, expected at least 0")
    return ShankJoint(stiffness, rotation, damping, turned)


def _cut(machine: Section, opened: Section) -> None:
    """The ``[cutting]`` of the tool file under that of the tool in the machine, over that of the machine."""
    table = opened.section("cutting")
    given, shared = cutting_keys(table), machine.raw().get("cutting")
    if isinstance(shared, dict):
        under = f"{machine.where}: [cutting], under that of the tool"
        replaced = {key: shared[key] for key in given if key in shared}
        _said(machine, under, f"{machine.where}: [cutting]")
        cutting_values(Section(replaced, under, machine.folder, machine.mistakes))
        machine.raw()["cutting"] = {**shared, **given}
        for key in given:
            _said(machine, f"{machine.where}: [cutting]: {key}", f"{table.where}: {key}")


def _tables(value: Any) -> list[dict[str, Any]]:
    return [row for row in value if isinstance(row, dict)] if isinstance(value, list) else []


def _where(opened: Section, number: int, name: str) -> str:
    return f"{opened.where}: [[component]] {number} ({name})"


def _said(section: Section, read: str, stands: str) -> None:
    """Tell what is said of one place of another, where the file has it."""
    if section.mistakes is not None:
        section.mistakes.places.setdefault(read, stands)
