"""A machine while its spindle turns: parts and joints that depend on the spindle speed, taken at one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from jointlib.arrays import ArrayLike
from jointlib.errors import InputError

from .machine import Machine

SPINDLE_SPEED = "spindle-speed"
"""The condition, in rpm, of a modulation of a joint."""


def depends_on_speed(machine: Machine) -> bool:
    """Whether something in the machine depends on the speed of its spindle."""
    return any(True for _ in _dependent(machine))


def at_speed(machine: Machine, speed: float) -> Machine:
    """The machine while its spindle turns with ``speed`` in rpm: beams that turn, files by speed, joints by speed."""
    if not depends_on_speed(machine):
        return machine
    joined = tuple(
        c if c.joint is None else replace(c, joint=c.joint.based(SPINDLE_SPEED, speed)) for c in machine.connections
    )
    return replace(machine, components=tuple(c.at_speed(speed) for c in machine.components), connections=joined)


def beyond_speeds(machine: Machine, speed: ArrayLike) -> tuple[str, ...]:
    """A sentence for every part and joint that is not known at some of the speeds (rpm)."""
    asked = np.ravel(np.asarray(speed, dtype=float))
    said = []
    for what, low, high in _dependent(machine):
        if np.any((asked < low) | (asked > high)):
            said.append(f"{what} is known from {low:g} to {high:g} rpm and taken as at the nearer of them beyond.")
    return tuple(said)


def refuse_dependence(machine: Machine, what: str) -> None:
    """`InputError` where something depends on the spindle speed, for what takes a machine that is one at all speeds."""
    for dependent, _, _ in _dependent(machine):
        raise InputError(
            f"{machine.where}: {dependent} depends on the spindle speed, expected a machine that does not for {what}; "
            "`lobes` takes every speed with its own machine"
        )


def _dependent(machine: Machine) -> Iterator[tuple[str, float, float]]:
    """What depends on the speed, in words, and from where to where in rpm that is known."""
    for component in machine.components:
        if (known := component.known_speeds) is not None:
            yield (f"component {component.name!r}", *known)
    for connection in machine.connections:
        for m in () if connection.joint is None else connection.joint.modulations:
            if m.condition == SPINDLE_SPEED:
                known = (0.0, np.inf) if m.period is not None else (m.table[0][0], m.table[-1][0])
                yield (f"connection {connection.name!r}", *known)
