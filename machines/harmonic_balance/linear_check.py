"""The linear check: the same machine built a second way, as a python-control state space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import FRF
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.shown.pictures import axes_of, draw_magnitude, literal, name_curves
from jointlib.shown.result import Columns, Shown

from ..coupling.control_model import by_control
from ..coupling.second_order import MachineEquations, machine_equations
from ..coupling.state_equations import MachineStates, machine_states
from ..indices import Mask
from ..model.limits import amplitude_limit
from ..model.machine import Machine
from ..statics.working_point import at_working_point, placed
from .assembly import Assembly
from .mean_motions import mean_displacement

Equations = MachineEquations | MachineStates
TOLERANCE = 1e-8
_LINES, _FEWEST, _SMALL = 400, 40, 700
"""Lines over a band; each costs the third power of the states, so that beyond ``_SMALL`` of them fewer serve."""
_MANY = 24
_FREE = 1e-9
"""Of a unit motion, squared, that rigid connections leave."""
_WEAK = 1e-2
"""A pair that responds less than this, relative to its two driving points, is measured against this share of them.

A sum of modes holds to 1e-11 of them (`ModeSum`), which leaves a factor of ten below the tolerance."""


@dataclass(frozen=True)
class Excluded:
    """A law that was left out of both machines, and why."""

    connection: str
    law: str
    reason: str

    def __str__(self) -> str:
        return f"{self.connection}: {self.law}: {self.reason}"


@dataclass(frozen=True, eq=False, repr=False)
class LinearCheck(Shown):
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
    remarks: tuple[str, ...] = ()
    """What is to be said of the machine, where `machines.check` made it."""

    @property
    def frequency(self) -> Array:
        """Lines in Hz."""
        return self.coupled.frequency

    def finding(self) -> str:
        """How far the two machines differ, and what was left out of both."""
        at = "at rest" if self.amplitude is None else f"at {self.amplitude * 1e6:g} µm"
        left = f"; excluded: {', '.join(f'{e.law} in {e.connection}' for e in self.excluded)}" if self.excluded else ""
        return (
            f"{'passed' if self.passed else 'FAILED'}, largest relative difference {self.max_relative_difference:.2g} "
            f"from python-control over {self.frequency[0]:.4g} to {self.frequency[-1]:.4g} Hz, joints {at}{left}"
        )

    def columns(self) -> Columns:
        """A row per line: the size of the pair that responds most, by coupling and by control, and their difference."""
        _, o, i = self.coupled.largest
        a, b = self.coupled.receptance[:, o, i], self.control.receptance[:, o, i]
        return {
            "frequency": (self.frequency, "Hz"),
            "coupled": (np.abs(a), "m/N"),
            "control": (np.abs(b), "m/N"),
            "difference": (np.abs(a - b), "m/N"),
        }

    def plot(self, ax: Any = None) -> Any:
        """The pair that responds most, in µm/N over Hz: by receptance coupling, and by python-control over it."""
        axes = axes_of(ax)
        _, o, i = self.coupled.largest
        pair = f"{self.coupled.outputs[o]} per force on {self.coupled.inputs[i]}"
        draw_magnitude(axes, self.frequency, self.coupled.receptance[:, o, i], label="receptance coupling")
        draw_magnitude(axes, self.frequency, self.control.receptance[:, o, i], linestyle="--", label="python-control")
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]", title=literal(pair))
        name_curves(axes)
        return axes


def linear_check(machine: Machine, amplitude: float | None = None, frequency: ArrayLike | None = None) -> LinearCheck:
    """Compare receptance coupling with a python-control state space built by feedback interconnection.

    Every joint becomes a spring and a damper: K = ∂f/∂z and C = ∂f/∂ż at rest, or at a joint amplitude A the
    describing function's K = Re G and C = Im G/ω at the first resonance, about the means that balance a static load
    at that amplitude. The state space starts from the
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
    loaded, machine = machine, at_working_point(machine)
    for connection, joint in zip(machine.flexible, machine.joints(), strict=True):
        limit = amplitude_limit(joint)
        if amplitude is not None and amplitude > limit.amplitude:
            raise InputError(
                f"check: amplitude is {amplitude:g} m, the joint {connection.name} ends at {limit.amplitude:g} m "
                f"({limit.outcome.name.lower()})"
            )
    equations = _equations(machine)
    joints, excluded = _kept(machine, amplitude is None)
    K, C, resonance = _linearised(equations, joints, amplitude)
    if amplitude is not None and loaded.static is not None:
        # The means move with the amplitude.
        place = mean_displacement(loaded, np.full(len(joints), amplitude), resonance or 1.0)[0]
        if not np.all(np.isfinite(place)):
            raise InputError(f"{loaded.where}: check: the means do not balance the static load at {amplitude:g} m")
        machine = placed(loaded, place)
        joints, excluded = _kept(machine, False)
        K, C, resonance = _linearised(equations, joints, amplitude)
    states = machine_states(machine)
    lines = _band(machine, equations, states, K, frequency)
    names = _points(machine)
    coupled = Assembly(machine, names, names).coupled(2 * np.pi * lines, K + 2j * np.pi * lines[:, None] * C)
    second = by_control(machine, states, machine.dof_rows(names, "check"), K, C, 2 * np.pi * lines)
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


