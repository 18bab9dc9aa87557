"""What a machine file can get wrong although every part of it makes sense: parts left loose, a joint written twice."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

import numpy as np

from jointlib.errors import InputError, together

from ..components.component import Component
from ..components.connection import GROUND, Connection
from ..model.machine import Machine


def check_sound(machine: Machine, whole: bool = True, doubtful: Collection[str] = ()) -> None:
    """Refuse parts that nothing joins to the tool or the drive, and connections that stand there twice.

    Where the machine is not ``whole``, as something is wrong with its file, nothing is known of loose parts, nor of
    the joints of ``doubtful`` connections.
    """
    together(*([partial(_not_loose, machine)] if whole else []), partial(_not_twice, machine, doubtful))


def _not_loose(machine: Machine) -> None:
    """What stands on the ground, by connections or by its own stiffness, is no oversight."""
    group = {name: name for name in (*(c.name for c in machine.components), GROUND)}
    for connection in machine.connections:
        sides = {group[part] for side in connection.between for part in _parts(side)}
        group = {name: min(sides) if own in sides else own for name, own in group.items()}
    asked = [dof for dof in (*machine.tool.values(), machine.drive) if dof is not None]
    reached = {group[part] for dof in asked for part in _parts(dof)} or {group[machine.components[0].name]}
    reached.add(group[GROUND])
    loose = [c.name for c in machine.components if group[c.name] not in reached and not _stands(c)]
    if loose:
        to = ", ".join(dict.fromkeys(asked)) or machine.components[0].name
        raise InputError(
            f"{machine.where}: component {loose[0]!r} is joined neither directly nor through others to {to} or "
            "the ground, expected a connection that does, or a machine without it"
        )


def _not_twice(machine: Machine, doubtful: Collection[str]) -> None:
    seen: dict[str, Connection] = {}
    for connection in machine.connections:
        if connection.rigid or connection.name in doubtful:
            continue
        key = repr((sorted(connection.between), connection.at, connection.direction, _held_by(connection)))
        if key in seen:
            raise InputError(
                f"{machine.where}: connections {seen[key].name!r} and {connection.name!r} hold the same motion by the "
                "same joint, expected it once, or one joint of twice the stiffness"
            )
        seen[key] = connection


def _held_by(connection: Connection) -> object:
    return connection.identify if connection.joint is None else connection.joint.laws


def _parts(side: str) -> list[str]:
    """The components of a side, or of a difference of two."""
    return [one.strip().partition(".")[0] for one in side.split(" - ")]


def _stands(component: Component) -> bool:
    """Whether its own stiffness holds it in every motion."""
    model = component.second_order()
    if model is None:
        return False
    rank = np.linalg.matrix_rank(model.stiffness, hermitian=True)
    return len(model.stiffness) > 0 and bool(rank == len(model.stiffness))
