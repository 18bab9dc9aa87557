"""Components as they are drawn: blocks, bars and nodes; what has no place, at its connections."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ..components.component import Component
from ..shapes.drawn import Drawn
from .marks import Mark, length_words
from .piece import COLOURS, Label, Piece
from .places import Places

_MOST_NODES = 2000
"""Beyond so many nodes no lines are drawn between them."""


def bodies(places: Places, size: float) -> Iterator[Mark]:
    """Every component; ``size`` of the machine in m."""
    for number, component in enumerate(places.machine.components):
        colour = COLOURS[number % len(COLOURS)]
        drawn = places.drawn.get(component.name)
        if component.name in places.machine.outlines:
            yield from _outlined(places, component, colour, size)
        if drawn is None:
            yield from _placeless(places, component, colour)
        else:
            yield from _drawn(places, component, drawn, colour)


def _drawn(places: Places, component: Component, drawn: Drawn, colour: str) -> Iterator[Mark]:
    name, first = f"{component.name} ({type(component).kind})", places.first[component.name]
    glass, outlined = drawn.holds == 1, component.name in places.machine.outlines
    for solid in () if outlined else drawn.solids:
        edges = tuple((*face, face[0]) for face in solid.faces) if len(solid.faces) == 6 else ()
        yield Piece(
            name, component.name, colour, solid.corners, first + solid.frame, solid.faces, edges, glass=glass, width=0.7
        )
    origins = np.array([frame.origin for frame in drawn.frames[: drawn.holds]])
    if drawn.dots:
        lines: tuple[tuple[int, ...], ...] = ()
        if 1 < len(origins) <= _MOST_NODES:
            # Lengths from 1 on: nodes at one place are joined too.
            tree = minimum_spanning_tree(1.0 + cdist(origins, origins) / np.ptp(origins, axis=0).max(initial=1e-9))
            lines = tuple((int(i), int(j)) for i, j in zip(*tree.nonzero(), strict=True))
        numbers = np.arange(len(origins))
        yield Piece(
            name, component.name, colour, origins, first + numbers, (), lines, tuple(numbers.tolist()), width=1.2
        )
    elif drawn.holds == 1:
        yield from _spokes(places, component, colour)
    yield Label(component.name, np.mean(origins, axis=0), first, colour)


def _outlined(places: Places, component: Component, colour: str, size: float) -> Iterator[Mark]:
    """The surface of its outline, each corner with the frame next to it, where the axes have taken it."""
    corners, triangles = places.machine.outlines[component.name].surface()
    moved = [a for a in places.machine.axes if component.name in a.moves]
    corners = corners + sum((a.position * np.array(a.direction) for a in moved), np.zeros(3))
    held = places.loose.get(component.name, [])
    if component.name in places.drawn:
        drawn, first = places.drawn[component.name], places.first[component.name]
        origins = np.array([frame.origin for frame in drawn.frames])
        near = np.asarray(cKDTree(origins).query(corners)[1])
        frames = first + near
        apart = float(np.min(np.linalg.norm(corners - origins[near], axis=1)))
        if apart > max(size, float(np.linalg.norm(np.ptp(corners, axis=0)))):
            yield (
                f"the outline of {component.name} lies {length_words(apart)} from it: is its unit another than "
                f"{places.machine.outlines[component.name].unit}, or does it want an at?"
            )
    else:
        frame = places.side(*held[0]) if held else 0
        frames = np.full(len(corners), frame)
        how = f"moves with {held[0][0]}" if held else "stays where it is, as it has no connection with a place"
        yield f"the outline of {component.name} {how}."
    faces = tuple((int(a), int(b), int(c)) for a, b, c in triangles)
    name = f"{component.name} ({type(component).kind})"
    yield Piece(name, component.name, colour, corners, frames, faces, glass=True)


def _spokes(places: Places, component: Component, colour: str) -> Iterator[Mark]:
    """From the centre of a body to what holds it and to its points."""
    first = places.first[component.name]
    ends = [frame.origin for frame in places.drawn[component.name].frames[1:]]
    grouped = {c.name for bundle in places.machine.bundles for c in bundle.connections}
    alone = [c for c in places.machine.connections if component.name in c.between and c.name not in grouped]
    ends += [np.array(c.at) for c in alone if c.at is not None]
    ends += [at for b in places.machine.bundles if component.name in b.between for at in b.places.values()]
    if not ends:
        return
    points = np.unique(np.round(ends, 9), axis=0)
    corners = np.concatenate([places.frames[first].origin[None], points])
    lines = tuple((0, i) for i in range(1, len(corners)))
    name = f"{component.name}: from its centre to its points and contacts"
    yield Piece(name, component.name, colour, corners, np.full(len(corners), first), lines=lines, dots=(0,), width=0.6)


def _placeless(places: Places, component: Component, colour: str) -> Iterator[Mark]:
    """A dot wherever a component without a shape in space is held, moving along what holds it."""
    name = f"{component.name} ({type(component).kind})"
    held = places.loose[component.name]
    if not held:
        yield f"{name} has no place in space and none of its connections has one: it is not drawn."
        return
    yield f"{name} has no place in space: it is drawn as dots where its connections are, moving along them."
    for dof, at, direction in held:
        frame = places.side(dof, at, direction)
        yield Piece(f"{name}, held at {dof}", component.name, colour, at[None], np.array([frame]), dots=(0,))
    yield Label(component.name, held[0][1], frame, colour)