def _equations(machine: Machine) -> Equations:
    if any(c.second_order() is None and c.first_order() is not None for c in machine.components):
        return machine_states(machine)
    return machine_equations(machine)


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


def _linearised(equations: Equations, joints: list[Joint], amplitude: float | None) -> tuple[Array, Array, float]:
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


def _first(equations: Equations, K: Array) -> float:
    found = equations.natural_frequencies(K)
    return float(found[found > 0][0]) if np.any(found > 0) else 0.0


def _band(
    machine: Machine, equations: Equations, states: MachineStates, K: Array, frequency: ArrayLike | None
) -> Array:
    given = machine.frequency if frequency is None else frequency
    if given is None:
        found = equations.natural_frequencies(K)
        found = found[found > 0] if np.any(found > 0) else np.array([1.0])
        given = (0.5 * found[0], 1.5 * found[-1])
    values = np.asarray(given, dtype=float)
    if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values <= 0) or np.any(np.diff(values) <= 0):
        raise InputError("check: frequency must be [low, high] or ascending lines in Hz, finite and above 0")
    if len(values) > 2:
        return values
    share = (_SMALL / max(sum(len(block.A) for block in states.blocks), 1)) ** 3
    return np.geomspace(values[0], values[1], int(np.clip(_LINES * share, _FEWEST, _LINES)))


def _points(machine: Machine) -> tuple[str, ...]:
    """Degrees of freedom that are compared: all that can move in a small machine, else drive and tool."""
    if len(machine.dofs) <= _MANY:
        return tuple(np.array(machine.dofs)[~_held(machine)].tolist()) or machine.dofs
    chosen = dict.fromkeys([*machine.tool.values(), *([machine.drive] if machine.drive else [])])
    return tuple(chosen) or machine.dofs[:_MANY]


def _held(machine: Machine) -> Mask:
    """Degrees of freedom that rigid connections hold at zero, where both machines have nothing but rounding."""
    rows = machine.rows([c for c in machine.connections if c.rigid])
    within = scipy.linalg.orth(rows.T)
    return np.asarray(np.sum(within**2, axis=1) > 1 - _FREE)


def _difference(first: ComplexArray, second: ComplexArray) -> float:
    """Largest relative difference in norm over the band."""
    size = np.linalg.norm(second, axis=0)
    own = np.sqrt(np.diag(size))
    scale = np.maximum(size, _WEAK * np.outer(own, own))
    return float(np.max(np.linalg.norm(first - second, axis=0) / np.where(scale > 0, scale, 1.0)))
