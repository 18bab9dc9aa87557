"""Beam component: a straight stepped bar in bending, shear, tension and torsion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.io.mistakes import Lost
from jointlib.io.toml import Section

from ..shapes.beam_line import drawn_beam
from ..shapes.beam_mesh import FIELDS, beam_mesh
from ..shapes.drawn import Drawn
from ..shapes.profile import Material
from ..shapes.segment import Segment
from .component import Component, SecondOrder, checked_dofs
from .craig_bampton import Reduction, craig_bampton
from .lumped import receptance_of
from .modal_coordinates import in_modes
from .mode_sum import modes
from .nodes import DIRECTIONS, TOLERANCE, Nodes, checked_nodes

_ERROR = 1e-6
"""Largest relative error that the reduction to the stations may make up to the highest frequency."""


@dataclass(frozen=True, eq=False)
class Beam(Component):
    """Timoshenko beam: EI ϑ'' + κGA (w' − ϑ) = ρI ϑ̈, κGA (w'' − ϑ') = ρA ẅ in two planes, with tension and torsion.

    Finite elements of degree 6 that are exact in statics, reduced to the stations with their error measured
    (see `remarks`). Time-domain matrices are wanted for the check, for stability and for export, which is why they
    are not the spectral (dynamic stiffness) form.

    Parameters
    ----------
    segments
        One after the other from ``start``.
    stations
        Distance of every named station from ``start`` in m; each has dofs x, y, z, rx, ry, rz in machine axes.
    start, axis
        First end (m) and direction of the beam, machine axes.
    up
        Direction of the height of sections; only its part across the axis counts.
    up_to
        Highest frequency in Hz that the model is made for.
    tolerance
        m; how far a connection's point may lie from a station.
    held
        Stations at which the machine holds the beam: loss factors are those of its modes with these held (`in_modes`).
    turns
        Turns about its axis, right-handed, per turn of the spindle: 0 for a beam that stands, 1 or −1 for the spindle.
        Rotary inertia then couples the planes of bending by C = Ω G with G skew (gyroscopic pairs).
    speed
        Spindle speed in rpm.
    notes
        What was assumed when it was read; ``flutes`` the length in m of the fluted part of a tool by its sizes.
    """

    name: str
    segments: tuple[Segment, ...]
    stations: dict[str, float]
    start: Array | None = None
    axis: Array | None = None
    up: Array | None = None
    up_to: float = 10e3
    tolerance: float = TOLERANCE
    dofs: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    turns: float = 0.0
    speed: float = 0.0
    notes: tuple[str, ...] = ()
    flutes: float | None = None

    kind: ClassVar[str] = "beam"

    def __post_init__(self) -> None:
        where = f"component {self.name!r}"
        if not self.segments:
            raise InputError(f"{where}: no segment, expected at least one")
        if not (np.isfinite(self.up_to) and self.up_to > 0):
            raise InputError(f"{where}: up_to is {self.up_to!r} Hz, expected more than 0")
        length = sum(s.length for s in self.segments)
        for name, at in self.stations.items():
            if not -1e-9 * length <= at <= length * (1 + 1e-9):
                raise InputError(f"{where}: station {name!r} lies at {at:g} m, expected 0 to {length:g} m")
            twin = [n for n, other in self.stations.items() if abs(other - at) < 1e-6 * length and n != name]
            if twin:
                raise InputError(f"{where}: stations {name!r} and {twin[0]!r} lie at one place, expected one of them")
        unknown = [name for name in self.held if name not in self.stations]
        if unknown:
            known = ", ".join(self.stations) or "none"
            raise InputError(f"{where}: held has {unknown[0]!r}, expected stations of the beam ({known})")
        if not (np.isfinite(self.turns) and np.isfinite(self.speed)):
            raise InputError(f"{where}: turns is {self.turns!r}, expected a finite number of turns per turn")
        if self.turns and not all(s.lies_any_way for s in self.segments):
            raise InputError(f"{where}: turns is {self.turns:g}, expected round sections of a beam that turns")
        for key, default in (("start", (0, 0, 0)), ("axis", (1, 0, 0))):
            given = getattr(self, key)
            value = np.array(default if given is None else given, dtype=float)
            if value.shape != (3,) or not np.all(np.isfinite(value)) or (key == "axis" and not np.any(value)):
                raise InputError(f"{where}: {key} is {value.tolist()}, expected three finite values, an axis not zero")
            object.__setattr__(self, key, value)
        object.__setattr__(self, "stations", dict(self.stations))
        dofs = tuple(f"{name}.{direction}" for name in self.stations for direction in DIRECTIONS)
        object.__setattr__(self, "dofs", checked_dofs(where, dofs))
        assert self.nodes  # what is wrong with directions and positions is said here

    @cached_property
    def frame(self) -> Array:
        """Rows: axis, width and height of the beam in machine axes."""
        return _frame(f"component {self.name!r}", self.axis, self.up, self.segments)

    @cached_property
    def nodes(self) -> Nodes:
        """The stations in space."""
        along, sized = np.array(list(self.stations.values())), self.flutes is not None
        places, ends = (
            self.start + at[:, None] * self.frame[0]
            for at in (along, np.array([0.0, sum(s.length for s in self.segments)]))
        )
        return checked_nodes(f"component {self.name!r}", tuple(self.stations), places, self.tolerance, ends, sized)

    @classmethod
    def from_section(cls, section: Section) -> Beam:
        name = section.text("name")
        found, unread = section.each("material", _material)
        materials = {material.name: material for material in found}
        if not found and not unread:
            section.fault("no [[component.material]], expected at least one")
        segments, lost = section.each("segment", lambda part: Segment.from_section(part, materials, not unread))
        stations: dict[str, float] = {}
        for part in section.sections("station"):
            station = part.text("name")
            if station in stations:
                raise InputError(f"{section.where}: station {station!r} is named twice, expected different names")
            stations[station] = place_along(part, sum(s.length for s in segments))
            part.done()
        start, axis, up = (
            section.numbers("start", "m", (0.0, 0.0, 0.0), length=3),
            section.numbers("axis", "1", (1.0, 0.0, 0.0), length=3),
            section.numbers("up", "1", None, length=3),
        )
        up_to = section.number("up_to", "Hz", 10e3)
        tolerance = section.number("tolerance", "m", TOLERANCE)
        held, turns = section.words("held", ()), section.number("turns", "1", 0.0)
        across = None if up is None else np.array(up)
        if lost or not found:
            section.done()
            raise Lost
        return cls(
            name,
            tuple(segments),
            stations,
            np.array(start),
            np.array(axis),
            across,
            up_to,
            tolerance,
            held=held,
            turns=turns,
        )

    @cached_property
    def _reduced(self) -> tuple[Reduction, SecondOrder, Array, Array]:
        ends = np.cumsum([s.length for s in self.segments])
        places = np.clip(np.array(list(self.stations.values())), 0.0, ends[-1])
        profiles, materials = [s.profile for s in self.segments], [s.material for s in self.segments]
        try:
            mesh = beam_mesh(ends, profiles, materials, places, self.up_to)
        except InputError as error:
            raise InputError(f"component {self.name!r}: {error}") from None
        at = [int(np.argmin(np.abs(mesh.vertices - x))) for x in places]
        interface = np.concatenate([FIELDS * v + np.arange(FIELDS) for v in at])
        where = f"component {self.name!r}"
        found = craig_bampton(
            scipy.sparse.csc_matrix(mesh.mass),
            scipy.sparse.csc_matrix(np.sum(mesh.stiffness, axis=0)),
            interface,
            self.up_to,
            _ERROR,
            where,
        )
        parts = [found.reduced(scipy.sparse.csc_matrix(K)) for K in mesh.stiffness]
        zero = np.zeros_like(parts[0])
        C = sum((m.viscous * K for m, K in zip(mesh.materials, parts, strict=True)), zero)
        lossy = sum((m.loss_factor * K for m, K in zip(mesh.materials, parts, strict=True)), zero)
        shapes = np.zeros((len(self.dofs), len(zero)))
        shapes[:, : len(interface)] = scipy.linalg.block_diag(*([self.frame.T] * (2 * len(at))))
        model = SecondOrder(found.reduced(scipy.sparse.csc_matrix(mesh.mass)), C, sum(parts, zero), shapes)
        # Unit accelerations along the machine axes: bubbles and rotations take no part in a translation.
        moved = np.zeros((len(mesh.mass), 3))
        for v in range(len(mesh.vertices)):
            moved[FIELDS * v : FIELDS * v + 3] = self.frame
        carried = shapes[:, : len(interface)] @ (found.basis[:, : len(interface)].T @ (mesh.mass @ moved))
        held = [FIELDS * i + k for i, name in enumerate(self.stations) if name in self.held for k in range(FIELDS)]
        standing = in_modes(model, lossy, np.array(held) if held else None)
        shapes_of_modes = modes(model.mass, model.stiffness)[1] if self.turns else np.zeros((len(zero), 0))
        reach = found.basis @ shapes_of_modes
        G = reach.T @ mesh.gyroscopic @ reach
        return found, standing, carried, G

    def weight(self, gravity: Array) -> Array:
        """Ψᵀ M r g with the static shapes Ψ of the stations: exact forces and moments of the weight spread over it."""
        return np.asarray(self._reduced[2] @ gravity)

    def between(self, omega: Array, rows: Array, columns: Array) -> ComplexArray:
        return receptance_of(self.second_order(), omega, rows, columns)

    def second_order(self) -> SecondOrder:
        return self._equations

    @cached_property
    def _equations(self) -> SecondOrder:
        _, standing, _, G = self._reduced
        rate = self.turns * self.speed * 2 * np.pi / 60
        return replace(standing, damping=standing.damping + rate * (G - G.T) / 2) if rate else standing

    @property
    def known_speeds(self) -> tuple[float, float] | None:
        """Any, where it turns with the spindle."""
        return (0.0, np.inf) if self.turns else None

    def at_speed(self, speed: float) -> Beam:
        """The same beam turning; its reduction, which is that of the beam at a stand, is not made again."""
        if not self.turns:
            return self
        turning = replace(self, speed=float(speed))
        vars(turning)["_reduced"] = self._reduced
        return turning

    def remarks(self) -> tuple[str, ...]:
        found = self._reduced[0]
        segments = "1 segment" if len(self.segments) == 1 else f"{len(self.segments)} segments"
        said = (
            f"{self.name}: beam of {segments} and {found.basis.shape[1]} coordinates, made for "
            f"frequencies up to {self.up_to:g} Hz; reduction error at most {found.error:.1g} there.",
            *(f"{self.name}: {note}" for note in self.notes),
        )
        if self.turns:
            here = f"at {self.speed:g} rpm where none is asked for"
            said = (*said, f"{self.name}: turns with the spindle, {here}; its bending planes couple.")
        if not any(s.assumed for s in self.segments):
            return said
        return (*said, f"{self.name}: assumed shear_factors = [5/6, 5/6] where a section is given by its constants.")

    def motion_at(self, point: Array, direction: Array) -> Array:
        """Motion of the station that lies there."""
        return self.nodes.motion(f"component {self.name!r}", self.dofs, point, direction)

    def drawn(self) -> Drawn:
        """Its segments, bent as its stations move."""
        assert self.start is not None
        return drawn_beam(self.start, self.frame, self.stations, [(s.length, s.outline) for s in self.segments])

    def rotation_at(self, point: Array, direction: Array) -> Array | None:
        """Rotation of the station that lies there."""
        return self.nodes.rotation(f"component {self.name!r}", self.dofs, point, direction)


def place_along(station: Section, length: float) -> float:
    """Where a ``[[component.station]]`` lies on a beam of this length, in m; "end" is its far end."""
    if station.raw().get("at") == "end":
        station.take("at")
        return length
    return float(station.number("at", "m"))


def _material(part: Section) -> Material:
    name, young, poisson = part.text("name"), part.number("young", "N/m^2"), part.number("poisson", "1")
    density, loss_factor = part.number("density", "kg/m^3"), part.number("loss_factor", "1", 0.0)
    viscous = part.number("viscous", "s", 0.0)
    part.done()
    try:
        return Material(name, young, poisson, density, loss_factor, viscous)
    except InputError as error:
        raise InputError(f"{part.where}: {str(error).partition(': ')[2]}") from None


def _frame(where: str, axis: Array | None, up: Array | None, segments: tuple[Segment, ...]) -> Array:
    """Axis, width and height as rows of a right-handed set of unit vectors."""
    assert axis is not None
    along = axis / np.linalg.norm(axis)
    if up is None:
        if not all(s.lies_any_way for s in segments):
            raise InputError(f"{where}: up is missing, expected the direction of the height of its sections")
        up = np.eye(3)[int(np.argmin(np.abs(along)))]
    across = np.array(up, dtype=float) - (np.array(up, dtype=float) @ along) * along
    if not np.linalg.norm(across) > 1e-6 * np.linalg.norm(up):
        raise InputError(f"{where}: up is {np.array(up).tolist()}, expected a direction across the axis")
    height = across / np.linalg.norm(across)
    return np.array([along, np.cross(height, along), height])
