"""What may be wrong at one place, as numbers to fit: its own parameters by factors, and one further law."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.loop.answer.refit import bounds_of
from jointlib.parameter import Role, parameters_of

from ...model.machine import Machine
from .places import Place, shared
from .quick import quick

WEAK = float(np.log(2.0))
"""Prior deviation of the logarithm of a parameter that no covariance speaks of: a factor of two."""
_HALVINGS = 40
_FAR = 4.0
"""Logarithm of the largest factor that is tried."""
_GEOMETRY = ("width", "contact_angle", "side", "displacement_scale", "velocity_scale")
"""What no wear, preload or wrong assumption changes by itself."""
_ENTRY = re.compile(r"\[\d+\](?:\[(\d+)\])?$")


@dataclass(frozen=True)
class Coordinate:
    """One number of a fit: a value reference·e^u where ``log``, reference·u otherwise."""

    name: str
    reference: float
    log: bool = True
    prior: float = WEAK
    """Standard deviation of u about ``centre``; infinite where nothing is known."""
    centre: float = 0.0
    low: float = -np.inf
    high: float = np.inf
    rows: frozenset[int] | None = None
    """Connections whose parameters it moves; None: all of the place."""

    def value(self, u: float) -> float:
        """In SI."""
        return self.reference * float(np.exp(u)) if self.log else self.reference * u

    def slope(self, u: float) -> float:
        """Derivative of the value by u."""
        return self.value(u) if self.log else self.reference


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A place, what is moved there, and where to begin."""

    place: Place
    family: str
    member: str
    own: tuple[tuple[Coordinate, tuple[str, ...]], ...]
    """Coordinates that multiply parameters of the place's joints, by the names of those."""
    added: tuple[Coordinate, ...] = ()
    """Coordinates of the further law, of the stiffest row."""
    laws: Callable[[Array], tuple[JointLaw, ...]] | None = None
    """The further laws from their values."""
    starts: tuple[tuple[float, ...], ...] = ()
    """Of the added coordinates."""
    machine: Machine = field(kw_only=True)

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (*(c for c, _ in self.own), *self.added)

    @cached_property
    def centre(self) -> Array:
        """Where the priors draw u."""
        return np.array([c.centre for c in self.coordinates])

    def bounded(self, u: Array) -> Array:
        """u within its bounds."""
        return np.clip(u, [c.low for c in self.coordinates], [c.high for c in self.coordinates])

    def values(self, u: Array) -> Array:
        """What the coordinates stand for, SI; own ones as factors."""
        own = [float(np.exp(x)) for x in u[: len(self.own)]]
        return np.array([*own, *(c.value(x) for c, x in zip(self.added, u[len(self.own) :].tolist(), strict=True))])

    def without(self) -> Hypothesis:
        """The joint's own parameters alone."""
        return replace(self, added=(), laws=None, starts=())

    def quick_laws(self, values: Array) -> tuple[JointLaw, ...]:
        """The further laws, their describing functions read off curves."""
        return () if self.laws is None else quick(Joint(self.laws(values))).laws

    def joints(self, u: Array, exact: bool = False) -> tuple[Joint, ...]:
        """All joints of the machine at u; rows that were alike stay alike. ``exact`` is for keeps, else quick."""
        given = self.machine.joints()
        made: dict[tuple[int, float, frozenset[str]], Joint] = {}
        changed = {}
        values = self.values(u)
        for row, share in zip(self.place.rows, self.place.share, strict=True):
            own = frozenset(c.name for c, _ in self.own if c.rows is None or row in c.rows)
            key = id(given[row]), share, own
            if key not in made:
                made[key] = self._row(given[row], values, share, own)
            changed[row] = made[key]
        if exact:
            return self.place.with_joint(given, changed)
        held: dict[int, Joint] = {}
        joints = self.place.with_joint(given, changed)
        return tuple(held.setdefault(id(joint), quick(joint)) for joint in joints)

    def _row(self, joint: Joint, values: Array, share: float, own: frozenset[str]) -> Joint:
        n = len(self.own)
        known = joint.parameters
        moved = {
            name: known[name] * float(values[i])
            for i, (coordinate, names) in enumerate(self.own)
            for name in names
            if name in known and coordinate.name in own
        }
        out = _admitted(joint, moved) if moved else joint
        if self.laws is not None and share > 0:
            for law in self.laws(values[n:]):
                out = out + shared(law, share)
        return out


