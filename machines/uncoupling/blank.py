"""A blank whose receptances are known by its model: what is taken off a measured assembly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, nearest
from jointlib.io.toml_file import parsed

from ..components.beam import Beam
from ..components.component import Component
from ..components.nodes import DIRECTIONS
from ..files.component_file import read_component
from ..files.tool_alone import read_tool

_ALONG = 1e-9
_ACROSS = 1e-6
"""Share of a motion across its plane, over that in its plane, from which on a section bends askew."""


@dataclass(frozen=True)
class Plane:
    """A plane of bending: deflection along one machine axis, rotation about another, as 0, 1 or 2 for x, y or z."""

    deflection: int
    rotation: int

    @property
    def words(self) -> tuple[str, str]:
        """Directions of the degrees of freedom of a node: ``x`` and ``ry``."""
        return DIRECTIONS[self.deflection], DIRECTIONS[3 + self.rotation]


@dataclass(frozen=True, eq=False)
class Blank:
    """A beam along a machine axis, with the station that is coupled to the spindle.

    Raises
    ------
    InputError
        Where its axis is none of the machine's, or there is no such station.
    """

    beam: Beam
    coupled: str
    where: str

    def __post_init__(self) -> None:
        if self.coupled not in self.beam.stations:
            known = nearest(self.coupled, self.beam.stations)
            raise InputError(f"{self.where}: no station {self.coupled!r} that is coupled, {known}")
        along = np.abs(self.beam.frame[0])
        if not np.max(along) > 1 - _ALONG:
            raise InputError(
                f"{self.where}: axis is {self.beam.frame[0].tolist()}, expected one along x, y or z of the machine"
            )

    @property
    def axis(self) -> int:
        """The machine axis that it lies along."""
        return int(np.argmax(np.abs(self.beam.frame[0])))

    @property
    def planes(self) -> tuple[Plane, Plane]:
        """Its two planes of bending."""
        first, second = (k for k in range(3) if k != self.axis)
        return Plane(first, second), Plane(second, first)

    @property
    def length(self) -> float:
        """m, of its segments."""
        return float(sum(segment.length for segment in self.beam.segments))

    def reach(self, places: Sequence[str]) -> float:
        """m from the coupled end to the farthest of these stations."""
        end = self.beam.stations[self.coupled]
        return max(abs(self.beam.stations[place] - end) for place in places)

    @property
    def position(self) -> Array:
        """Of the coupled end in m, machine axes."""
        names = list(self.beam.stations)
        return np.asarray(self.beam.nodes.positions[names.index(self.coupled)])

    def receptance(self, frequency: Array, plane: Plane, places: Sequence[str]) -> ComplexArray:
        """Of the free blank in a plane: deflections of the places, then deflection and rotation of the coupled end.

        (lines, places + 2, places + 2), in m/N, 1/N and 1/(N m).
        """
        deflection, rotation = plane.words
        dofs = [f"{place}.{deflection}" for place in places]
        own = [*dofs, f"{self.coupled}.{deflection}", f"{self.coupled}.{rotation}"]
        other = self.planes[0] if plane == self.planes[1] else self.planes[1]
        askew = [f"{place}.{other.words[0]}" for place in (*places, self.coupled)]
        omega = 2 * np.pi * frequency
        H = self.beam.between(omega, self._rows([*own, *askew]), self._rows(own))
        across, inside = H[:, len(own) :, :-1], H[:, : len(own) - 1, :-1]
        if np.max(np.abs(across)) > _ACROSS * np.max(np.abs(inside)):
            raise InputError(
                f"{self.where}: a force along {deflection} bends it along {other.words[0]} too, expected a section "
                "whose sides lie along the machine axes"
            )
        return np.asarray(H[:, : len(own)])

    def _rows(self, dofs: Sequence[str]) -> Array:
        rows = np.zeros((len(dofs), len(self.beam.dofs)))
        for row, dof in zip(rows, dofs, strict=True):
            row[self.beam.dofs.index(dof)] = 1.0
        return rows


def _of_tool(path: Path) -> Component:
    """The cutter with its holder in a tool file, where they are one piece."""
    parts, _ = read_tool(path)
    if len(parts) != 1:
        raise InputError(f"{path}: [joint] lies between shank and holder, expected a blank of one piece, without it")
    return parts[0]


def read_blank(path: Path, coupled: str | None, places: Sequence[str]) -> Blank:
    """The blank in a component or tool file; without ``coupled`` the end behind it, or else its one silent station.

    Silent is a station at which nothing was measured.
    """
    tool = parsed(path)[1].get("schema") == "jointlib/tool/1"
    part = _of_tool(path) if tool else read_component(path, "blank")
    if coupled is None and tool and isinstance(part, Beam):
        coupled = part.held[0]  # what holds a tool is its face, or without a holder its shank
    if not isinstance(part, Beam):
        raise InputError(f"{path}: kind is {part.kind!r}, expected a beam, whose rotations are known")
    if coupled is None:
        silent = [name for name in part.stations if name not in places]
        if len(silent) != 1:
            found = ", ".join(silent) or "none"
            raise InputError(
                f"{path}: stations without a measured response: {found}; expected one, the end that is coupled to the "
                "spindle, or --at with its name"
            )
        coupled = silent[0]
    elif coupled in places:
        raise InputError(f"--at: responses were measured at {coupled!r}, expected the end that the spindle covers")
    return Blank(part, coupled, str(path))
