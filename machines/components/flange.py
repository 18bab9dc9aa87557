"""A flange: one ``[[connection]]`` that holds several relative motions of two parts rigidly, at a point."""

from __future__ import annotations

from collections.abc import Sequence

from jointlib.errors import InputError, nearest

from .connection import GROUND, Connection
from .nodes import DIRECTIONS


def flange(
    name: str, between: tuple[str, str], at: tuple[float, float, float], holds: Sequence[str] = DIRECTIONS
) -> tuple[Connection, ...]:
    """The rigid connections ``<name>.x`` … ``<name>.rz`` that hold two parts to each other at a point.

    Parameters
    ----------
    between
        Names of components with a shape in space; one may be ``"ground"``.
    at
        m, machine axes.
    holds
        Which relative motions, along and about the machine axes: x, y, z, rx, ry, rz.
    """
    where = f"connection {name!r}"
    if not holds:
        raise InputError(f"{where}: holds is empty, expected some of {', '.join(DIRECTIONS)}")
    for word in holds:
        if word not in DIRECTIONS:
            raise InputError(f"{where}: holds {word!r}, {nearest(word, DIRECTIONS)}")
        if list(holds).count(word) > 1:
            raise InputError(f"{where}: holds {word!r} twice, expected it once")
    for side in between:
        if "." in side and side != GROUND:
            raise InputError(
                f"{where}: side {side!r} is one dof, but a flange holds parts; expected the names of components alone, "
                "or no at and holds"
            )
    made = []
    for word in holds:
        axis = DIRECTIONS.index(word) % 3
        direction = (float(axis == 0), float(axis == 1), float(axis == 2))
        turns = word.startswith("r")
        made.append(Connection(f"{name}.{word}", between, None, True, None, at, direction, turns))
    return tuple(made)
