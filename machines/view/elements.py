"""Contacts along their directions, and bundles as the machine elements that they are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from jointlib.arrays import Array

from ..bundles.bundle import Placed
from ..components.connection import GROUND as GROUND_SIDE
from ..components.connection import Connection
from ..model.machine import Machine
from ..shapes.solid import Solid, rail
from .marks import Mark
from .piece import DARK, GROUND, JOINT, RIGID, STEEL, Piece, across, line
from .places import Places

_REACH = 0.012
"""Half the length of a contact over the size of the machine."""
_COILS = 7
_PIECES = 12
"""That a rail is drawn in."""


def elements(places: Places, size: float) -> Iterator[Mark]:
    """Bundles, then all connections that have a place."""
    for bundle in places.machine.bundles:
        yield from _bundle(places, bundle)
    grouped = {c.name for bundle in places.machine.bundles for c in bundle.connections}
    for connection in places.machine.connections:
        yield from _contact(places, connection, connection.name in grouped, _REACH * size)


def _contact(places: Places, connection: Connection, grouped: bool, reach: float) -> Iterator[Mark]:
    """A spring between its sides, a bar where it is rigid, a tick where it is one of a bundle."""
    if connection.turns:
        return  # it holds a rotation, which has no line
    found = places.line(connection)
    if found is None:
        if any(places.of_dof(side) is None for side in connection.between if side != GROUND_SIDE):
            sides = " – ".join(connection.between)
            yield f"connection {connection.name} ({sides}) joins parts that have no place: it is not drawn."
        return  # what holds a rotation has no line
    at, n = found
    ahead, behind = (places.side(side, at, n) for side in connection.between)
    if connection.rigid:
        name, colour, width = f"{connection.name} (rigid)", RIGID, 1.5
    else:
        laws = " + ".join(law.kind for law in connection.joint.laws) if connection.joint else "to be identified"
        name, colour, width = f"{connection.name} ({laws})", JOINT, 1.0 if grouped else 1.4
    reach = 0.6 * reach if grouped else reach
    if grouped or connection.rigid:
        yield line(
            name, connection.name, colour, np.array([at - reach * n, at + reach * n]), np.array([behind, ahead]), width
        )
    else:
        turn = across(n)[0] * reach * 0.5
        inner = [at + reach * (0.6 * (2 * i / (_COILS - 1) - 1)) * n + (-1) ** i * turn for i in range(_COILS)]
        corners = np.array([at - reach * n, *inner, at + reach * n])
        half = len(corners) // 2
        yield line(
            name, connection.name, colour, corners, np.array([behind] * half + [ahead] * (len(corners) - half)), width
        )
    for side, sign in zip(connection.between, (1.0, -1.0), strict=True):
        if side == GROUND_SIDE:
            yield _ground(connection.name, at + sign * reach * n, sign * n, reach)


def _ground(name: str, at: Array, outward: Array, reach: float) -> Piece:
    """Hatching that stands for the ground."""
    u, v = across(outward)
    square = [at + reach * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    hatch = [
        at + reach * (a * u + depth * (0.7 * outward - 0.5 * u)) for a in (-0.5, 0.25, 1.0) for depth in (0.0, 1.0)
    ]
    corners = np.array([*square, *hatch])
    lines = ((0, 1, 2, 3, 0), (4, 5), (6, 7), (8, 9))
    return Piece(
        f"{name}: the ground", name, GROUND, corners, np.zeros(len(corners), dtype=int), lines=lines, width=1.0
    )


def _bundle(places: Places, bundle: Placed) -> Iterator[Mark]:
    kind, rails = type(bundle.bundle).kind, dict[tuple[float, ...], list[tuple[Array, Solid]]]()
    along = bundle.axes[0]
    low, high = _travel(places.machine, bundle)
    for label, drawn_at in bundle.places.items():
        # A nut has travelled from where its screw is held, see `machines.model.axes`.
        apart = _apart(places.machine, bundle) if type(bundle.bundle).slides_with == 1 else 0.0
        at = drawn_at + apart * along
        for solid in bundle.bundle.solids():
            if solid.runs:
                reach = np.where(solid.corners[:, 0] < 0, low, high)
                solid = Solid(solid.corners + reach[:, None] * np.eye(3)[0], solid.faces, solid.frame, True)
                key = tuple(np.round(bundle.axes[1:] @ at, 6).tolist())
                rails.setdefault(key, []).append((at, solid))
            else:
                yield _solid(places, bundle, f"{bundle.name}{label} ({kind})", at, solid)
    for number, one in enumerate(rails.values(), start=1):
        at, solid = one[0]
        spans = [(s.corners[:, 0] + along @ (place - at)) for place, s in one]
        ends = min(float(x.min()) for x in spans), max(float(x.max()) for x in spans)
        (left, bottom), (right, top) = solid.corners[:, 1:].min(axis=0), solid.corners[:, 1:].max(axis=0)
        section = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
        whole = rail(*ends, section, int(solid.frame[0]), _PIECES)
        yield _solid(places, bundle, f"rail {number} of {bundle.name}", at, replace(whole, runs=True))


def _solid(places: Places, bundle: Placed, name: str, at: Array, solid: Solid) -> Piece:
    placed = solid.placed(at, bundle.axes)
    sides = [side.partition(".")[0] for side in bundle.between]
    if solid.runs:
        frames = [
            places.near(sides[i], corner, held=False) for i, corner in zip(solid.frame, placed.corners, strict=True)
        ]
    else:
        here = [places.near(side, at) for side in sides]
        frames = [here[i] for i in solid.frame]
    colour = DARK if int(solid.frame[0]) == 0 else STEEL
    return Piece(name, bundle.name, colour, placed.corners, np.array(frames), solid.faces)


def _apart(machine: Machine, bundle: Placed) -> float:
    """How far the first side has travelled from the second along the bundle's axis, m."""
    sides = [side.partition(".")[0] for side in bundle.between]
    shift = [
        sum((a.position * np.array(a.direction) for a in machine.axes if s in a.moves), np.zeros(3)) for s in sides
    ]
    return float((shift[0] - shift[1]) @ bundle.axes[0])


def _travel(machine: Machine, bundle: Placed) -> tuple[float, float]:
    """How far the first side may still travel against the second, backwards (at most 0) and forwards, m."""
    sides, low, high = [side.partition(".")[0] for side in bundle.between], 0.0, 0.0
    for axis in machine.axes:
        moved = [side in axis.moves for side in sides]
        if axis.travel is not None and moved[0] != moved[1]:
            share = float(np.array(axis.direction) @ bundle.axes[0]) * (1.0 if moved[0] else -1.0)
            ends = sorted(share * (end - axis.position) for end in axis.travel)
            low, high = low + ends[0], high + ends[1]
    return low, high
