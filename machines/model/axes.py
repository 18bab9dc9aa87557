"""Axes of a machine: slides that stand elsewhere than the file is drawn.

A machine file is drawn at one place of its axes. `move` redraws its tables for another one before anything is made of
them, so that nothing else knows of axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest
from jointlib.io.toml import Section
from jointlib.registry import plugin

from ..bundles.bundle import Bundle, bundle_axes
from ..components.connection import GROUND
from .stations import Stations

FREE = {"rigid": ("centre",), "beam": ("start",), "tool": ("at",), "riding": ("base", "centre")}
"""Kinds of component that nothing but their connections holds, and the keys that say where they are."""
_STILL = 1e-12
"""m; less is rounding."""


@dataclass(frozen=True)
class Axis:
    """One linear axis."""

    name: str
    direction: tuple[float, float, float]
    """Unit vector in machine axes."""
    moves: tuple[str, ...]
    """Components that travel, those that they carry included."""
    position: float = 0.0
    """m along the direction, from where the file is drawn."""
    travel: tuple[float, float] | None = None
    """m; lowest and highest position."""

    def words(self) -> str:
        """``axis x: moves table along (1, 0, 0), at 0 mm of -300 to 300 mm``."""
        along = ", ".join(f"{n:g}" for n in self.direction)
        ends = "" if self.travel is None else f" of {self.travel[0] * 1e3:g} to {self.travel[1] * 1e3:g} mm"
        return f"axis {self.name}: moves {', '.join(self.moves)} along ({along}), at {self.position * 1e3:g} mm{ends}"


def read_axes(documents: Sequence[Section]) -> tuple[Axis, ...]:
    """The ``[[axis]]`` tables of a machine file and its parts."""
    components = {str(t.get("name")): _kind(t) for t, _ in _tables(documents, "component")}
    named = all(isinstance(t.get("name"), str) for t, _ in _tables(documents, "component"))
    links = [_sides(t) for kind in ("connection", "bundle") for t, _ in _tables(documents, kind)]
    axes: dict[str, Axis] = {}
    for document in documents:
        for axis in document.each("axis", lambda section: _axis(section, components, links, named))[0]:
            if axis.name in axes:
                document.fault(f"axis {axis.name!r} is declared twice, expected different names")
            axes[axis.name] = axis
    return tuple(axes.values())


def _axis(section: Section, components: dict[str, str], links: Sequence[list[str]], all_named: bool) -> Axis:
    name = section.text("name")
    direction = np.array(section.numbers("direction", "1", length=3))
    moves = section.words("moves")
    position = section.number("position", "m", 0.0)
    travel = section.numbers("travel", "m", None, length=2)
    section.done()
    whole = all_named and not (section.mistakes and section.mistakes.unopened)
    if not (np.all(np.isfinite(direction)) and np.linalg.norm(direction) > 0):
        section.fault(f"direction is {direction.tolist()}, expected a vector that is not zero")
    for word in moves:
        if word not in components and whole:
            section.fault(f"moves {word!r}, which is no component, {nearest(word, components)}")
    if not moves:
        section.fault("moves is empty, expected at least one component")
    if travel is not None and not travel[0] < travel[1]:
        section.fault(f"travel is {list(travel)}, expected [low, high] in m")
    elif not np.isfinite(position) or (travel is not None and not travel[0] <= position <= travel[1]):
        ends = "a finite place" if travel is None else f"{travel[0] * 1e3:g} to {travel[1] * 1e3:g} mm, its travel"
        section.fault(f"position is {position * 1e3:g} mm, expected {ends}")
    n = direction / (np.linalg.norm(direction) or 1.0)
    moved = (*moves, *(c for c in _loose(components, links, set(moves)) if c not in moves))
    ends_of = None if travel is None else (travel[0], travel[1])
    return Axis(name, (float(n[0]), float(n[1]), float(n[2])), moved, position, ends_of)


def _loose(components: dict[str, str], links: Sequence[list[str]], moves: set[str]) -> list[str]:
    """What nothing would hold if these components were taken away: it rides on them.

    Where nothing stands on the ground at all, as in a machine that is tested hanging, nothing is said to ride.
    """
    others = [name for name in components if name not in moves]
    held = {GROUND, *(name for name in others if components[name] not in FREE)}
    if not any(GROUND in link for link in links) and held == {GROUND}:
        return []
    grown = True
    while grown:
        grown = False
        for link in links:
            if moves.isdisjoint(link) and held & set(link) and not held >= set(link):
                held |= set(link)
                grown = True
    return [name for name in others if name not in held]


def move(documents: Sequence[Section], axes: Sequence[Axis]) -> None:
    """Redraw the tables of a machine, opened but not read, with its axes where they stand.

    Bodies that travel are drawn further on, with their points. Contacts stay with the carriage (the first side) and
    with the bearing of a ball screw, whose free length follows; stations of a beam follow the contacts that slide
    along it. The second term of a tool such as ``cutter.tip.x - table.cut.x`` stays where the first one is: the
    cutter meets another place of the workpiece. At 0 nothing is touched.
    """
    if not any(axis.position for axis in axes):
        return
    travelled = _Travel(axes)
    beams = {
        str(t.get("name")): Stations(t, f"{document.where}: [[component]] ({t.get('name')})", document.folder)
        for t, document in _tables(documents, "component")
        if t.get("kind") == "beam"
    }
    for kind in ("connection", "bundle"):
        for table, document in _tables(documents, kind):
            _move_contacts(kind, table, document, travelled, beams)
    cuts = _cuts(documents[-1])
    for name, beam in beams.items():
        for station in beam.named:
            apart = travelled.of(cuts.get(f"{name}.{station}", name)) - travelled.of(name)
            if f"{name}.{station}" in cuts or _is_named(documents, f"{name}.{station}."):
                beam.use(station, apart, by_name=True)
        beam.settle()
    for table, document in _tables(documents, "component"):
        _move_body(table, document, travelled, cuts)


class _Travel:
    """How far every component has travelled, in m."""

    def __init__(self, axes: Sequence[Axis]) -> None:
        self._shift: dict[str, Array] = {}
        for axis in axes:
            for name in axis.moves:
                self._shift[name] = self.of(name) + axis.position * np.array(axis.direction)

    def of(self, component: str) -> Array:
        return self._shift.get(component, np.zeros(3))


def _move_contacts(
    kind: str, table: dict[str, Any], document: Section, travelled: _Travel, beams: dict[str, Stations]
) -> None:
    where = f"{document.where}: [[{kind}]] ({table.get('name')})"
    sides = _sides(table)
    if not sides:
        return
    apart = travelled.of(sides[0]) - travelled.of(sides[1])
    holder = 0
    if kind == "bundle" and np.linalg.norm(apart) > _STILL:
        cls: type[Bundle] = plugin("jointlib.bundles", str(table.get("kind")), where)
        along = bundle_axes(Section(table, where, document.folder))[0]
        if cls.slides_with is None:
            raise InputError(
                f"{where}: an axis moves {sides[0]!r} against {sides[1]!r}, which a {cls.kind} does not let slide; "
                "expected both in moves, or neither"
            )
        if np.linalg.norm(apart - (apart @ along) * along) > 1e-6 * np.linalg.norm(apart):
            raise InputError(
                f"{where}: its axis is ({', '.join(f'{n:.6g}' for n in along)}), but an axis of the machine moves "
                f"{sides[0]!r} across it"
            )
        holder = cls.slides_with
        table |= cls.slid(Section(table, where, document.folder), float(apart @ along))
    if any("." not in side and side != GROUND for side in _between(table)) and (kind == "bundle" or "at" in table):
        points = _points(table, where, document)
        for side in sides:
            if side in beams:
                beams[side].hold(points, travelled.of(sides[holder]) - travelled.of(side))
        if np.any(travelled.of(sides[holder])):
            placed = (points + travelled.of(sides[holder])).tolist()
            table["at"] = placed if isinstance(table.get("at", [0])[0], list) else placed[0]


def _move_body(table: dict[str, Any], document: Section, travelled: _Travel, cuts: dict[str, str]) -> None:
    name = str(table.get("name"))
    where = f"{document.where}: [[component]] ({name})"
    own = travelled.of(name)
    if np.any(own):
        for key in FREE.get(_kind(table), ()):
            _shift(table, key, own, where, document)
    for kind in ("point", "node"):
        for point in _inside(table, kind):
            leader = cuts.get(f"{name}.{point.get('name')}", name) if kind == "point" else name
            if "at" in point and np.any(travelled.of(leader)):
                _shift(point, "at", travelled.of(leader), where, document)


def _kind(table: dict[str, Any]) -> str:
    """Its kind; modes with a base of their own ride on what holds that."""
    return "riding" if "base" in table else str(table.get("kind"))


def _shift(table: dict[str, Any], key: str, by: Array, where: str, document: Section) -> None:
    drawn = Section({key: table.get(key, [0.0, 0.0, 0.0])}, where, document.folder).numbers(key, "m", length=3)
    table[key] = (np.array(drawn) + by).tolist()


def _cuts(document: Section) -> dict[str, str]:
    """The component of the first term of every tool difference, by ``component.point`` of the second."""
    words = [word for key in ("tool", "response") for word in _table(document, key).values()]
    pairs = [word.split(" - ") for word in words if isinstance(word, str)]
    terms = [(a, b) for pair in pairs for a, b in pairwise(pair)]
    return {second.rpartition(".")[0].strip(): first.partition(".")[0].strip() for first, second in terms}


def _is_named(documents: Sequence[Section], prefix: str) -> bool:
    """Whether a connection, the tool, the drive or a static force names a dof that begins so."""
    sides = [side for kind in ("connection", "bundle") for t, _ in _tables(documents, kind) for side in _between(t)]
    tool = [word for key in ("tool", "response") for word in _table(documents[-1], key).values()]
    force = _table(documents[-1], "static").get("force")
    words = [*sides, *tool, *(force if isinstance(force, dict) else ())]
    return any(isinstance(word, str) and word.startswith(prefix) for word in words)


def _points(table: dict[str, Any], where: str, document: Section) -> Array:
    """Where a connection or bundle holds, (n, 3) in m."""
    raw = table.get("at", [0.0, 0.0, 0.0])
    again = Section({"at": raw}, where, document.folder)
    if isinstance(raw, list) and raw and isinstance(raw[0], list):
        points = np.array(again.matrix("at", "m"))
        if points.shape[1] == 3:
            return points
    return np.array([again.numbers("at", "m", length=3)])


def _between(table: dict[str, Any]) -> list[str]:
    """The two sides of a connection or bundle; nothing where something else stands there, which is refused later."""
    sides = table.get("between")
    fine = isinstance(sides, list) and len(sides) == 2 and all(isinstance(side, str) for side in sides)
    return list(sides) if fine and sides is not None else []


def _sides(table: dict[str, Any]) -> list[str]:
    """The components, or the ground, that it joins."""
    return [side.partition(".")[0] for side in _between(table)]


def _table(document: Section, key: str) -> dict[str, Any]:
    found = document.raw().get(key)
    return found if isinstance(found, dict) else {}


def _tables(documents: Sequence[Section], kind: str) -> Iterator[tuple[dict[str, Any], Section]]:
    for document in documents:
        yield from ((table, document) for table in _inside(document.raw(), kind))


def _inside(table: dict[str, Any], kind: str) -> list[dict[str, Any]]:
    """The tables ``[[kind]]`` of a table; what else stands there is refused later."""
    found = table.get(kind)
    return [each for each in found if isinstance(each, dict)] if isinstance(found, list) else []
