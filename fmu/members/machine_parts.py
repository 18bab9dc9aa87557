"""A machine cut at its joints: what becomes an FMU of its own, and where its parts touch."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from machines.components.component import Component
from machines.components.lumped import Lumped
from machines.components.static_load import turns
from machines.coupling.second_order import MachineEquations, machine_equations
from machines.model.machine import AXES
from machines.model.machine import Machine as Machine
from machines.model.spindle_speed import SPINDLE_SPEED

_NOTHING = 1e-12


@dataclass(frozen=True, eq=False)
class Body:
    """Components that rigid connections tie together, in their generalised coordinates p."""

    name: str
    component: Component
    ports: Mapping[str, Array]
    """Rows over p: a force on the port acts along its row, the motion of the port is read along it."""
    turning: frozenset[str] = frozenset()
    """Ports whose motion is an angle, on which a moment acts."""


@dataclass(frozen=True, eq=False)
class Link:
    """A joint and the ports it acts on: −f on the first and, unless the other side stands still, +f on the second.

    With one port the row of that port gives the whole relative displacement.
    """

    name: str
    joint: Joint
    ends: tuple[tuple[str, str], ...]
    """Names of body and port, one or two."""
    turns: bool = False
    """Its motion is an angle, its force a moment."""


@dataclass(frozen=True, eq=False)
class Parts:
    """What a machine consists of, bodies and links in the order of their names."""

    word: str
    """The machine's name, as far as it is letters, digits and underscores."""
    bodies: tuple[Body, ...]
    links: tuple[Link, ...]
    outside: Mapping[str, tuple[str, str]]
    """Body and port by ``x`` and ``y``, the axes of the tool, and ``drive`` where the driven dof is neither."""
    equations: MachineEquations
    """Of the machine before it was cut."""
    joints: tuple[tuple[str, Joint], ...]
    """Link and joint in the order of the rows of ``equations.joints``."""
    outside_rows: Array
    """One row over the coordinates of the machine for each entry of ``outside``."""
    untouched: tuple[str, ...]
    """Bodies that nothing acts on, which are left out."""
    highest: float | None
    """Highest frequency of interest in Hz, if the machine states one."""


@dataclass(frozen=True)
class _Refused:
    """What keeps a machine from being cut, of tool and drive and of its connections."""

    where: str
    still: list[str] = field(default_factory=list)
    apart: dict[str, list[str]] = field(default_factory=dict)
    idle: list[str] = field(default_factory=list)

    def check(self) -> None:
        """Raise all of it."""
        said = [f"the {name} of tool or drive is held rigidly, expected it to move" for name in self.still]
        said += [
            f"the {' and '.join(of)} of tool or drive {'move' if len(of) > 1 else 'moves'} {both} against each other, "
            "expected one of them; export it as one FMU (jointlib fmu), or give the motion of one"
            for both, of in self.apart.items()
        ]
        said += [f"rigid connections leave {name!r} nothing that moves" for name in self.idle]
        if said:
            raise InputError(*(f"{self.where}: {each}" for each in said))


