"""Parameters of a machine's joints by their paths: ``connection.guide.joint.hertz_guide.preload``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import takewhile

import numpy as np

from jointlib.errors import InputError, nearest
from jointlib.joint import Joint

from ..components.connection import Connection
from ..indices import Index
from .machine import Machine


def changed_joints(machine: Machine, changes: tuple[tuple[str, float], ...]) -> tuple[Joint, ...]:
    """The joints of the flexible connections with some parameters changed."""
    joints = {c.name: c.joint for c in machine.flexible}
    by_place: dict[str, dict[str, float]] = {}
    for path, value in changes:
        place, parameter = joint_place(machine, path)
        by_place.setdefault(place, {})[parameter] = value
    for place, values in by_place.items():
        for name in rows_of(machine, place):
            old = joints[name]
            assert old is not None
            joints[name] = old.with_parameters(values)
    return tuple(j for j in joints.values() if j is not None)


def bundles(connections: Sequence[Connection]) -> dict[str, Index]:
    """The joints that one machine element stands for, by its `element_names`."""
    found: dict[str, list[int]] = {}
    for i, name in enumerate(element_names(connections)):
        found.setdefault(name, []).append(i)
    return {name: np.array(rows) for name, rows in found.items()}


def element_names(connections: Sequence[Connection]) -> list[str]:
    """The machine element that each joint is a part of: its bundle, else the connection itself.

    Deflections and rotations between the same two nodes, as between shank and holder, are two elements: ``shank`` and
    ``shank rotation``.
    """
    pairs = between_two_nodes(connections)
    names = []
    for i, connection in enumerate(connections):
        turned = " rotation" if i in pairs and connection.rotates else ""
        names.append(connection.bundle.partition(" (")[0] or pairs.get(i, connection.name) + turned)
    return names


def between_two_nodes(connections: Sequence[Connection]) -> dict[int, str]:
    """What the names of connections begin with, by row, that join the same two nodes and are some of them rotations."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for i, connection in enumerate(connections):
        nodes = tuple(side.rpartition(".")[0] for side in connection.between)
        if all(node.count(".") == 1 for node in nodes):
            groups.setdefault(nodes, []).append(i)
    out: dict[int, str] = {}
    for rows in groups.values():
        members = [connections[i] for i in rows]
        if len({one.rotates for one in members}) > 1:
            letters = zip(*(one.name for one in members), strict=False)
            shared_part = "".join(some[0] for some in takewhile(lambda some: len(set(some)) == 1, letters))
            out |= dict.fromkeys(rows, shared_part.rstrip("_.- ") or members[0].name)
    return out


def rows_of(machine: Machine, place: str) -> list[str]:
    """Flexible connections that a name stands for: itself, or those of `bundles`, or all that begin with it."""
    names = [c.name for c in machine.flexible]
    if place in names:
        return [place]
    if place in (known := bundles(machine.flexible)):
        return [names[i] for i in known[place]]
    return [n for n in names if n.startswith((f"{place}.", f"{place}_"))]


def joint_place(machine: Machine, path: str) -> tuple[str, str]:
    """Connection or bundle and parameter of a path ``connection.guide.joint.hertz_guide.preload``."""
    kind, _, rest = path.partition(".")
    place, marker, parameter = rest.partition(".joint.")
    names = [c.name for c in machine.flexible]
    if kind not in ("connection", "bundle") or not marker or not rows_of(machine, place):
        raise InputError(f"{machine.where}: path {path!r}: no joint at {place!r}, {nearest(place, names)}")
    return place, parameter


def joint_units(machine: Machine, paths: Iterable[str]) -> dict[str, str]:
    """Unit of the joint parameter of every path that names one; other paths are left out.

    Entries of the file itself (``connection.guide.joint.law[0].damping``) are no joint parameters.
    """
    units = {}
    for path in paths:
        if ".joint." not in path or ".joint.law[" in path:
            continue
        place, parameter = joint_place(machine, path)
        for name in rows_of(machine, place):
            joint = next(c.joint for c in machine.flexible if c.name == name)
            if joint is None:
                raise InputError(f"{machine.where}: the joint of {name!r} is not known yet, expected it identified")
            if parameter not in joint.parameters:
                raise InputError(
                    f"{machine.where}: path {path!r}: no parameter {parameter!r}, "
                    f"{nearest(parameter, joint.parameters)}"
                )
            units[path] = joint.units[parameter]
    return units
