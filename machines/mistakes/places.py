"""Points and sizes that lie far outside of everything else, as where mm were read as m."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from jointlib.arrays import Array

from ..components.rigid import Rigid
from ..model.machine import Machine
from .bodies import block
from .elements import Element
from .scale import outside
from .tool_point import place_of

_LENGTHS, _LEAST = 20.0, 10.0
"""A contact or a point of a body as many of its lengths, and as many m, from its centre is on no such body."""
_APART = 10.0
"""m between two nodes that a joint joins."""
_WHOLE = 60.0
"""m from one end of a machine to the other; portal mills for ships and wind turbines reach 50."""
_SIZES = {
    "linear-guide": {"width": 5.0, "height": 5.0, "length": 5.0},
    "bearing-pair": {"ball_diameter": 1.0, "pitch_diameter": 10.0, "spacing": 10.0},
    "bolted-face": {"length": 20.0, "width": 20.0},
    "taper": {"diameter": 2.0, "length": 2.0},
}
"""m; a carriage has up to 0.5, and one that stands for all of a slide as much as that."""
_SMALL = 1e-4
"""m."""


def wrong_sizes(machine: Machine) -> Iterator[tuple[str, str]]:
    """Bundles larger or smaller than any: their names and what is wrong."""
    for placed in machine.bundles:
        kind = type(placed.bundle).kind
        for key, most in _SIZES.get(kind, {}).items():
            size = float(getattr(placed.bundle, key))
            said = outside(size, _SMALL, most, f"{placed.name}: the {key} of a {kind}", "mm", 1e3) if size else ""
            if said:
                yield placed.name, said
                break


def far_places(machine: Machine, found: Sequence[Element], wrong: Sequence[str]) -> Iterator[str]:
    """Contacts and points far off the body that they are on, and nodes that a joint joins over a gulf.

    What is told as ``wrong`` already, by its name, is left out.
    """
    held: dict[str, list[Element]] = {}
    for element in found:
        name = machine.flexible[element.rows[0]].bundle.partition(" (")[0] or element.name
        if element.at is not None and name not in wrong:
            held.setdefault(name, []).append(element)
    told: set[str] = set()
    for body in machine.components:
        if not isinstance(body, Rigid):
            continue
        assert body.centre is not None
        size = float(block(body)[2])
        own = {name: np.concatenate([e.at for e in some]) for name, some in held.items() if body.name in some[0].words}
        points = {f"{body.name}.{point}": np.array([at]) for point, at in body.points.items()}
        away = {name: float(np.max(np.linalg.norm(at - body.centre, axis=1))) for name, at in (own | points).items()}
        least = max(_LENGTHS * size, _LEAST)
        if own and min(np.min(np.linalg.norm(at - body.centre, axis=1)) for at in own.values()) > least:
            continue  # its centre is off
        for name, distance in away.items():
            if distance > least and name not in {*told, *wrong}:
                told.add(name)
                yield (
                    f"{name}: it lies {distance:.4g} m from the centre of {body.name}, a body of about {size:.3g} m; "
                    "were mm read as m?"
                )
    yield from _over_a_gulf(machine, {*told, *wrong})


def _over_a_gulf(machine: Machine, told: set[str]) -> Iterator[str]:
    """Joints between named nodes that lie far apart; each node that is ``told`` of is left out."""
    for connection in machine.connections:
        nodes = tuple(side.rpartition(".")[0] for side in connection.between)
        places = [place_of(machine, side) for side in connection.between]
        if "" in nodes or told.intersection(nodes) or places[0] is None or places[1] is None:
            continue
        apart = float(np.linalg.norm(places[0] - places[1]))
        if apart > _APART:
            told = told | set(nodes)
            yield (
                f"{connection.name}: {nodes[0]} and {nodes[1]}, which it joins, lie {apart:.4g} m apart: were mm read "
                "as m?"
            )


def too_large(machine: Machine) -> Iterator[str]:
    """A machine larger than any, and the point of it that lies farthest out."""
    places: dict[str, Array] = {}
    for part in machine.components:
        drawn = part.drawn()
        if drawn is not None:
            for frame, name in zip(drawn.frames, drawn.names, strict=False):
                places[f"{part.name}.{name}".rstrip(".")] = frame.origin
    places |= {c.name: np.array(c.at) for c in machine.connections if c.at is not None}
    if not places:
        return
    at = np.array(list(places.values()))
    span = float(np.max(np.ptp(at, axis=0)))
    if span > _WHOLE:
        out = int(np.argmax(np.linalg.norm(at - np.median(at, axis=0), axis=1)))
        where = ", ".join(f"{round(float(x), 4) + 0.0:g}" for x in at[out])
        yield (
            f"{list(places)[out]}: it lies at ({where}) m, and the machine is {span:.4g} m long, expected at most "
            f"{_WHOLE:g} m: were mm read as m?"
        )
