"""A machine, or one component of it, as the system that its FMU computes: modes with joints between them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.parameter import Role, parameters_of
from machines.components.component import Component
from machines.components.connection import GROUND
from machines.components.static_load import turns
from machines.coupling.second_order import MachineEquations, machine_equations
from machines.model.machine import Machine
from machines.statics.statics import StaticPoint, static_point

from ..system.si_unit import turned
from ..system.step_limit import operating_range
from ..system.system import Signal, System, fmi_name, moved, prefixed, with_conditions
from ..system.variables import parts_of
from .machine_parts import joints_of_machine, outside_dofs
from .native import only_in_steps

__all__ = ["Machine", "system_of_component", "system_of_machine"]

_FREE = 1e-12
"""A squared natural frequency below this share of the block's highest is a free motion."""
_NOISE = 1e-14
"""Entries below this share of the largest are rounding and no coupling."""
_TRAVEL = 20e-6
"""Usual motion in m where no joint tells."""
_UNITS = {"displacement": "m", "velocity": "m/s", "force": "N"}
_PER_PERIOD = 20
"""Communication steps in the shortest period of interest."""


def system_of_machine(machine: Machine) -> System:
    """The machine from forces at the tool (and the drive where that is elsewhere) to motions there and in the joints.

    Rigid connections are eliminated; the structure with its joints open is written in modes of 1 kg modal mass. Under
    a static load it begins at its working point; displacements count from the machine without load.
    """
    equations = machine_equations(machine)
    found = joints_of_machine(machine)
    joints = tuple((fmi_name(c.name), j) for c, j in zip(machine.flexible, found, strict=True))
    for connection, joint in zip(machine.flexible, found, strict=True):
        _check(f"{machine.where}: connection {connection.name!r}", joint)
    ports = outside_dofs(machine)
    rows = machine.dof_rows(list(ports.values()), "fmu") @ equations.shapes
    force = min(machine.force, default=0.0)
    top = machine.frequency[1] if machine.frequency is not None else 0.0
    title = f"Machine {machine.name}: {', '.join(c.name for c in machine.components)}"
    if joints:
        title += f"; joints {', '.join(c.name for c in machine.flexible)}"
    told = {port: f"at {dof}" for port, dof in ports.items()}
    turning = {port for port, dof in ports.items() if turns(dof)}
    sides = [_Sides(*connection.between, connection.rotates) for connection in machine.flexible]
    point = None if machine.static is None else static_point(machine)
    made = _system(machine.name, title, equations, joints, sides, told, turning, rows, force, top, point)
    return with_conditions(replace(made, author=machine.author), machine.where)


def system_of_component(component: Component, ports: Mapping[str, Array], turning: Collection[str] = ()) -> System:
    """A component alone: a force along each port in, displacement and velocity along it out.

    A port is a row over the component's degrees of freedom; the force acts and the motion is read along it. Of ports
    that are ``turning`` it is a moment and an angle.
    """
    if not ports:
        raise InputError(f"component {component.name!r}: no ports, expected at least one")
    equations = machine_equations(Machine((component,), name=component.name))
    rows = np.array([np.asarray(row, dtype=float) for row in ports.values()])
    if rows.shape != (len(ports), len(component.dofs)):
        raise InputError(
            f"component {component.name!r}: ports of shape {rows.shape[1:]}, expected one number per degree of freedom "
            f"({len(component.dofs)})"
        )
    told = {port: f"along the port {port}" for port in ports}
    title = f"Component {component.name} ({component.kind})"
    return _system(component.name, title, equations, (), (), told, turning, rows @ equations.shapes, 0.0, 0.0)


@dataclass(frozen=True)
class _Sides:
    """What a joint is between, and whether it turns."""

    first: str
    second: str
    turns: bool


def _check(where: str, joint: Joint) -> None:
    """Refuse what cannot be integrated: laws that exist in steps only, friction that jumps at rest."""
    parts_of(joint)
    if steps := only_in_steps((joint,)):
        raise InputError(f"{where}: {', '.join(steps)} exists in steps only and cannot be integrated in a machine FMU")
    for name, law in zip(joint.part_names, joint.laws, strict=True):
        for p in parameters_of(law):
            if p.role is Role.SMOOTHING and not law.states and getattr(law, p.name) == 0.0:
                raise InputError(
                    f"{where}: {name}.{p.name} is 0, so the force jumps and cannot hold a body at rest; expected a "
                    "value above 0, or a jenkins element instead"
                )


