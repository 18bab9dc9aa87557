"""What a machine shows of itself: a sentence, a table of its connections, and a plain picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from jointlib.shown.pictures import literal, name_curves
from jointlib.shown.result import Columns

from ..components.connection import GROUND, Connection

if TYPE_CHECKING:
    from .machine import Machine


_TOLD = 6
"""Names that a sentence lists."""


def told(machine: Machine) -> str:
    """What it is made of, where its tool is, and what is still to be identified."""
    rigid = len(machine.connections) - len(machine.flexible)
    parts = _counted(len(machine.components), "component", "components")
    joined = _counted(len(machine.connections), "connection", "connections") + (f" ({rigid} rigid)" if rigid else "")
    free = _counted(len(machine.dofs), "degree of freedom", "degrees of freedom")
    tool = ", ".join(f"tool {axis} = {machine.tool[axis]}" for axis in machine.tool_axes) or "no tool"
    said = f"{machine.name!r} of {parts} and {joined}, {free}; {tool}"
    missing = [c.name for c in machine.flexible if c.joint is None]
    more = ", …" if len(missing) > _TOLD else ""
    return f"{said}\nstill to be identified: {', '.join(missing[:_TOLD])}{more}" if missing else said


def _counted(number: int, one: str, several: str) -> str:
    return f"{number} {one if number == 1 else several}"


def of_connections(machine: Machine) -> Columns:
    """A row per connection; its place is nan where it has none."""
    unknown = (np.nan, np.nan, np.nan)
    places = np.array([unknown if c.at is None else c.at for c in machine.connections], dtype=float).reshape(-1, 3)
    return {
        "connection": ([c.name for c in machine.connections], ""),
        "first": ([c.between[0] for c in machine.connections], ""),
        "second": ([c.between[1] for c in machine.connections], ""),
        "joint": ([_held_by(c) for c in machine.connections], ""),
        **{axis: (places[:, i], "m") for i, axis in enumerate("xyz")},
    }


def _held_by(connection: Connection) -> str:
    """Its laws, or what stands in their place."""
    if connection.joint is None:
        return "rigid" if connection.rigid else "to be identified"
    return " + ".join(law.kind for law in connection.joint.laws)


def draw_side(axes: Any, machine: Machine, directions: tuple[int, int]) -> None:
    """Components and the places of connections in mm, seen against the third direction of the machine axes."""
    from matplotlib.collections import PolyCollection

    across, up = directions
    for number, component in enumerate(machine.components):
        drawn = component.drawn()
        if drawn is None:
            continue
        colour = f"C{number % 10}"
        for solid in drawn.solids:
            corners = solid.corners[:, [across, up]] * 1e3
            faces = [corners[list(face)] for face in solid.faces]
            axes.add_collection(PolyCollection(faces, facecolor=colour, edgecolor=colour, alpha=0.15))
        points = np.array([frame.origin for frame in drawn.frames]).reshape(-1, 3) * 1e3
        axes.plot(points[:, across], points[:, up], "o", markersize=3, color=colour, label=literal(component.name))
    held = np.array([c.at for c in machine.connections if c.at is not None], dtype=float).reshape(-1, 3) * 1e3
    if len(held):
        axes.plot(held[:, across], held[:, up], "k+", markersize=5, label="connections")
    axes.autoscale_view()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel=f"{'xyz'[across]} [mm]", ylabel=f"{'xyz'[up]} [mm]")
    name_curves(axes)


def draw_chain(axes: Any, machine: Machine) -> None:
    """A line for every connection, from one of its components to the other; broken where it is rigid."""
    rows = [GROUND, *(component.name for component in machine.components)]
    for number, connection in enumerate(machine.connections):
        ends = [rows.index(side.partition(".")[0]) for side in connection.between]
        axes.plot([number, number], ends, "o--" if connection.rigid else "o-", color="#0b5394")
    axes.set_yticks(range(len(rows)), [literal(row) for row in rows])
    names = [literal(connection.name) for connection in machine.connections]
    axes.set_xticks(range(len(names)), names, rotation=30, ha="right")
    axes.set(xlabel="connection", ylabel="component")


def has_place(machine: Machine) -> bool:
    """Whether any part of it has a place in space."""
    return any(c.drawn() is not None for c in machine.components) or any(c.at is not None for c in machine.connections)