def _admitted(joint: Joint, moved: Mapping[str, float]) -> Joint:
    """The joint with parameters moved as far as its laws admit: into the range of each, and where two of them exclude
    each other so (a static friction below the sliding one), as far on the way there as they do not."""
    known = joint.parameters
    lower, upper = bounds_of(joint, tuple(moved))
    there = dict(zip(moved, np.clip(np.array(list(moved.values())), lower, upper).tolist(), strict=True))
    found = _tried(joint, there)
    if found is not None:
        return found
    share, step = 0.0, 0.5
    for _ in range(_HALVINGS):
        further = {name: known[name] + (share + step) * (value - known[name]) for name, value in there.items()}
        share += step if _tried(joint, further) is not None else 0.0
        step /= 2
    return joint.with_parameters({name: known[name] + share * (value - known[name]) for name, value in there.items()})


def _tried(joint: Joint, values: Mapping[str, float]) -> Joint | None:
    try:
        return joint.with_parameters(values)
    except InputError:
        return None


def own_coordinates(
    machine: Machine, place: Place, within: bool = False
) -> tuple[tuple[Coordinate, tuple[str, ...]], ...]:
    """A factor for every parameter of the place's joints that a refit may move.

    Rows of a bundle share factors, and where a place has both, deflections theirs and rotations theirs; entries of a
    list share one, those of a table two: one for the terms of the velocity and one for the others. ``within`` holds
    them by the standard errors they were identified with.
    """
    turned = place.turned
    return (
        *_of_rows(machine, [row for row in place.rows if row not in turned], within, str, not turned),
        *_of_rows(machine, turned, within, of_rotation, False),
    )


def _of_rows(
    machine: Machine, rows: Sequence[int], within: bool, named: Callable[[str], str], alone: bool
) -> tuple[tuple[Coordinate, tuple[str, ...]], ...]:
    """The coordinates of some rows, all of the place where ``alone``."""
    groups: dict[str, list[str]] = {}
    for row in rows:
        joint = machine.joints()[row]
        roles = {
            f"{part}.{p.name}": p.role
            for part, law in zip(joint.part_names, joint.laws, strict=True)
            for p in parameters_of(law)
        }
        for name, value in joint.parameters.items():
            base = _ENTRY.sub("", name)
            if value == 0 or roles[base] is Role.SMOOTHING or {name, base} & joint.fixed or base.endswith(_GEOMETRY):
                continue
            entry = _ENTRY.search(name)
            odd = entry is not None and entry.group(1) is not None and int(entry.group(1)) % 2 == 1
            group = groups.setdefault(f"{base} of the velocity" if odd else base, [])
            if name not in group:
                group.append(name)
    if not rows:
        return ()
    joint = machine.joints()[rows[0]]

    def coordinate(key: str, name: str) -> Coordinate:
        value, prior = joint.parameters.get(name, 1.0), WEAK
        error = joint.covariance.standard_error(name) if within and joint.covariance is not None else 0.0
        if error > 0:
            prior = min(WEAK, error / abs(value))
        low, high = ends(groups[key])
        return Coordinate(named(key), value, prior=prior, low=low, high=high, rows=None if alone else frozenset(rows))

    def ends(names: list[str]) -> tuple[float, float]:
        """Logarithms of the factors between which every entry stays in the range of its parameter."""
        factors = [(np.exp(-_FAR), np.exp(_FAR))]
        for held in (machine.joints()[row] for row in rows):
            known = [name for name in names if name in held.parameters]
            for name, *bounds in zip(known, *bounds_of(held, known), strict=True):
                least, most = sorted(float(bound) / held.parameters[name] for bound in bounds)
                factors.append((least, most))
        low, high = max(low for low, _ in factors), min(high for _, high in factors)
        return min(0.0, float(np.log(low))), max(0.0, float(np.log(high)))

    return tuple((coordinate(key, names[0]), tuple(names)) for key, names in groups.items())


def of_rotation(parameter: str) -> str:
    """The name of a parameter of rotations beside deflections: ``linear.rotation_stiffness``, in N m/rad."""
    part, _, field = parameter.partition(".")
    return f"{part}.rotation_{field}"


def refit(machine: Machine, place: Place, within: bool = False) -> Hypothesis:
    """The joint's own parameters, no further law."""
    return Hypothesis(place, "refit", "", own_coordinates(machine, place, within), machine=machine)