def _system(
    name: str,
    title: str,
    equations: MachineEquations,
    joints: tuple[tuple[str, Joint], ...],
    sides: Sequence[_Sides],
    ports: Mapping[str, str],
    turning: Collection[str],
    rows: Array,
    force: float,
    top: float,
    point: StaticPoint | None = None,
) -> System:
    """``rows`` are the ports over the generalised coordinates; ``force`` (N) and ``top`` (Hz) are 0 where not known.

    ``sides`` belong to the joints in their order; ``turning`` are the ports that turn.
    """
    T, squared, damping = _modes(equations)
    P, J = _clean(rows @ T), _clean(equations.joints @ T)
    n, nu, nj = len(squared), len(rows), len(joints)
    stiffness = np.array([_stiffness(joint) for _, joint in joints])
    if point is not None:
        stiffness = np.maximum(point.stiffness, 0.0)
    natural = 2 * np.pi * equations.natural_frequencies(stiffness)
    natural = natural[natural > 0]
    travel = min((operating_range(joint).amplitude for _, joint in joints), default=_TRAVEL)
    low, high = (float(natural[0]), float(natural[-1])) if len(natural) else (0.0, 0.0)
    A, B, G = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, nu)), np.zeros((2 * n, nj))
    A[0::2, 1::2], A[1::2, 0::2], A[1::2, 1::2] = np.eye(n), -np.diag(squared), -damping
    B[1::2], G[1::2] = P.T, -J.T
    C, E = (np.zeros((2 * len(R), 2 * n)) for R in (J, P))
    for rate, part in ((0, slice(0, None, 2)), (1, slice(1, None, 2))):
        C[part, rate::2], E[part, rate::2] = J, P
    # Behind the ports' motions each joint tells its motion and its force.
    told = np.zeros((3 * nj, 2 * n))
    told[0::3], told[1::3] = C[0::2], C[1::2]
    H = np.zeros((2 * nu + 3 * nj, nj))
    H[2 * nu + 2 :: 3] = np.eye(nj)
    E = np.concatenate([E, told])
    load, rest = (None, None) if point is None else _balanced(point, equations, T, A, G, C, E, H)
    size = force or 0.1 * travel / _compliance(equations, rows, stiffness, low)
    pulls = [float(k) * travel or size for k in stiffness]
    names = [prefix for prefix, _ in joints]
    return System(
        name,
        title,
        tuple(_port("force", p, what, p in turning, size) for p, what in ports.items()),
        _outputs(ports, turning, names, sides, {"m": travel, "m/s": travel * (low or 2 * np.pi)}, pulls),
        joints,
        C=C,
        D=np.zeros((2 * nj, nu)),
        E=E,
        F=np.zeros((2 * nu + 3 * nj, nu)),
        H=H,
        A=A,
        B=B,
        G=G,
        states=_states(np.concatenate([P, J]), travel, low),
        band=(low / (2 * np.pi), high / (2 * np.pi)),
        step=1 / (_PER_PERIOD * (top or high / (2 * np.pi))) if top or high else None,
        load=load,
        rest=rest,
        turning=frozenset(name for name, of in zip(names, sides, strict=True) if of.turns),
    )


def _balanced(
    point: StaticPoint, equations: MachineEquations, T: Array, A: Array, G: Array, C: Array, E: Array, H: Array
) -> tuple[Array, Array]:
    """Constants of the static load, and x at its working point.

    The constant accelerations are those that keep x there to the last digit: weight and forces as far as the machine
    can hold them. Offsets go into the joints' displacements, and where these are told, into the outputs.
    """
    rest = np.zeros(len(A))
    rest[0::2] = T.T @ equations.mass @ point.coordinates
    offset = np.zeros(len(C))
    offset[0::2] = point.balance.offset
    z = (C @ rest + offset)[0::2]
    force = np.array([float(mean.static(np.array(x))[0]) for mean, x in zip(point.balance.means, z, strict=True)])
    pushed = np.where(np.arange(len(A)) % 2, -(A @ rest + G @ force), 0.0)
    shown = np.zeros(len(E))
    ports = len(E) - 3 * len(z)
    shown[ports::3] = offset[0::2]
    return np.concatenate([pushed, offset, shown]), rest


