"""A bundle: scalar connections made from the geometry of one machine element, so that nothing else knows of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.io.mistakes import Lost
from jointlib.io.toml import Section
from jointlib.joint import Joint
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous
from jointlib.motion import Motion
from jointlib.registry import names, plugin

from ..components.connection import GROUND, Connection
from ..shapes.solid import Solid

_SQUARE = 1e-6
ASSUMED = "assumed"
"""Key of a joint's provenance under which a bundle says what it took for granted."""


@dataclass(frozen=True, eq=False)
class Row:
    """One scalar contact of a bundle, in the bundle's own axes: z grows as the first side moves along ``direction``."""

    name: str
    at: Array
    """m from the bundle's centre."""
    direction: Array
    joint: Joint


class Bundle(ABC):
    """A machine element as rows; its axes are given by ``axes`` in the machine file, the first one being its own."""

    kind: ClassVar[str]
    """The word for it in machine files."""
    main: ClassVar[tuple[float, float, float]]
    """Direction in the bundle's axes in which its damping is stated."""
    slides_with: ClassVar[int | None] = None
    """Side, 0 or 1, with which its contacts travel as the sides slide along its axis; None: they do not slide."""
    assumed: tuple[str, ...]
    """What the file did not say and was taken for granted, as ``contact_angle = 45 deg``."""

    @classmethod
    @abstractmethod
    def from_section(cls, section: Section) -> Bundle:
        """Build from a ``[[bundle]]`` table whose common keys have been read."""

    @classmethod
    def slid(cls, section: Section, along: float) -> dict[str, Any]:
        """Keys of its table that change when the first side has moved so far along its axis (m) from the drawing."""
        return {}

    @abstractmethod
    def rows(self) -> tuple[Row, ...]:
        """The contacts, each with its joint."""

    def solids(self) -> tuple[Solid, ...]:
        """How it looks, in its own axes about its place; nothing where its contacts alone are drawn."""
        return ()


@dataclass(frozen=True, eq=False)
class Placed:
    """A bundle in a machine: the connections that it became, and where it is drawn."""

    name: str
    bundle: Bundle
    between: tuple[str, str]
    places: Mapping[str, Array]
    """Centres in m by what follows the name; nothing where its sides are degrees of freedom without a place."""
    axes: Array
    """Unit vectors as rows."""
    connections: tuple[Connection, ...]


def expand(section: Section) -> tuple[Connection, ...]:
    """The connections of a ``[[bundle]]`` table, see `placed`."""
    return placed(section).connections


def placed(section: Section) -> Placed:
    """The bundle of a ``[[bundle]]`` table, as connections that are named ``<bundle>.<row>``.

    With a list of places in ``at`` there is one alike at each, ``<bundle>_1.<row>`` and so on.
    """
    name, between = section.text("name"), section.words("between")
    if len(between) != 2:
        section.fault(f"between names {len(between)} sides, expected two")
    scalar = all(side == GROUND or "." in side for side in between)
    places = _places(section)
    axes = bundle_axes(section)
    damping = section.number("damping", "N s/m", None)
    cls: type[Bundle] = section.kind(
        lambda word, where: plugin("jointlib.bundles", word, where), names("jointlib.bundles")
    )
    try:
        bundle = cls.from_section(section)
        rows = _damped(bundle, bundle.rows(), damping)
        _touching(rows, section.table)
    except InputError as error:
        where = f"{section.where}: "
        raise InputError(*(said if said.startswith(where) else where + said for said in error.sentences)) from None
    section.done()
    if len(between) != 2:
        raise Lost
    if scalar and len(rows) > 1:
        raise InputError(f"{section.where}: between is {list(between)}, expected rigid bodies, or one and 'ground'")
    provenance = {"bundle": f"{name} ({bundle.kind})"}
    if bundle.assumed:
        provenance[ASSUMED] = ", ".join(bundle.assumed)
    joints: dict[int, Joint] = {}
    out = []
    for (label, at), row in product(places.items(), rows):
        # Rows that share a joint go on sharing it: equal joints are asked together.
        shared = row.joint
        joint = joints.setdefault(
            id(shared), replace(shared, name=name, provenance={**shared.provenance, **provenance})
        )
        place, direction = (None, None) if scalar else (_triple(at + axes.T @ row.at), _triple(axes.T @ row.direction))
        sides = between[0], between[1]
        out.append(Connection(f"{name}{label}.{row.name}", sides, joint, at=place, direction=direction))
    return Placed(name, bundle, (between[0], between[1]), {} if scalar else places, axes, tuple(out))


_DEEPEST = 1e-3
"""m that a preload may press rolling elements in; with steel some hundredths of a millimetre are much."""


_SOFT = 1e6
"""N/m of the contacts of one row; of rolling elements they have ten times that and more."""


