"""Directions of the tool that are mixed up, and a point of the cut that it never comes to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from jointlib.arrays import Array

from ..components.nodes import DIRECTIONS
from ..model.machine import Machine

_FAR, _LEFT = 0.3, 0.1
"""m between both, which a shorter tool may leave, and what of it is left where the axes have brought them together."""


def wrong_tool_point(machine: Machine) -> Iterator[str]:
    """Tool and workpiece, the sides of ``x = "tool.x - workpiece.x"``, further apart than the axes can bring them.

    The sentence is the same for every direction of the tool.
    """
    for dof in machine.tool.values():
        sides = [side.strip() for side in dof.split(" - ")]
        places = [place for side in sides if (place := place_of(machine, side)) is not None]
        if len(sides) != 2 or len(places) != 2:
            continue
        one, other = (side.rpartition(".")[0] for side in sides)
        apart = places[1] - places[0]
        left = apart.copy()
        for axis in machine.axes:
            moved = [side.partition(".")[0] in axis.moves for side in sides]
            if moved[0] != moved[1]:
                n = np.asarray(axis.direction, dtype=float) * (1 if moved[0] else -1)
                low, high = (-np.inf, np.inf) if axis.travel is None else np.array(axis.travel) - axis.position
                left -= np.clip(left @ n, low, high) * n
        far = float(np.linalg.norm(apart))
        if far > _FAR and np.linalg.norm(left) > _LEFT:
            there, at = (", ".join(f"{round(float(x), 4) + 0.0:g}" for x in place) for place in places)
            yield (
                f"{other}: it lies at ({at}) m, {far:.4g} m from {one} at ({there}) m, and no axis brings them "
                f"together; expected the place where the tool cuts, within {_FAR:g} m of it: were mm read as m?"
            )


def mixed_directions(machine: Machine) -> Iterator[str]:
    """A difference of two different axes, and a direction without the workpiece that another one is relative to."""
    where = machine.tool_table
    sides = {axis: [side.strip() for side in dof.split(" - ")] for axis, dof in machine.tool.items()}
    whole = {axis: pair for axis, pair in sides.items() if len(pair) == 2}
    for axis, (tool, work) in whole.items():
        one, other = (side.rpartition(".")[2].removeprefix("u") for side in (tool, work))
        if (
            one != other
            and {one, other} <= set(DIRECTIONS)
            and all(place_of(machine, s) is not None for s in (tool, work))
        ):
            yield (
                f"{where}: {axis} is the difference of {tool} and {work}, motions along different axes; expected the "
                f"same on both sides, as {along(work, tool)}"
            )
    for axis, (tool, *relative) in sides.items():
        for by, (first, work) in whole.items():
            wanted = along(work, tool)
            if not relative and first.rpartition(".")[0] == tool.rpartition(".")[0] and wanted in machine.dofs:
                yield (
                    f"{where}: {by} is relative to {work}, and {axis} is {tool} alone, as if the workpiece stood still "
                    f"in it; expected {tool} - {wanted}"
                )
                break


def along(dof: str, other: str) -> str:
    """A dof along the axis of another one: ``table.ux`` along ``tip.y`` is ``table.uy``."""
    point, _, name = dof.rpartition(".")
    own = other.rpartition(".")[2].removeprefix("u")
    return f"{point}.{'u' if name.startswith('u') and not own.startswith('r') else ''}{own}"


def place_of(machine: Machine, dof: str) -> Array | None:
    """Where the point of a ``component.point.dof`` is, in m; None where nobody told."""
    component, _, rest = dof.partition(".")
    drawn = next((c.drawn() for c in machine.components if c.name == component), None)
    point = rest.rpartition(".")[0]
    return None if drawn is None or point not in drawn.names else drawn.frames[drawn.names.index(point)].origin
