"""The machine at a vibration amplitude of the tool: every joint frozen at the gain it has there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF, ReceptanceKind
from jointlib.shown.result import Columns, Shown

from ..coupling.coupling import joined
from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.prescribed import Prescribed, solve_prescribed
from ..harmonic_balance.view import View
from ..indices import Index, Reasons
from ..model.machine import Machine
from .held_lines import columns_of, said_of
from .one_joint import BARELY_MOVING, OneJoint
from .solutions import caps_of


@dataclass(frozen=True, eq=False, repr=False)
class OperatingPoint(Shown):
    """Receptance at a tool-point amplitude, with what every joint does there; first axis: lines."""

    frf: FRF
    gain: ComplexArray
    """Gain in N/m at which every joint is held, (nf, connections)."""
    joint_amplitude: Array
    """Amplitude of every joint in m, (nf, connections)."""
    force: Array
    """Magnitude of the force in N that makes the amplitude, for the direction as it was given, (nf,)."""
    outcomes: tuple[Outcome, ...]
    """Per line; where it is not CONVERGED the joints are held at the limit that it names."""
    connections: tuple[str, ...] = ()
    """Names of the joints."""

    def finding(self) -> str:
        """The receptance, the force behind it, and the lines on which a joint ended at a limit."""
        low, high = np.min(self.force), np.max(self.force)
        force = f"force {low:.3g} to {high:.3g} N" if high > 0 else "vanishing vibration"
        return f"{self.frf.finding()}; {force}; {said_of(self.outcomes)}"

    def columns(self) -> Columns:
        """A row per line: the force, amplitude and gain of every joint, how it ended."""
        return columns_of(self.frf, self.force, self.joint_amplitude, self.outcomes, self.connections, self.gain)

    def to_xarray(self) -> Any:
        """The frozen receptance over frequency, output and input."""
        return self.frf.to_xarray()

    def plot(self, ax: Any = None) -> Any:
        """The size of the frozen receptance in µm/N over frequency in Hz."""
        return self.frf.plot(ax)


def frozen_receptance(
    machine: Machine,
    frequency: ArrayLike,
    amplitude: float,
    direction: ArrayLike | None = None,
    outputs: Sequence[str] | None = None,
) -> FRF:
    """Tool-point receptance with the joints frozen at a tool-point amplitude; see `operating_point`.

    `operating_point` also tells which lines, if any, ended at the limit of a joint.
    """
    return operating_point(machine, frequency, amplitude, direction, outputs).frf


def operating_point(
    machine: Machine,
    frequency: ArrayLike,
    amplitude: float,
    direction: ArrayLike | None = None,
    outputs: Sequence[str] | None = None,
) -> OperatingPoint:
    """Freeze the joints at the gain G(A, ω) they have while the tool point vibrates, line by line.

    On each line a harmonic force acts on the tool along ``direction``, large enough for the larger of the amplitudes
    in x and y to be ``amplitude``; of several such states the one with the smallest joint motion counts. This is a
    secant: it describes a developed vibration. At amplitude 0 it is the tangent at rest, under the static load if the
    machine has one.

    Parameters
    ----------
    frequency
        Lines in Hz, positive and ascending, shape (nf,).
    amplitude
        m, peak.
    direction
        Complex force components along the tool's axes that are present, in the order x, y: shape (axes,) or
        (nf, axes). Default: the same force on each.
    outputs
        Degrees of freedom of the rows; default: the tool's. The columns are always the tool's.
    """
    return OpenTool(machine, np.atleast_1d(np.asarray(frequency, dtype=float)), outputs).vibrating(amplitude, direction)


@dataclass(frozen=True, eq=False)
class OpenTool:
    """A machine seen from its tool with its nonlinear joints open: what no vibration of the tool changes.

    `operating_point` says what the fields are; ``frequency`` is an array.
    """

    machine: Machine
    frequency: Array
    outputs: Sequence[str] | None = None
    known: Assembly | None = None
    """What does not depend on the lines, where it is known."""

    def __post_init__(self) -> None:
        lines = self.frequency
        if not (lines.ndim == 1 and len(lines) and np.all(np.isfinite(lines)) and np.all(lines > 0)):
            raise InputError("frozen receptance: lines must be finite and above 0 Hz")
        if not self.tool:
            raise InputError(f"{self.machine.where}: no tool point, expected [tool] with x or y")

    @property
    def tool(self) -> tuple[str, ...]:
        """Degrees of freedom of the tool in the directions in which it moves."""
        return self.machine.tool_dofs

    @property
    def rows(self) -> tuple[str, ...]:
        """Degrees of freedom of the receptance that is asked for."""
        return self.tool if self.outputs is None else tuple(self.outputs)

    def on(self, lines: Array) -> OpenTool:
        """The same on other lines (Hz)."""
        return OpenTool(self.machine, lines, self.outputs, self.assembly)

    @cached_property
    def assembly(self) -> Assembly:
        """Between its tool and the outputs, whose first are the tool."""
        return self.known or Assembly(self.machine, tuple(dict.fromkeys([*self.tool, *self.rows])), self.tool)

    @cached_property
    def _view(self) -> View:
        return self.assembly.at(2 * np.pi * self.frequency)

    @cached_property
    def _one(self) -> OneJoint:
        assembly = self.assembly
        return OneJoint(assembly.joints[assembly.nonlinear[0]], assembly.limits[0], self._view.omega)

    def vibrating(
        self, amplitude: float, direction: ArrayLike | None = None, chosen: Index | None = None, ramp: bool = True
    ) -> OperatingPoint:
        """The `operating_point` on all lines, or on those ``chosen`` by index, which ``direction`` is then of.

        Where several joints do not settle at once, a ``ramp`` of amplitudes leads there; without it they are STALLED.
        """
        lines = self.frequency if chosen is None else self.frequency[chosen]
        joints, moving, omega = self.assembly.joints, list(self.assembly.nonlinear), 2 * np.pi * lines
        state = self.held(amplitude, direction, chosen, ramp)
        if amplitude == 0:
            kind = ReceptanceKind.TANGENT if moving else ReceptanceKind.LINEAR
            none = np.zeros((len(lines), len(joints)))
            frf = self._frf(lines, self.assembly.coupled(omega, state.gain), kind)
            return OperatingPoint(frf, state.gain, none, state.force, state.outcomes, self._names)
        whole = self._view if chosen is None else self._view.at(chosen)
        view, gain = whole.directed(_direction(direction, len(lines), len(self.tool))), state.gain[:, moving]
        joint_amplitude = np.abs(_motions(view, gain, state.force))[:, : len(joints)]
        H = _coupled(whole, gain, len(joints)) if moving else self.assembly.coupled(omega, state.gain)
        kind = ReceptanceKind.FROZEN if moving else ReceptanceKind.LINEAR
        frf = self._frf(lines, H, kind)
        return OperatingPoint(frf, state.gain, joint_amplitude, state.force, state.outcomes, self._names)

    def held(
        self, amplitude: float, direction: ArrayLike | None = None, chosen: Index | None = None, ramp: bool = True
    ) -> Gains:
        """What `vibrating` says of the joints alone, on lines in any order."""
        if not (np.isfinite(amplitude) and amplitude >= 0):
            raise InputError(f"frozen receptance: amplitude is {amplitude!r} m, expected at least 0")
        lines = self.frequency if chosen is None else self.frequency[chosen]
        axes = len(self.tool)
        towards = _direction(direction, len(lines), axes)
        joints, moving = self.assembly.joints, list(self.assembly.nonlinear)
        gains = np.empty((len(lines), len(joints)), dtype=complex)
        for j, joint in enumerate(joints):
            if amplitude == 0 or j not in moving:
                gains[:, j] = joint.first_harmonic(0.0, 2 * np.pi * lines).gain
        if amplitude == 0:
            return Gains(gains, np.zeros(len(lines)), (Outcome.CONVERGED,) * len(lines))
        view = (self._view if chosen is None else self._view.at(chosen)).directed(towards)
        if not np.all(np.any(view.Hof[:, len(joints) : len(joints) + axes, 0], axis=1)):
            raise InputError(
                f"{self.machine.where}: a force on the tool {', '.join(self.tool)} moves nothing there, expected "
                "shapes or connections that let it"
            )
        if len(moving) == 1:
            state = self._with_one(view, amplitude, np.arange(len(lines)) if chosen is None else chosen)
        else:
            state = _joints(self.assembly, view, axes, amplitude, ramp)
        gains[:, moving] = state.gain
        return replace(state, gain=gains)

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(c.name for c in self.machine.flexible)

    def _frf(self, lines: Array, H: ComplexArray, kind: ReceptanceKind) -> FRF:
        H = H[:, [self.assembly.outputs.index(name) for name in self.rows], :]
        return FRF(lines, H, self.rows, self.tool, kind)

    def _with_one(self, view: View, amplitude: float, lines: Index) -> Gains:
        """One joint: force and receptances follow from its amplitude."""
        first, axes = len(self.assembly.joints), len(self.tool)
        h, driven = view.Hzz[:, 0, 0], view.Hzf[:, 0, 0]
        direct, through = view.Hof[:, first : first + axes, 0], view.Hoz[:, first : first + axes, 0]
        size, G, outcomes = self._one.vibrating(h, driven, direct, through, amplitude, lines)
        # A joint that sticks while the tool moves elsewhere is held as one that hardly moves.
        still = (size == 0) | (driven == 0)
        F = size * np.abs(1 + h * G) / np.where(still, 1.0, np.abs(driven))
        if np.any(still):
            every = _motions(view, G[:, None], np.ones(len(lines)))
            F = np.where(still, amplitude / np.max(np.abs(every[:, first : first + axes]), axis=1), F)
        return Gains(G[:, None], F, outcomes)


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains of joints in N/m (nf, joints), force magnitudes in N (nf,) and outcomes."""

    gain: ComplexArray
    force: Array
    outcomes: tuple[Outcome, ...]