def _touching(rows: Iterable[Row], given: Mapping[str, object]) -> None:
    """Refuse a preload that no contact of metal bears, and a stiffness that makes it so."""
    laws = [law for row in rows for law in row.joint.laws if isinstance(law, HertzContact | HertzGuide)]
    deepest = max((law.indentation for law in laws), default=0.0)
    if deepest > _DEEPEST:
        stiffest = max(1.5 * law.preload / law.indentation for law in laws if law.indentation > 0)
        if "stiffness" in given and stiffest < _SOFT:
            raise InputError(
                f"its stiffness is so low that the preload presses its contacts in by {deepest * 1e3:.3g} mm, expected "
                "hundredths of a millimetre; is its unit wrong?"
            )
        raise InputError(
            f"the preload presses its contacts in by {deepest * 1e3:.3g} mm, expected hundredths of a millimetre; "
            "is a unit wrong?"
        )


_FARTHEST = 1e4
"""m from the origin."""


def _places(section: Section) -> dict[str, Array]:
    """Centres by what is added to the name: nothing for one alone, ``_1``, ``_2``, … for a list of several."""
    raw = section.take("at", [0.0, 0.0, 0.0])
    again = section.within({"at": raw})
    if not (isinstance(raw, list) and raw and isinstance(raw[0], list)):
        return {"": _near(section, np.array(again.numbers("at", "m", length=3)))}
    rows = again.matrix("at", "m")
    if len(rows[0]) != 3:
        raise InputError(f"{section.where}: at has rows of {len(rows[0])} values, expected points x, y, z in m")
    return {f"_{number}": _near(section, np.array(row)) for number, row in enumerate(rows, start=1)}


def _near(section: Section, place: Array) -> Array:
    """A place, refused where no machine reaches to: rotations there would be lost beside translations."""
    if np.max(np.abs(place)) > _FARTHEST:
        said = f"at is {place.tolist()} m, expected a place within {_FARTHEST / 1e3:g} km"
        raise InputError(f"{section.where}: {said}")
    return place


def _triple(vector: Array) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def bundle_axes(section: Section) -> Array:
    """Unit vectors of the bundle as rows; a second one that is not given is any normal to the first."""
    given = np.array(section.matrix("axes", "1", ((1.0, 0.0, 0.0),)), dtype=float)
    if given.shape not in ((1, 3), (2, 3)) or not np.all(np.linalg.norm(given, axis=1) > 0):
        section.fault(f"axes is {given.tolist()}, expected one or two vectors that are not zero")
        return np.eye(3)
    first = given[0] / np.linalg.norm(given[0])
    if len(given) == 1:
        helper = np.eye(3)[int(np.argmin(np.abs(first)))]
        second = np.cross(first, helper)
    else:
        second = given[1] / np.linalg.norm(given[1])
        if abs(first @ second) > _SQUARE:
            section.fault("axes are not perpendicular, expected two that are")
            return np.eye(3)
        second = second - (first @ second) * first
    second /= np.linalg.norm(second)
    return np.array([first, second, np.cross(first, second)])


def _damped(bundle: Bundle, rows: tuple[Row, ...], damping: float | None) -> tuple[Row, ...]:
    """Viscous damping shared among the rows as their stiffness is, so much in all along the main direction."""
    if damping is None:
        return rows
    if damping < 0:
        raise InputError(f"damping is {damping:g} N s/m, expected at least 0")
    stiffness = [_stiffness(row.joint) for row in rows]
    along = sum(k * float(row.direction @ np.array(bundle.main)) ** 2 for k, row in zip(stiffness, rows, strict=True))
    joints = {id(row.joint): row.joint + Viscous(damping * k / along) for k, row in zip(stiffness, rows, strict=True)}
    return tuple(replace(row, joint=joints[id(row.joint)]) for row in rows)


def _stiffness(joint: Joint) -> float:
    rest = np.zeros(())
    return float(joint.jacobian(Motion(rest, rest), joint.initial_state(rest))[0])


def assumed_value(section: Section, said: list[str], key: str, unit: str, default: float, shown: str) -> float:
    """A number from the file, or a default that is noted as assumed."""
    if section.has(key):
        return float(section.number(key, unit))
    said.append(f"{key} = {shown}")
    return default


def positive(kind: str, **values: float) -> None:
    """Refuse a dimension or load that is not above zero."""
    for key, value in values.items():
        if not value > 0:
            raise InputError(f"{kind}: {key} is {value:g}, expected more than 0")


def gauss(count: int, length: float) -> Iterable[tuple[float, float]]:
    """Places along a length about its middle and shares of it: sums that are exact for force and moment."""
    x, w = np.polynomial.legendre.leggauss(count)
    return [(float(a), float(b)) for a, b in zip(x * length / 2, w / 2, strict=True)]


def said_by(joints: Iterable[Joint]) -> tuple[str, ...]:
    """One sentence for every bundle that took something for granted."""
    found = {str(j.provenance["bundle"]): str(j.provenance[ASSUMED]) for j in joints if ASSUMED in j.provenance}
    return tuple(f"{bundle}: assumed {what}." for bundle, what in found.items())
