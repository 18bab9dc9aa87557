"""Marks in the picture: axes where they stand, tool and drive, the floor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from jointlib.arrays import Array

from ..components.connection import motion_row
from ..components.static_load import axis_of
from ..model.axes import Axis
from .piece import DRIVE, TOOL, TRAVEL, Label, Piece, across
from .places import Places

Mark: TypeAlias = Piece | Label | str
"""A piece, a label, or a sentence about what cannot be drawn."""
_TOOL = 0.08
"""Length of an arrow over the size of the machine."""
_CELLS = 8


def marks(places: Places, size: float, up: Array) -> Iterator[Mark]:
    """Everything that is no part of the machine itself."""
    machine = places.machine
    for axis in machine.axes:
        yield from _axis(places, axis, size)
    for word, dof in machine.tool.items():
        yield from _arrow(places, f"tool {word}", dof, TOOL, size)
    if machine.drive is not None and machine.drive not in machine.tool.values():
        yield from _arrow(places, "drive", machine.drive, DRIVE, size)
    yield from _floor(places, size, up)


def arrow(at: Array, direction: Array, length: float) -> tuple[Array, tuple[tuple[int, ...], ...]]:
    """Corners and lines of an arrow that begins at a point."""
    tip, (u, v) = at + length * direction, across(direction)
    back = tip - 0.3 * length * direction
    barbs = [back + 0.12 * length * w for w in (u, v, -u, -v)]
    return np.array([at, tip, *barbs]), ((0, 1), *((1, i) for i in range(2, 6)))


def _axis(places: Places, axis: Axis, size: float) -> Iterator[Mark]:
    """A line over its travel through what it moves, with the place where it stands."""
    moved = [name for name in axis.moves if name in places.drawn]
    if not moved:
        yield f"{axis.words()}; what it moves has no place in space."
        return
    at, n = places.frames[places.first[moved[0]]].origin, np.array(axis.direction)
    low, high = (-0.1 * size, 0.1 * size) if axis.travel is None else [end - axis.position for end in axis.travel]
    corners, lines = arrow(at + low * n, n, high - low)
    head = corners[1] - 0.025 * size * (n + np.array([across(n)[0], -across(n)[0]]) * 0.4)
    stop = at + low * n + 0.015 * size * np.array([across(n)[0], -across(n)[0]])
    corners = np.concatenate([corners[:2], head, stop])
    lines = ((0, 1), (2, 1, 3), (4, 5))
    yield Piece(axis.words(), axis.name, TRAVEL, corners, np.zeros(6, dtype=int), lines=lines, width=1.6)
    yield Label(f"axis {axis.name}", corners[1], 0, TRAVEL)


def _arrow(places: Places, word: str, dof: str, colour: str, size: float) -> Iterator[Mark]:
    """Where a degree of freedom is and along what it moves; of a difference, its first term."""
    first = dof.partition(" - ")[0]
    component, _, own = first.partition(".")
    frame, found = places.of_dof(first), axis_of(own.rpartition(".")[2])
    name = f"{word}: {dof}"
    if frame is not None and found is not None:
        at, n = places.frames[frame].origin, np.eye(3)[found]
        frame = places.shifted(frame)
    else:
        held = places.loose.get(component, ())
        if not held:
            yield f"{word} is {dof}, which has no place in space."
            return
        at, n = held[0][1], held[0][2]
        row = motion_row(first, places.machine.components, word)
        frame = places.along(row, at, n)
        yield f"{word} is {first}, whose place is not known: it is drawn where {component} is held."
    corners, lines = arrow(at, n, _TOOL * size)
    yield Piece(name, word, colour, corners, np.full(len(corners), frame), lines=lines, dots=(0,), width=2.2)
    yield Label(word, corners[1], frame, colour)


def _floor(places: Places, size: float, up: Array) -> Iterator[Mark]:
    """A grid under the machine, of cells that are a round length."""
    points = np.array(list(places.points()))
    flat = np.delete(np.arange(3), int(np.argmax(np.abs(up))))
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    cell = round_length(size / _CELLS)
    begin, end = np.floor(low / cell - 0.5) * cell, np.ceil(high / cell + 0.5) * cell
    floor = np.where(up > 0, low, high)
    corners: list[Array] = []
    for one, other in (flat, flat[::-1]):
        for place in np.arange(begin[one], end[one] + cell / 2, cell):
            for limit in (begin[other], end[other]):
                corner = floor.copy()
                corner[one], corner[other] = place, limit
                corners.append(corner)
    lines = tuple((i, i + 1) for i in range(0, len(corners), 2))
    name = f"floor, a cell is {length_words(cell)}"
    zero = np.zeros(len(corners), dtype=int)
    yield Piece(name, "floor", "#d8dee4", np.array(corners), zero, lines=lines, width=0.6, backdrop=True)


def round_length(about: float) -> float:
    """1, 2 or 5 times a power of ten, m."""
    power = 10.0 ** np.floor(np.log10(about))
    steps: Sequence[float] = (1.0, 2.0, 5.0, 10.0)
    return float(power * max(step for step in steps if step * power <= about * (1 + 1e-9)))


def length_words(length: float) -> str:
    """In mm below a metre."""
    return f"{length * 1e3:.4g} mm" if length < 1 else f"{length:.4g} m"