def _direction(direction: ArrayLike | None, lines: int, axes: int) -> ComplexArray:
    given = np.ones(axes) if direction is None else np.asarray(direction, dtype=complex)
    if given.shape not in ((axes,), (lines, axes)) or not np.all(np.isfinite(given)):
        raise InputError(
            f"frozen receptance: direction has shape {given.shape}, expected finite values of shape ({axes},) "
            f"or ({lines}, {axes})"
        )
    full = np.array(np.broadcast_to(given, (lines, axes)), dtype=complex)
    if np.any(np.all(full == 0, axis=1)):
        raise InputError("frozen receptance: direction is zero, expected a force along x or y")
    return full


def _coupled(view: View, gain: ComplexArray, joints: int) -> ComplexArray:
    """Receptance of what is shown, (nf, outputs, inputs), with the nonlinear joints at these gains."""
    shown = slice(joints, None)
    if view.coordinates.complete:
        return joined(view.Hzz, view.Hzf, view.Hoz[:, shown], view.Hof[:, shown], gain)
    return view.coupled(gain, joints)


def _motions(view: View, gain: ComplexArray, force: Array) -> ComplexArray:
    """All motions in m at frozen gains, (nf, motions)."""
    if gain.shape[1] == 0:
        return view.Hof[:, :, 0] * force[:, None]
    c = view.coordinates
    system: ComplexArray = np.eye(len(c.rows)) + c.through(view.Hzz, gain)
    q = np.asarray(np.linalg.solve(system, view.Hzf[:, :, :1])[:, :, 0], dtype=complex)
    pull = c.together(gain * c.motions(q))
    moved: ComplexArray = view.Hof[:, :, 0] - (view.Hoz @ pull[:, :, None])[:, :, 0]
    return moved * force[:, None]