def parts_of_machine(machine: Machine) -> Parts:
    """Cut a machine at its flexible connections.

    Every connection has a port of its own on each body it touches, and so have the tool's axes and the drive: a body
    sums the forces itself. A side that rigid connections hold to the ground counts as ground.
    """
    joints = joints_of_machine(machine)
    if not joints:
        raise InputError(f"{machine.where}: no flexible connection, so it is no system; export it as one FMU")
    equations = machine_equations(machine)
    home = _homes(machine, equations)
    taken: set[str] = set()
    names = {
        block: _unique("_".join(name for name, place in home.items() if place == block), taken)
        for block in sorted(set(home.values()))
    }
    ports: dict[int, dict[str, Array]] = {block: {} for block in names}
    turning: dict[int, set[str]] = {block: set() for block in names}
    used = {block: {*AXES, "drive"} for block in names}
    dofs = outside_dofs(machine)
    rows = dict(zip(dofs, machine.dof_rows(list(dofs.values()), "[tool]"), strict=True))
    outside, said = {}, _Refused(machine.where)
    for name, row in rows.items():
        pieces = _pieces(row @ equations.shapes, equations)
        if not pieces:
            said.still.append(name)
        elif len(pieces) > 1:
            said.apart.setdefault(" and ".join(names[i] for i in pieces), []).append(name)
        else:
            ((block, ports[block][name]),) = pieces.items()
            outside[name] = (names[block], name)
            turning[block] |= {name} if turns(dofs[name]) else set()
    links = []
    touched = [_pieces(row, equations) for row in equations.joints]
    said.idle.extend(connection.name for connection, ends in zip(machine.flexible, touched, strict=True) if not ends)
    said.check()
    for connection, joint, pieces in zip(machine.flexible, joints, touched, strict=True):
        first = home.get(connection.between[0].split(".")[0])
        ends: list[tuple[str, str]] = []
        for block in sorted(pieces, key=lambda i: i != first):
            port = _unique(connection.name, used[block])
            ports[block][port] = pieces[block] if not ends else -pieces[block]
            turning[block] |= {port} if connection.rotates else set()
            ends.append((names[block], port))
        links.append(Link(_unique(connection.name, taken), joint, tuple(ends), connection.rotates))
    bodies = [
        Body(
            name,
            _component(name, equations.blocks[block], machine, equations),
            ports[block],
            frozenset(turning[block]),
        )
        for block, name in names.items()
        if ports[block]
    ]
    return Parts(
        _unique(machine.name, set()),
        tuple(sorted(bodies, key=lambda body: body.name)),
        tuple(sorted(links, key=lambda link: link.name)),
        outside,
        equations,
        tuple((link.name, link.joint) for link in links),
        np.array(list(rows.values())) @ equations.shapes,
        tuple(name for block, name in names.items() if not ports[block]),
        machine.frequency[1] if machine.frequency else None,
    )


def joints_of_machine(machine: Machine) -> tuple[Joint, ...]:
    """The joints of the flexible connections. Where bodies depend on the spindle speed, joints are those at the file's:
    an input could not move both."""
    if all(c.known_speeds is None for c in machine.components):
        return machine.joints()

    def at_speed(joint: Joint) -> Joint:
        left = tuple(m for m in joint.modulations if m.condition != SPINDLE_SPEED)
        return joint if left == joint.modulations else replace(joint, modulations=left)

    return tuple(map(at_speed, machine.joints()))


def outside_dofs(machine: Machine) -> dict[str, str]:
    """Degrees of freedom of the tool's axes and, where it is none of them, the drive."""
    dofs = dict(zip(machine.tool_axes, machine.tool_dofs, strict=True))
    driven = machine.driven_dof()
    if driven not in dofs.values():
        dofs["drive"] = driven
    return dofs


def _homes(machine: Machine, equations: MachineEquations) -> dict[str, int]:
    """The block that each component moves with; one that cannot move has none."""
    owner = np.repeat(np.arange(len(machine.components)), [len(c.dofs) for c in machine.components])
    found = {}
    for i, component in enumerate(machine.components):
        reach = np.max(np.abs(equations.shapes[owner == i]), axis=0)
        for block, part in enumerate(equations.blocks):
            if np.any(reach[part] > _NOTHING * np.max(np.abs(equations.shapes))):
                found[component.name] = block
    return found


def _pieces(row: Array, equations: MachineEquations) -> dict[int, Array]:
    """The part of a row on every block that it touches by more than rounding."""
    least = _NOTHING * float(np.max(np.abs(equations.shapes), initial=0.0))
    return {i: row[part] for i, part in enumerate(equations.blocks) if np.max(np.abs(row[part]), initial=0.0) > least}


def _component(name: str, block: slice, machine: Machine, equations: MachineEquations) -> Component:
    """The block as a component whose degrees of freedom are its coordinates."""
    M, C, K = (matrix[block, block] for matrix in (equations.mass, equations.damping, equations.stiffness))
    alone = [c for c in machine.components if c.name == name and len(c.dofs) == len(M)]
    start = [dof.split(".")[0] for dof in machine.dofs].index(name) if alone else 0
    same = alone and np.array_equal(equations.shapes[start : start + len(M), block], np.eye(len(M)))
    dofs = alone[0].dofs if same else tuple(f"coordinate_{i + 1}" for i in range(len(M)))
    return Lumped(name, dofs, M, C, K)


def _unique(name: str, taken: set[str]) -> str:
    """A word of letters, digits and underscores that is not taken yet, which it then is."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    word = plain = plain if plain[:1].isalpha() else f"part_{plain}".strip("_")
    number = 1
    while word in taken:
        number += 1
        word = f"{plain}_{number}"
    taken.add(word)
    return word
