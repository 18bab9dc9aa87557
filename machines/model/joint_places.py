"""Parameters of a machine's joints by their paths: ``connection.guide.joint.hertz_guide.preload``."""

from __future__ import annotations

from collections.abc import Iterable

from jointlib.errors import InputError, nearest
from jointlib.joint import Joint

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


def rows_of(machine: Machine, place: str) -> list[str]:
    """Flexible connections that a name stands for: itself, or the rows of a bundle."""
    names = [c.name for c in machine.flexible]
    return (
        [n for n in names if n == place or n.startswith((f"{place}.", f"{place}_"))] if place not in names else [place]
    )


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