def _joints(assembly: Assembly, view: View, axes: int, amplitude: float, ramp: bool) -> Gains:
    """Several joints, or none."""
    joints = assembly.moving
    first, lines = len(assembly.joints), len(view.omega)
    direct, through = view.Hof[:, first : first + axes, 0], view.Hoz[:, first : first + axes]
    if not joints:
        none = np.zeros((lines, 0), dtype=complex)
        return Gains(none, amplitude / np.max(np.abs(direct), axis=1), (Outcome.CONVERGED,) * lines)
    found = solve_prescribed(view, joints, caps_of(assembly), direct, through, amplitude, ramp)
    outcomes = found.outcomes(assembly.limits)
    return Gains(_held(assembly, found, outcomes, view.omega), found.force, tuple(outcomes))


def _held(assembly: Assembly, found: Prescribed, outcomes: Reasons, omega: Array) -> ComplexArray:
    """Gains where a joint would leave its range, or nothing settled: of the amplitude found, but no further than
    the limit."""
    out = found.gain.copy()
    past = np.flatnonzero(outcomes != Outcome.CONVERGED)
    for j, limit in enumerate(assembly.limits):
        if len(past):
            joint = assembly.joints[assembly.nonlinear[j]]
            A = np.abs(found.z[past, j])
            ends = np.minimum(np.where(np.isfinite(A), A, limit.amplitude), limit.amplitude)
            out[past, j] = joint.first_harmonic(np.where(np.isfinite(ends), ends, BARELY_MOVING), omega[past]).gain
    return out
