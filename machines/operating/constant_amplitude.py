"""Forced response at constant amplitude: the force that keeps one motion at its size from line to line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF, ReceptanceKind
from jointlib.shown.pictures import axes_of, literal, name_curves
from jointlib.shown.result import Columns, Shown

from ..harmonic_balance.assembly import Assembly
from ..harmonic_balance.prescribed import Prescribed, solve_prescribed
from ..harmonic_balance.view import View
from ..model.machine import Machine
from .held_lines import columns_of, said_of
from .solutions import caps_of


@dataclass(frozen=True, eq=False, repr=False)
class ConstantAmplitude(Shown):
    """What is known at each line, (nf,) first; nan where no admissible state was found."""

    frf: FRF
    """Response of the outputs over the force that holds the amplitude, first harmonic (operating)."""
    force: Array
    """N, peak, (nf,)."""
    joint: ComplexArray
    """Relative displacement of every connection in m, phase relative to the force, (nf, connections)."""
    outcomes: tuple[Outcome, ...]
    of: str
    """What is held: a connection or a degree of freedom."""
    amplitude: float
    """m, peak."""
    connections: tuple[str, ...]

    def finding(self) -> str:
        """Where the least force holds the amplitude."""
        held = f"{self.of} held at {self.amplitude * 1e6:.4g} µm by a force on {self.frf.inputs[0]}"
        if np.all(np.isnan(self.force)):
            return f"{held}; {said_of(self.outcomes)}"
        k = int(np.nanargmin(self.force))
        least = f"the least is {self.force[k]:.4g} N at {self.frf.frequency[k]:.5g} Hz"
        return f"{held}: {least}; {said_of(self.outcomes)}"

    def columns(self) -> Columns:
        """A row per line: the force, the amplitude of every joint, how it ended."""
        return columns_of(self.frf, self.force, np.abs(self.joint), self.outcomes, self.connections)

    def to_xarray(self) -> Any:
        """The receptance over frequency, output and input."""
        return self.frf.to_xarray()

    def plot(self, ax: Any = None) -> Any:
        """The force in N that holds the amplitude, over frequency in Hz."""
        axes = axes_of(ax)
        axes.semilogy(self.frf.frequency, self.force, label=literal(f"{self.of} at {self.amplitude * 1e6:.4g} µm"))
        axes.set(xlabel="frequency [Hz]", ylabel="force [N]")
        name_curves(axes)
        return axes


def constant_amplitude(
    machine: Machine,
    frequency: ArrayLike,
    amplitude: float,
    of: str,
    drive: str | None = None,
    outputs: Sequence[str] | None = None,
) -> ConstantAmplitude:
    """Hold abs(x) or abs(z) at ``amplitude`` by the force, as a controlled shaker does, line by line.

    Folds of the response at constant force vanish: the force is one more unknown beside z + Hzz g(z) = Hzf F. The
    amplitude of a machine's one nonlinear joint gives the force at once, F = A abs(1 + Hzz G(A, ω))/abs(Hzf); several
    joints are solved from the machine at rest, the branch that grows out of it.

    Parameters
    ----------
    frequency
        Lines in Hz, positive and ascending, shape (nf,).
    amplitude
        m, peak.
    of
        A connection (its relative displacement) or a degree of freedom.
    drive
        Degree of freedom the force acts on; default: that of the file, else the tool's x, else y.
    outputs
        Degrees of freedom of the receptance; default: the tool's and ``drive``.
    """
    lines = np.atleast_1d(np.asarray(frequency, dtype=float))
    if lines.ndim != 1 or not len(lines) or not np.all(np.isfinite(lines)) or np.any(np.diff(lines, prepend=0) <= 0):
        raise InputError("constant amplitude: lines must be finite, positive and ascending")
    if not (np.isfinite(amplitude) and amplitude > 0):
        raise InputError(f"constant amplitude: amplitude is {amplitude!r} m, expected more than 0")
    driven = machine.driven_dof(drive)
    shown = tuple(dict.fromkeys([*machine.tool.values(), driven] if outputs is None else outputs))
    names = [c.name for c in machine.flexible]
    assembly = Assembly(machine, shown if of in names else tuple(dict.fromkeys([*shown, of])), (driven,))
    row = names.index(of) if of in names else len(names) + assembly.outputs.index(of)
    view = assembly.at(2 * np.pi * lines)
    found = _state(assembly, view, row, amplitude)
    pull = view.coordinates.together(found.gain * found.z)
    motion = view.Hof[:, :, 0] * found.force[:, None] - (view.Hoz @ pull[:, :, None])[:, :, 0]
    motion[:, list(assembly.nonlinear)] = found.z
    outcomes = found.outcomes(assembly.limits, 1e-12)
    first, lost = len(names), outcomes != Outcome.CONVERGED
    value = (motion[:, first : first + len(shown)] / found.force[:, None])[:, :, None]
    force = np.where(lost, np.nan, found.force)
    motion[lost], value[lost] = np.nan, np.nan
    kind = ReceptanceKind.OPERATING if assembly.nonlinear else ReceptanceKind.LINEAR
    frf = FRF(lines, value, shown, (driven,), kind)
    return ConstantAmplitude(frf, force, motion[:, :first], tuple(outcomes), of, float(amplitude), tuple(names))


def _state(assembly: Assembly, view: View, row: int, amplitude: float) -> Prescribed:
    """Joint motions and force that hold motion ``row`` at the amplitude."""
    joints = assembly.moving
    lines = len(view.omega)
    fine = np.ones(lines, dtype=bool)
    if assembly.nonlinear == (row,):
        A = np.full(lines, amplitude)
        gain = joints[0].first_harmonic(A, view.omega).gain
        per_force = view.Hzf[:, 0, 0] / (1 + view.Hzz[:, 0, 0] * gain)
        force = amplitude / np.abs(per_force)
        return Prescribed((per_force * force)[:, None], gain[:, None], force, fine)
    direct, through = view.Hof[:, row : row + 1, 0], view.Hoz[:, row : row + 1]
    if joints:
        return solve_prescribed(view, joints, caps_of(assembly), direct, through, amplitude)
    none = np.zeros((lines, 0), dtype=complex)
    return Prescribed(none, none, amplitude / np.abs(direct[:, 0]), fine)
