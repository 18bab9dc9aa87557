"""A machine: components, connections, the tool point and defaults; a declaration that computes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError, nearest, together
from jointlib.joint import Joint
from jointlib.shown.pictures import axes_of
from jointlib.shown.result import Columns, Shown

from ..bundles.bundle import Placed
from ..components.component import Component
from ..components.connection import Connection, motion_row
from ..components.nodes import NoNode, no_nodes
from ..components.static_load import StaticLoad
from ..shapes.outline import Outline
from .axes import Axis
from .groups import unmoved
from .machine_face import draw_chain, draw_side, has_place, of_connections, told

AXES = ("x", "y")


@dataclass(frozen=True, eq=False, repr=False)
class Machine(Shown):
    """Components joined at scalar connections.

    Parameters
    ----------
    tool
        Degrees of freedom of the tool point by axis: the feed x, the normal y; one that is left out is rigid. A
        difference, ``cutter.tip.x - table.ux``, is the motion relative to the workpiece.
    tool_name
        Which of several tools this is, where they have names.
    tool_table
        The table of its file that tells the tool.
    drive
        Degree of freedom, or difference, that a force acts on; the tool's x, else y, where it is not given.
    force
        Peak forces in N.
    frequency
        Lowest and highest frequency of interest in Hz.
    cutting
        Fields of `machines.cutting.Cutting` in SI, or None.
    static
        What it carries while it vibrates, or None: joints then vibrate about zero.
    axes
        The axes of its file, whose positions the components and connections stand at already.
    bundles
        The bundles that some of its connections were made of, for the eye: nothing is computed from them.
    compare
        Measurement files whose frequency responses are laid over what is predicted of it.
    cuts
        Measurement files of test cuts that it made.
    outlines
        Surfaces that components are drawn as, by name, where the file drew them, whatever position its axes have.
    source
        The file it came from.
    author
        Who made it, told in the FMUs made of it.
    """

    components: tuple[Component, ...]
    connections: tuple[Connection, ...] = ()
    name: str = "machine"
    tool: Mapping[str, str] = field(default_factory=dict)
    drive: str | None = None
    force: tuple[float, ...] = ()
    frequency: tuple[float, float] | None = None
    cutting: Mapping[str, Any] | None = None
    static: StaticLoad | None = None
    axes: tuple[Axis, ...] = ()
    bundles: tuple[Placed, ...] = ()
    compare: tuple[Path, ...] = ()
    cuts: tuple[Path, ...] = ()
    outlines: Mapping[str, Outline] = field(default_factory=dict)
    source: Path | None = None
    tool_name: str | None = None
    tool_table: str = "[tool]"
    author: str = ""

    def __post_init__(self) -> None:
        where = self.where
        if not self.components:
            raise InputError(f"{where}: no component, expected at least one")
        together(partial(self._check_names, "component"), partial(self._check_names, "connection"))
        for component in self.components:
            if "." in component.name or component.name in ("", "ground"):
                raise InputError(f"{where}: component {component.name!r}, expected a name without a dot, not 'ground'")
        together(lambda: self._placed, *self._checks())  # what cannot be placed is refused
        self._check_constraints()

    def _checks(self) -> Iterator[Callable[[], object]]:
        """What must hold beside names and connections, each for itself."""
        where = self.where
        for axis, dof in self.tool.items():
            if axis not in AXES:
                raise InputError(f"{where}: [tool]: unknown axis {axis!r}, {nearest(axis, AXES)}")
            yield partial(motion_row, dof, self.components, f"{where}: [tool]: {axis}")
        if len(self.tool) == len(AXES):
            yield self._check_tool
        if self.drive is not None:
            yield partial(motion_row, self.drive, self.components, f"{where}: [response]: drive")
        yield partial(checked_forces, self.force, f"{where}: [response]")
        if self.static is not None:
            flexible = [c.name for c in self.flexible]
            yield partial(self.static.check, self.dofs, flexible, f"{where}: [static]")
        if self.frequency is not None:
            yield partial(checked_range, self.frequency, f"{where}: [response]")

    def _check_tool(self) -> None:
        """Two directions of the tool are two motions: a force along one does not push the other as a whole."""
        known, dofs = set(self.dofs), self.tool_dofs
        if not {side for dof in dofs for side in dof.split(" - ", 1)} <= known:
            return  # refused by its name
        one, other = (motion_row(dof, self.components, self.where) for dof in dofs)
        if np.array_equal(one, other) or np.array_equal(one, -other):
            how = "the same degree of freedom as" if np.array_equal(one, other) else "the opposite of"
            raise InputError(
                f"{self.where}: [tool]: y: {dofs[1]!r} is {how} x, {dofs[0]!r}, expected a motion along another axis, "
                "or x alone"
            )

    def _check_names(self, what: str) -> None:
        names = [each.name for each in (self.components if what == "component" else self.connections)]
        twice = dict.fromkeys(name for name in names if len(set(names)) < len(names) and names.count(name) > 1)
        if twice:
            said = (f"{what} {name!r} is declared twice, expected different names" for name in twice)
            raise InputError(*(f"{self.where}: {each}" for each in said))

    @property
    def tool_axes(self) -> tuple[str, ...]:
        """The directions in which the tool moves, x before y."""
        return tuple(axis for axis in AXES if axis in self.tool)

    @property
    def tool_dofs(self) -> tuple[str, ...]:
        """The degrees of freedom of the tool along them."""
        return tuple(self.tool[axis] for axis in self.tool_axes)

    def _place(self, connection: Connection) -> Array:
        row = connection.row(self.components)
        if not np.any(row):
            raise InputError(f"connection {connection.name!r} holds nothing, expected a side that moves")
        return row

    @cached_property
    def _placed(self) -> dict[str, tuple[Connection, Array]]:
        """Its connections with their rows, which are asked for many times."""
        placed: dict[str, tuple[Connection, Array]] = {}
        refused: dict[tuple[str, str], str] = {}
        apart: dict[str, list[tuple[str, NoNode]]] = {}
        for connection in self.connections:
            bundle = connection.name.rpartition(".")[0] or connection.name
            try:
                placed[connection.name] = connection, self._place(connection)
            except NoNode as error:
                apart.setdefault(error.where, []).append((bundle, error))
            except InputError as error:
                # The rows of a bundle are refused for one reason.
                refused.setdefault((bundle, str(error).replace(connection.name, "")), str(error))
        if refused or apart:
            raise InputError(*(f"{self.where}: {said}" for said in [*map(no_nodes, apart.values()), *refused.values()]))
        return placed

    def _row(self, connection: Connection) -> Array:
        known, row = self._placed.get(connection.name, (None, None))
        return row if known is connection and row is not None else connection.row(self.components)

    def _check_constraints(self) -> None:
        rows = self.rows([c for c in self.connections if c.rigid])
        for count, connection in enumerate((c for c in self.connections if c.rigid), start=1):
            scaled = rows[:count] / np.linalg.norm(rows[:count], axis=1, keepdims=True)
            if np.linalg.matrix_rank(scaled, tol=1e-9) < count:
                raise InputError(
                    f"{self.where}: connection {connection.name!r} is rigid but repeats what rigid ones before it hold"
                )

    @property
    def where(self) -> str:
        """How messages begin: the file, else the name."""
        return str(self.source) if self.source is not None else f"machine {self.name!r}"

    @property
    def dofs(self) -> tuple[str, ...]:
        """All degrees of freedom as ``component.dof``, in order."""
        return tuple(f"{c.name}.{dof}" for c in self.components for dof in c.dofs)

    def remarks(self) -> tuple[str, ...]:
        """What the components have to tell of themselves, and what tool and drive do not move, a sentence each."""
        own = tuple(sentence for component in self.components for sentence in component.remarks())
        owner = np.repeat(np.arange(len(self.components)), [len(c.dofs) for c in self.components])
        names = [c.name for c in self.components]
        moved = self.dof_rows([*self.tool.values(), *([self.drive] if self.drive else [])], "remarks")
        if self.tool_name is not None:
            own = (f"The tool is {self.tool_name!r}.", *own)
        return own + unmoved(owner, names, self.rows(self.connections), self.rows(self.flexible), moved)

    @cached_property
    def known_band(self) -> tuple[float, float]:
        """Lowest and highest frequency in Hz at which every component is known."""
        bands = np.array([component.band for component in self.components])
        return float(np.max(bands[:, 0])), float(np.min(bands[:, 1]))

    @property
    def without_equations(self) -> tuple[str, ...]:
        """Components that only a receptance is known of; the check against python-control needs equations."""
        return tuple(c.name for c in self.components if c.second_order() is None and c.first_order() is None)

    @property
    def flexible(self) -> tuple[Connection, ...]:
        """The connections that carry a joint."""
        return tuple(c for c in self.connections if not c.rigid)

    def rows(self, connections: Sequence[Connection]) -> Array:
        """B of these connections, shape (number of connections, number of dofs)."""
        rows = [self._row(c) for c in connections]
        return np.array(rows).reshape(len(rows), len(self.dofs))

    def dof_rows(self, dofs: Sequence[str], what: str) -> Array:
        """Rows of these dofs, or differences of two, shape (number of names, number of dofs)."""
        rows = [motion_row(dof, self.components, f"{self.where}: {what}") for dof in dofs]
        return np.array(rows).reshape(len(rows), len(self.dofs))

    def joints(self) -> tuple[Joint, ...]:
        """The joints of the flexible connections; one that is still to be identified is refused by name."""
        found = []
        for connection in self.flexible:
            if connection.joint is None:
                raise InputError(
                    f"{self.where}: connection {connection.name!r} has no joint yet; identify it and hand it over with "
                    f"machine.with_joint({connection.name!r}, joint), or use `jointlib run`"
                )
            found.append(connection.joint)
        return tuple(found)

    def with_joint(self, connection: str, joint: Joint) -> Machine:
        """The same machine with this joint in the named connection."""
        return self.with_joints({connection: joint})

    def with_joints(self, joints: Mapping[str, Joint]) -> Machine:
        """The same machine with these joints in the connections named; what else it is made of is checked once."""
        names = [c.name for c in self.flexible]
        for name in joints:
            if name not in names:
                raise InputError(f"{self.where}: no flexible connection {name!r}, {nearest(name, names)}")
        changed = tuple(replace(c, joint=joints[c.name]) if c.name in joints else c for c in self.connections)
        return replace(self, connections=changed)

    def driven_dof(self, drive: str | None = None) -> str:
        """Where a force acts: ``drive``, else the default of the file, else the tool."""
        for dof in (drive, self.drive, *(self.tool.get(axis) for axis in AXES)):
            if dof is not None:
                self.dof_rows([dof], "drive")
                return dof
        raise InputError(f"{self.where}: no drive is given and the machine has no tool, expected a dof to drive")

    def finding(self) -> str:
        """What it is made of, where its tool is, and what is still to be identified."""
        return told(self)

    def columns(self) -> Columns:
        """A row per connection: what it joins, by what, and where it acts."""
        return of_connections(self)

    def plot(self, ax: Any = None, seen: str = "xz") -> Any:
        """Components and connections in mm along two axes; what joins which, where no part has a place in space."""
        axes = axes_of(ax)
        if len(seen) != 2 or len({*seen} & {*"xyz"}) != 2:
            raise InputError(f"plot: seen is {seen!r}, expected two axes such as 'xz'")
        if has_place(self):
            draw_side(axes, self, ("xyz".index(seen[0]), "xyz".index(seen[1])))
        else:
            draw_chain(axes, self)
        return axes


def checked_range(frequency: Sequence[float], where: str) -> tuple[float, float]:
    """Lowest and highest frequency in Hz, finite, positive and in this order."""
    low, high = (float(f) for f in frequency)
    if not (np.isfinite(low) and np.isfinite(high) and 0 < low < high):
        raise InputError(f"{where}: frequency runs from {low:g} to {high:g} Hz, expected 0 < low < high")
    return low, high


def checked_forces(force: Sequence[float], where: str) -> tuple[float, ...]:
    """Peak forces in N, finite and positive."""
    forces = tuple(float(f) for f in force)
    for value in forces:
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{where}: force is {value:g} N, expected more than 0")
    return forces
