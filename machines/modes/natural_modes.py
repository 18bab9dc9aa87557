"""Natural modes of a machine: how its coupled parts vibrate when left alone, and which motions nothing holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.shown.pictures import axes_of
from jointlib.shown.result import Columns, Shown

from ..coupling.second_order import MachineEquations, machine_equations
from ..indices import Mask
from ..model.machine import Machine
from ..statics.working_point import tangents
from .free_vibration import Eigenproblem, InMotions, InStates, Vibrations

_PROBE = np.array([1.0, 1e3, 1e5])
"""Hz; a joint is one spring and damper if it is the same one at all of these."""
_SPRING = 1e-12
_UNDAMPED = 1e-9
FELT = 1e-3
"""Least compliance at resonance of a mode that the tool feels, as a share of that of the most compliant one."""
_ROUNDS = 60
_SETTLED, _VIBRATING = 1e-11, 1e-9
"""Relative change of a pole at which it counts as found, at rest and at an amplitude."""
_SLOWED = 12
"""Rounds after which every change is halved."""


@dataclass(frozen=True, eq=False, repr=False)
class NaturalModes(Shown):
    """Free vibrations x = Re(φ e^(st)) of a coupled machine, a pair of poles s each, ascending in frequency.

    Near a pole the receptance is φ φᵀ/(2s (jω − s)): without damping φ is real and of unit modal mass. Motions that
    nothing holds are no modes, see ``free``, nor are those that creep back without swinging, see ``decay``.
    """

    machine: Machine
    amplitude: float
    """Tool-point amplitude in m that the joints are held at; 0: their tangents at rest."""
    pole: ComplexArray
    """s in rad/s, Im s > 0, (modes,)."""
    shapes: ComplexArray
    """φ over `Machine.dofs`, in m or rad times 1/√kg, (dofs, modes)."""
    stretch: ComplexArray
    """Displacement of every joint in φ, in the order of `Machine.flexible`, (joints, modes)."""
    slope: ComplexArray
    """ds/dk of a spring k (N/m) beside every joint, (joints, modes); beside a damper it is s times that."""
    gain: ComplexArray
    """Gain of every joint in N/m at the frequency f of the mode: K = Re G, C = Im G/(2π f), (modes, joints)."""
    decay: Array
    """Real poles in 1/s: overdamped motions, and free ones that something brakes."""
    free: Array
    """Motions that nothing holds, over `Machine.dofs`, (dofs, count)."""
    limited: Mask
    """Modes at whose frequency a joint cannot follow the amplitude and is held at its limit, (modes,)."""
    coordinates: ComplexArray | None
    """φ in the coordinates of ``equations``, (n, modes)."""
    equations: MachineEquations | None
    """None where a component has state equations only."""

    @property
    def frequency(self) -> Array:
        """Natural frequencies |s|/2π in Hz, (modes,)."""
        return np.asarray(np.abs(self.pole) / (2 * np.pi))

    @property
    def damping_ratio(self) -> Array:
        """ζ = −Re s/|s|, (modes,); below 0 a mode grows by itself."""
        return np.asarray((0.0 - self.pole.real) / np.abs(self.pole))

    @property
    def stiffness(self) -> Array:
        """K of every joint in N/m, (modes, joints)."""
        return self.gain.real

    @property
    def damping(self) -> Array:
        """C of every joint in N s/m, (modes, joints)."""
        return np.asarray(self.gain.imag / np.abs(self.pole)[:, None])

    @property
    def tool(self) -> ComplexArray:
        """Motion of the tool along its axes in φ, (axes, modes)."""
        return np.asarray(self.machine.dof_rows(self.machine.tool_dofs, "[tool]") @ self.shapes)

    @property
    def tool_peak(self) -> Array:
        """Compliance in m/N that each mode alone has at the tool at resonance, (modes,)."""
        return _peak(self.pole, self.tool)

    @property
    def felt(self) -> Mask:
        """Modes that the tool feels: with at least a thousandth of the largest such compliance."""
        peak = self.tool_peak
        return np.asarray(peak > FELT * np.max(peak, initial=0.0))

    def finding(self) -> str:
        """How many modes there are, which one the tool feels most, and whether one grows by itself."""
        held = f"joints held at {self.amplitude * 1e6:g} µm at the tool" if self.amplitude else "joints at rest"
        if not len(self.pole):
            return f"nothing swings, {held}"
        count, f = len(self.pole), self.frequency
        said = f"{count} modes from {f[0]:.4g} to {f[-1]:.4g} Hz" if count > 1 else f"one mode at {f[0]:.4g} Hz"
        said += f", {held}"
        if self.machine.tool and np.any(self.tool_peak > 0):
            i = int(np.argmax(self.tool_peak))
            said += (
                f"; the tool feels most that at {f[i]:.4g} Hz "
                f"(damping {100 * self.damping_ratio[i]:.3g} %, {self.tool_peak[i] * 1e6:.3g} µm/N)"
            )
        growing = np.flatnonzero(self.damping_ratio < -_UNDAMPED)
        return f"{said}\nthe mode at {f[growing[0]]:.4g} Hz grows by itself" if len(growing) else said

    def columns(self) -> Columns:
        """A row per mode; ``tool_peak`` is the compliance that it alone has at the tool at resonance."""
        found: dict[str, Any] = {"frequency": (self.frequency, "Hz"), "damping_ratio": (self.damping_ratio, "")}
        if self.machine.tool:
            found |= {"tool_peak": (self.tool_peak, "m/N"), "felt": (self.felt, "")}
        return found | {"limited": (self.limited, "")}

    def plot(self, ax: Any = None) -> Any:
        """Compliance in µm/N, over frequency in Hz, of the modes that the tool feels; without a tool damping in %."""
        axes = axes_of(ax)
        if self.machine.tool:
            axes.semilogy(self.frequency[self.felt], self.tool_peak[self.felt] * 1e6, "o")
            axes.set(xlabel="frequency [Hz]", ylabel="compliance at resonance [µm/N]")
        else:
            axes.plot(self.frequency, 100 * self.damping_ratio, "o")
            axes.set(xlabel="frequency [Hz]", ylabel="damping ratio [%]")
        return axes


def natural_modes(machine: Machine, amplitude: float = 0.0) -> NaturalModes:
    """Modes of the whole machine with its joints as springs and dampers.

    A joint counts with its gain G at the frequency of the mode, K = Re G and C = Im G/ω: at ``amplitude`` 0 with its
    tangent at rest, about where it stands under a static load; else with the gain that it has while the tool point
    vibrates with that amplitude (m, the larger of x and y) at that frequency, see `operating_point`. Where gains depend
    on frequency or amplitude, every mode has its own; modes that the tool does not feel keep the tangents.

    Raises
    ------
    InputError
        Where a component is known by its receptance only, a joint is rigid, or the machine does not stand by itself.
    """
    if not (np.isfinite(amplitude) and amplitude >= 0):
        raise InputError(f"modes: amplitude is {amplitude!r} m, expected at least 0")
    if machine.without_equations:
        raise InputError(
            f"{machine.where}: component {machine.without_equations[0]!r} is known by its receptance only, so the "
            "modes of the machine are not known; expected components with equations of motion, a modal one for example"
        )
    if amplitude > 0 and not machine.tool_axes:
        raise InputError(f"{machine.where}: no tool point, expected [tool] with x or y for an amplitude")
    equations, system, probed, found = _at_rest(machine)
    K, C = _springs(probed)
    pole, vectors = found.pole, found.vector
    gain, limited = K + 1j * np.abs(pole)[:, None] * C, np.zeros(len(pole), dtype=bool)
    if len(pole) and (amplitude > 0 or not _steady(probed)):
        pole, vectors, gain, limited = _each_its_own(machine, system, found, gain, amplitude)
        order = np.argsort(np.abs(pole), kind="stable")
        pole, vectors, gain, limited = pole[order], vectors[:, order], gain[order], limited[order]
    shown = system.shapes(*_held(gain, pole), pole, vectors)
    return NaturalModes(
        machine,
        float(amplitude),
        pole,
        shown.dofs,
        shown.joints,
        shown.slope,
        gain,
        found.decay,
        found.free,
        limited,
        None if equations is None else shown.vector,
        equations,
    )


@lru_cache(maxsize=2)  # what looks for mistakes asks for it, and what shows the modes after that
def _at_rest(machine: Machine) -> tuple[MachineEquations | None, Eigenproblem, ComplexArray, Vibrations]:
    """The equations, tangents of the joints at the frequencies of `_PROBE`, and the vibrations with that in between."""
    in_motions = all((part := c.second_order()) is not None and part.reciprocal for c in machine.components)
    equations = machine_equations(machine) if in_motions else None
    system: Eigenproblem = InStates(machine) if equations is None else InMotions(machine.where, equations)
    probed = _tangents(machine, _PROBE)
    return equations, system, probed, system.solve(*_springs(probed))


def _springs(probed: ComplexArray) -> tuple[Array, Array]:
    """Stiffness and damping of the joints by their gains at `_PROBE`, (joints,)."""
    return probed.real[1], np.asarray(probed.imag[1] / (2 * np.pi * _PROBE[1]))


def _held(gain: ComplexArray, pole: ComplexArray) -> tuple[Array, Array]:
    """Stiffness and damping of the joints at the frequency of each pole, (modes, joints)."""
    return gain.real, np.asarray(gain.imag / np.abs(pole)[:, None])


def _peak(pole: ComplexArray, tool: ComplexArray) -> Array:
    """Compliance at the tool in m/N, at its resonance, that every mode has of its own, (modes,)."""
    size = np.abs(pole)
    return np.asarray(np.sum(np.abs(tool) ** 2, axis=0) / (2 * size * np.maximum(np.abs(pole.real), _UNDAMPED * size)))


def _tangents(machine: Machine, frequency: Array) -> ComplexArray:
    """Gains of the joints at rest, (nf, joints); one that is rigid there is refused by name."""
    gain = tangents(machine, frequency)
    stuck = ~np.all(np.isfinite(gain), axis=0)
    if np.any(stuck):
        name = machine.flexible[int(np.argmax(stuck))].name
        raise InputError(
            f"{machine.where}: connection {name!r} sticks at rest without giving way, so it has no stiffness there; "
            "give its friction a smoothing_velocity, or a law that bends before it slips (jenkins)"
        )
    return gain


def _steady(probed: ComplexArray) -> bool:
    """Whether every joint is one spring and one damper at all frequencies."""
    C = probed.imag / (2 * np.pi * _PROBE)[:, None]
    return bool(
        np.all(np.abs(probed.real - probed.real[0]) <= _SPRING * np.max(np.abs(probed.real), axis=0, initial=0.0))
        and np.all(np.abs(C - C[0]) <= _SPRING * np.max(np.abs(C), axis=0, initial=0.0))
    )


def _each_its_own(
    machine: Machine, system: Eigenproblem, found: Vibrations, gain: ComplexArray, amplitude: float
) -> tuple[ComplexArray, ComplexArray, ComplexArray, Mask]:
    """Poles, vectors and gains, (modes, joints), of modes that agree with each other, and where a joint ended."""
    pole, vector, gain = found.pole.copy(), found.vector.copy(), gain.copy()
    limited, moving = np.zeros(len(pole), dtype=bool), np.arange(len(pole))
    if amplitude > 0:
        rows = machine.dof_rows(machine.tool_dofs, "[tool]")
        peak = _peak(pole, rows @ system.shapes(*_held(gain, pole), pole, vector).dofs)
        moving = np.flatnonzero(peak > FELT * np.max(peak))
    for count in range(_ROUNDS):
        if amplitude > 0:
            new, limited[moving] = _vibrating(machine, system, pole[moving], vector[:, moving], gain[moving], amplitude)
        else:
            new = _tangents(machine, np.abs(pole[moving]) / (2 * np.pi))
        gain[moving] = new if count < _SLOWED else (new + gain[moving]) / 2
        before = pole[moving]
        for i in moving:
            pole[i], vector[:, i] = system.near(gain[i].real, gain[i].imag / abs(pole[i]), pole[i], vector[:, i])
        moving = moving[np.abs(pole[moving] - before) > (_VIBRATING if amplitude > 0 else _SETTLED) * np.abs(before)]
        if not len(moving):
            break
    limited[moving] = True
    return pole, vector, gain, limited


def _vibrating(
    machine: Machine,
    system: Eigenproblem,
    pole: ComplexArray,
    vector: ComplexArray,
    gain: ComplexArray,
    amplitude: float,
) -> tuple[ComplexArray, Mask]:
    """Gains of the joints while the tool vibrates at the frequencies of modes, pushed the way it moves in them."""
    from ..operating.operating_point import OpenTool

    rows = machine.dof_rows(machine.tool_dofs, "[tool]")
    tool = (rows @ system.shapes(*_held(gain, pole), pole, vector).dofs).T
    largest = np.max(np.abs(tool), axis=1, keepdims=True)
    direction = np.where(largest > 0, tool.conj() / np.where(largest > 0, largest, 1.0), 1.0)
    order = np.argsort(np.abs(pole), kind="stable")
    # Modes at one frequency may move the tool in different directions.
    lines = np.abs(pole)[order] / (2 * np.pi) * (1 + 1e-13 * np.arange(len(pole)))
    point = OpenTool(machine, lines).vibrating(amplitude, direction[order])
    out, ended = np.empty_like(point.gain), np.empty(len(pole), dtype=bool)
    out[order] = point.gain
    ended[order] = [outcome is not Outcome.CONVERGED for outcome in point.outcomes]
    return out, ended