def _outputs(
    ports: Mapping[str, str],
    turning: Collection[str],
    names: Sequence[str],
    sides: Sequence[_Sides],
    sizes: Mapping[str, float],
    pulls: Sequence[float],
) -> tuple[Signal, ...]:
    """Motion of each port, then motion and force of each joint, all with their usual sizes."""
    motion = ("displacement", "velocity")
    out = [_port(q, p, what, p in turning, sizes[_UNITS[q]]) for p, what in ports.items() for q in motion]
    for name, of, pull in zip(names, sides, pulls, strict=True):
        for q in motion:
            told = f"{moved(q, of.turns)} of {of.first} against {of.second}"
            out.append(Signal(prefixed(name, q), _unit(q, of.turns), told, sizes[_UNITS[q]]))
        told = f"restoring {moved('force', of.turns)} of the joint: minus this on {of.first}"
        told += f", plus on {of.second}" if of.second != GROUND else ""
        out.append(Signal(prefixed(name, "force"), _unit("force", of.turns), told, pull))
    return tuple(out)


def _modes(equations: MachineEquations) -> tuple[Array, Array, Array]:
    """p = T q with modes of 1 kg, group by group; ω² of each, and the damping in modes (1/s)."""
    n = len(equations.mass)
    T, squared = np.zeros((n, n)), np.zeros(n)
    for block in equations.blocks:
        values, vectors = scipy.linalg.eigh(equations.stiffness[block, block], equations.mass[block, block])
        largest = np.argmax(np.abs(vectors), axis=0)
        T[block, block] = vectors * np.sign(vectors[largest, np.arange(len(values))])
        squared[block] = np.where(values < _FREE * np.max(np.abs(values), initial=0.0), 0.0, values)
    return T, squared, _clean(T.T @ equations.damping @ T)


def _clean(matrix: Array) -> Array:
    """Rounding taken for what it is, so that what does not act on each other stays apart."""
    return np.where(np.abs(matrix) < _NOISE * np.max(np.abs(matrix), initial=0.0), 0.0, matrix)


def _stiffness(joint: Joint) -> float:
    """Tangent stiffness at rest in N/m."""
    rest = np.zeros(())
    return max(float(joint.jacobian(Motion(rest, rest), joint.initial_state(rest))[0]), 0.0)


def _compliance(equations: MachineEquations, rows: Array, stiffness: Array, low: float) -> float:
    """Displacement in m that 1 N makes at the ports: of each mode what it yields statically, a free one at ``low``."""
    K = equations.stiffness + equations.joints.T @ (stiffness[:, None] * equations.joints)
    values, vectors = scipy.linalg.eigh(K, equations.mass)
    floor = max(low**2, 1.0)
    return float(np.max(((rows @ vectors) ** 2 / np.maximum(values, floor)).sum(axis=1)))


def _states(motions: Array, travel: float, low: float) -> tuple[Signal, ...]:
    """Displacement and velocity of each mode; the usual size is the one that moves a port or joint by ``travel``."""
    seen = np.max(np.abs(motions), axis=0)
    size = travel / np.maximum(seen, 1e-3 * np.max(seen))
    return tuple(
        Signal(f"mode[{i}].{quantity}", unit, f"{quantity} of a mode of the structure, of 1 kg modal mass", x * factor)
        for i, x in enumerate(size)
        for quantity, unit, factor in (("displacement", "m", 1.0), ("velocity", "m/s", low or 2 * np.pi))
    )


def _port(quantity: str, port: str, where: str, turns: bool, size: float) -> Signal:
    name = fmi_name(f"{quantity}_{port}")
    return Signal(name, _unit(quantity, turns), f"{moved(quantity, turns)} {where}", size)


def _unit(quantity: str, turns: bool) -> str:
    return turned(_UNITS[quantity]) if turns else _UNITS[quantity]
