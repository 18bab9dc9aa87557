"""The linear check: the same machine built a second way, as a python-control state space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import FRF
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion

from .assembly import Assembly
from .limits import amplitude_limit
from .machine import Machine
from .second_order import MachineEquations, machine_equations
from .working_point import at_working_point

TOLERANCE = 1e-8
_LINES = 400
_MANY = 24
_WEAK = 1e-3
"""A pair that responds less than this, relative to its two driving points, is measured against this share of them."""


@dataclass(frozen=True)
class Excluded:
    """A law that was left out of both machines, and why."""

    connection: str
    law: str
    reason: str

    def __str__(self) -> str:
        return f"{self.connection}: {self.law}: {self.reason}"


@dataclass(frozen=True, eq=False)
class LinearCheck:
    """Receptance coupling against a state space of the same linearised machine."""

    max_relative_difference: float
    """Largest, over outputs and inputs, of the norm over the band of the difference over that of the receptance."""
    passed: bool
    """Below 1e-8."""
    excluded: tuple[Excluded, ...]
    amplitude: float | None
    """Joint amplitude in m of the gains, None for the tangent at rest."""
    stiffness: Array
    """K of every joint in N/m."""
    damping: Array
    """C of every joint in N s/m."""
    resonance: float
    """First natural frequency of the linearised machine in Hz."""
    coupled: FRF
    """By receptance coupling."""
    control: FRF
    """By python-control."""

    @property
    def frequency(self) -> Array:
        """Lines in Hz."""
        return self.coupled.frequency


def linear_check(machine: Machine, amplitude: float | None = None, frequency: ArrayLike | None = None) -> LinearCheck:
    """Compare receptance coupling with a python-control state space built by feedback interconnection.

    Every joint becomes a spring and a damper: K = ∂f/∂z and C = ∂f/∂ż at rest, or at a joint amplitude A the
    describing function's K = Re G and C = Im G/ω at the first resonance. The state space starts from the
    components' matrices, with rigid connections eliminated there, and closes one feedback loop per joint; it shares
    no receptance with the coupling.

    Parameters
    ----------
    amplitude
        Joint amplitude in m; None is the tangent at rest.
    frequency
        [low, high] in Hz or the lines themselves; default: the range of the file, else round all resonances.
    """
    if amplitude is not None and not (np.isfinite(amplitude) and amplitude > 0):
        raise InputError(f"check: amplitude is {amplitude!r} m, expected more than 0, or none for the tangent at rest")
    machine = at_working_point(machine)
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        limit = amplitude_limit(joint)
        if amplitude is not None and amplitude > limit.amplitude:
            raise InputError(
                f"check: amplitude is {amplitude:g} m, the joint {connection.name} ends at {limit.amplitude:g} m "
                f"({limit.outcome.name.lower()})"
            )
    equations = machine_equations(machine)
    joints, excluded = _kept(machine, amplitude is None)
    K, C, resonance = _linearised(equations, joints, amplitude)
    lines = _band(machine, equations, K, frequency)
    names = _points(machine)
    coupled = Assembly(machine, names, names).coupled(2 * np.pi * lines, K + 2j * np.pi * lines[:, None] * C)
    second = _by_control(equations, machine.dof_rows(names, "check"), K, C, 2 * np.pi * lines)
    difference = _difference(coupled, second)
    return LinearCheck(
        difference,
        difference < TOLERANCE,
        excluded,
        amplitude,
        K,
        C,
        resonance,
        FRF(lines, coupled, names, names),
        FRF(lines, second, names, names),
    )


def _kept(machine: Machine, at_rest: bool) -> tuple[list[Joint], tuple[Excluded, ...]]:
    """The joints without the laws that have no spring and damper, and the list of those."""
    kept, out = [], []
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        laws = []
        for name, law in zip(joint.part_names, joint.laws, strict=True):
            reason = _no_state_space(law, at_rest)
            if reason:
                out.append(Excluded(connection.name, name, reason))
            else:
                laws.append(law)
        kept.append(Joint(tuple(laws), joint.name))
    return kept, tuple(out)


def _no_state_space(law: JointLaw, at_rest: bool) -> str:
    if not law.in_time:
        return "it exists in the frequency domain only and has no state space"
    if at_rest:
        gain = law.first_harmonic(0.0, 1.0).gain
        if not np.all(np.isfinite(gain)) or not np.all(np.isfinite(_tangent(law))):
            return "it has no tangent at rest; give a joint amplitude"
    return ""


def _tangent(law: JointLaw) -> tuple[float, float]:
    rest = np.zeros(())
    stiffness, damping = law.jacobian(Motion(rest, rest), law.initial_state(rest))
    return float(stiffness), float(damping)


def _linearised(
    equations: MachineEquations, joints: list[Joint], amplitude: float | None
) -> tuple[Array, Array, float]:
    """Stiffness and damping of every joint, and the first natural frequency in Hz."""
    tangents = np.array([np.sum([_tangent(law) for law in j.laws] or [(0.0, 0.0)], axis=0) for j in joints])
    K, C = tangents.reshape(len(joints), 2).T.copy()
    first = _first(equations, K)
    if amplitude is None:
        return K, C, first
    for _ in range(50):
        omega = 2 * np.pi * (first or 1.0)
        gain = np.array([complex(j.first_harmonic(amplitude, omega).gain) for j in joints])
        K, C, before = gain.real.copy(), gain.imag / omega, first
        first = _first(equations, K)
        if abs(first - before) <= 1e-12 * first:
            break
    return K, C, first


def _first(equations: MachineEquations, K: Array) -> float:
    found = equations.natural_frequencies(K)
    return float(found[found > 0][0]) if np.any(found > 0) else 0.0


def _band(machine: Machine, equations: MachineEquations, K: Array, frequency: ArrayLike | None) -> Array:
    given = machine.frequency if frequency is None else frequency
    if given is None:
        found = equations.natural_frequencies(K)
        found = found[found > 0] if np.any(found > 0) else np.array([1.0])
        given = (0.5 * found[0], 1.5 * found[-1])
    values = np.asarray(given, dtype=float)
    if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values <= 0) or np.any(np.diff(values) <= 0):
        raise InputError("check: frequency must be [low, high] or ascending lines in Hz, finite and above 0")
    return np.geomspace(values[0], values[1], _LINES) if len(values) == 2 else values


def _points(machine: Machine) -> tuple[str, ...]:
    """Degrees of freedom that are compared: all of them in a small machine, else drive and tool."""
    if len(machine.dofs) <= _MANY:
        return machine.dofs
    chosen = dict.fromkeys([*machine.tool.values(), *([machine.drive] if machine.drive else [])])
    return tuple(chosen) or machine.dofs[:_MANY]


def _by_control(equations: MachineEquations, rows: Array, K: Array, C: Array, omega: Array) -> ComplexArray:
    """Receptance between ``rows`` from blocks per group of components, appended and closed by the joints."""
    import control

    outputs = rows @ equations.shapes
    joints = equations.joints
    # Time is counted in units that make the fastest motion of order one: the states stay comparable.
    fastest = 2 * np.pi * float(np.max(equations.natural_frequencies(np.maximum(K, 0.0)), initial=0.0)) or 1.0
    blocks = [_block(control, equations, part, np.concatenate([joints, outputs]), fastest) for part in equations.blocks]
    apart = control.append(*blocks)
    ports, nj = len(joints) + len(outputs), len(joints)
    # Every block has all ports; the same force acts on all blocks and their motions add up.
    copies = len(blocks)
    spread = np.tile(np.eye(ports), (copies, 1))
    gather = np.tile(np.eye(2 * ports), (1, copies))
    plant = control.ss(apart.A, apart.B @ spread, gather @ apart.C, gather @ apart.D @ spread)
    spring = [control.ss([], [], [], [[k, c * fastest]]) for k, c in zip(K, C, strict=True)]
    loops = np.zeros((ports, 2 * ports))
    if nj:
        law = control.append(*spring)
        pick = np.zeros((2 * nj, 2 * ports))
        for j in range(nj):
            pick[2 * j, j] = pick[2 * j + 1, ports + j] = 1.0
        loops[:nj] = np.asarray(law.D) @ pick
    closed = control.feedback(plant, control.ss([], [], [], loops), sign=-1)
    value = np.asarray(closed(1j * omega / fastest, squeeze=False))
    return np.asarray(np.moveaxis(value[nj:ports, nj:, :], 2, 0))


def _block(control: Any, equations: MachineEquations, part: slice, ports: Array, fastest: float) -> Any:
    """Block of one group of components: forces on the ports in, displacements and scaled velocities out.

    With M = L Lᵀ and p = L⁻ᵀ y the states are y and ẏ over the time unit; velocities are in m per time unit.
    """
    L = np.linalg.cholesky(equations.mass[part, part])
    n = len(L)
    inverse = np.linalg.inv(L)
    K = inverse @ equations.stiffness[part, part] @ inverse.T / fastest**2
    C = inverse @ equations.damping[part, part] @ inverse.T / fastest
    S = ports[:, part] @ inverse.T
    zero = np.zeros((n, n))
    A = np.block([[zero, np.eye(n)], [-K, -C]])
    B = np.concatenate([np.zeros((n, len(ports))), S.T / fastest**2])
    out = np.block([[S, np.zeros_like(S)], [np.zeros_like(S), S]])
    return control.ss(A, B, out, np.zeros((2 * len(ports), len(ports))))


def _difference(first: ComplexArray, second: ComplexArray) -> float:
    """Largest relative difference in norm over the band."""
    size = np.linalg.norm(second, axis=0)
    own = np.sqrt(np.diag(size))
    scale = np.maximum(size, _WEAK * np.outer(own, own))
    return float(np.max(np.linalg.norm(first - second, axis=0) / np.where(scale > 0, scale, 1.0)))
