"""Frequency response functions: receptance between named degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import FrequencyMismatch, InputError, nearest
from jointlib.shown.pictures import axes_of, draw_magnitude, literal, name_curves
from jointlib.shown.result import Columns, Shown, package

_NAMED = 8
"""Curves that a picture names."""


class ReceptanceKind(Enum):
    """What a receptance of a machine with nonlinear joints stands for; never pass one off as another."""

    LINEAR = "linear"
    """No nonlinear joint is involved."""
    OPERATING = "operating"
    """Secant: response over force at the converged amplitude; only the forced column is self-consistent."""
    FROZEN = "frozen"
    """Every joint held at the describing-function gain of a stated amplitude."""
    TANGENT = "tangent"
    """Small motion on top of a state: joints held at their incremental stiffness and damping."""


class Quantity(Enum):
    """Motion over force as it was measured; the value is its SI unit."""

    RECEPTANCE = "m/N"
    MOBILITY = "m/s/N"
    ACCELERANCE = "m/s^2/N"

    @property
    def word(self) -> str:
        """The word in files."""
        return self.name.lower()

    def per_receptance(self, frequency: ArrayLike) -> ComplexArray:
        """This quantity over the receptance, 1, jω or −ω², at frequencies in Hz."""
        jw = 2j * np.pi * np.asarray(frequency, dtype=float)
        return np.asarray(jw ** [Quantity.RECEPTANCE, Quantity.MOBILITY, Quantity.ACCELERANCE].index(self))


@dataclass(frozen=True, repr=False)
class FRF(Shown):
    """Receptance H = X/F, displacement per force, time factor e^(+jωt), peak amplitudes.

    Parameters
    ----------
    frequency
        Lines in Hz, ascending, shape (nf,).
    receptance
        m/N, shape (nf, outputs, inputs).
    outputs, inputs
        Names of the degrees of freedom, ``component.dof``.
    kind
        What the receptance stands for.
    variance
        E|error|² per entry in (m/N)², same shape as ``receptance``; None where it is not known.
    """

    frequency: Array
    receptance: ComplexArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    kind: ReceptanceKind = ReceptanceKind.LINEAR
    variance: Array | None = None

    def __post_init__(self) -> None:
        expected = (len(self.frequency), len(self.outputs), len(self.inputs))
        if self.receptance.shape != expected:
            raise InputError(f"FRF: receptance has shape {self.receptance.shape}, expected {expected}")
        if len(self.frequency) == 0 or np.any(np.diff(self.frequency) <= 0) or not np.all(np.isfinite(self.frequency)):
            raise InputError("FRF: frequencies must be finite, ascending and not empty")

    @property
    def omega(self) -> Array:
        """Angular frequency in rad/s."""
        return 2 * np.pi * self.frequency

    def between(self, output: str, input: str) -> ComplexArray:
        """Receptance from a force on ``input`` to the displacement of ``output`` in m/N, shape (nf,)."""
        for name, known in ((output, self.outputs), (input, self.inputs)):
            if name not in known:
                raise InputError(f"FRF: no degree of freedom {name!r}, {nearest(name, known)}")
        return self.receptance[:, self.outputs.index(output), self.inputs.index(input)]

    def on(self, frequency: ArrayLike) -> FRF:
        """The same receptance on other lines (Hz), by linear interpolation of its inverse.

        Near a resonance 1/H is nearly a straight line where H is not. Lines outside the range are refused.
        Entries are interpolated one by one; an entry that vanishes somewhere is interpolated directly.
        """
        lines = np.atleast_1d(np.asarray(frequency, dtype=float))
        if lines[0] < self.frequency[0] or lines[-1] > self.frequency[-1]:
            raise FrequencyMismatch(
                f"FRF: asked for {lines[0]:g} to {lines[-1]:g} Hz, "
                f"have {self.frequency[0]:g} to {self.frequency[-1]:g} Hz"
            )
        out = np.empty((len(lines), *self.receptance.shape[1:]), dtype=complex)
        for index in np.ndindex(*self.receptance.shape[1:]):
            entry = self.receptance[(slice(None), *index)]
            inverse = bool(np.all(np.abs(entry) > 0))
            source = 1 / entry if inverse else entry
            value = np.interp(lines, self.frequency, source)
            out[(slice(None), *index)] = 1 / value if inverse else value
        return replace(self, frequency=lines, receptance=out, variance=None)

    def _entries(self) -> dict[str, ComplexArray]:
        """Every receptance by its words."""
        pairs = ((o, i) for o in self.outputs for i in self.inputs)
        return {f"{o} per force on {i}": self.between(o, i) for o, i in pairs}

    @property
    def largest(self) -> tuple[int, int, int]:
        """Indices of the line, output and input where it is largest."""
        size = np.where(np.isfinite(self.receptance), np.abs(self.receptance), -1.0)
        line, o, i = (int(index) for index in np.unravel_index(int(np.argmax(size)), size.shape))
        return line, o, i

    def finding(self) -> str:
        """What it relates to what, and where it is largest."""
        line, o, i = self.largest
        size = float(np.abs(self.receptance[line, o, i]))
        low, high = self.frequency[0], self.frequency[-1]
        known = f"{self.kind.value} receptance, {low:.6g} to {high:.6g} Hz in {len(self.frequency)} lines"
        if not np.isfinite(size):
            return f"{known}; no line has a value"
        return (
            f"{known}; largest {size * 1e6:.4g} µm/N at {self.frequency[line]:.5g} Hz "
            f"({self.outputs[o]} per force on {self.inputs[i]})"
        )

    def columns(self) -> Columns:
        """A row per line, a column for every output and input."""
        return {"frequency": (self.frequency, "Hz")} | {name: (H, "m/N") for name, H in self._entries().items()}

    def to_xarray(self) -> Any:
        """The receptance as an xarray DataArray over frequency, output and input; ``attrs`` holds its unit and kind."""
        xarray = package("xarray", "to_xarray")
        lines = xarray.Variable("frequency", self.frequency, {"units": "Hz"})
        places = {"frequency": lines, "output": list(self.outputs), "input": list(self.inputs)}
        about = {"units": "m/N", "kind": self.kind.value}
        return xarray.DataArray(self.receptance, places, ("frequency", "output", "input"), "receptance", about)

    def plot(self, ax: Any = None) -> Any:
        """The size of every receptance in µm/N over frequency in Hz."""
        axes = axes_of(ax)
        entries = self._entries()
        for name, H in entries.items():
            label = literal(name) if len(entries) <= _NAMED else None
            draw_magnitude(axes, self.frequency, H, label=label)
        axes.set(xlabel="frequency [Hz]", ylabel="|x/F| [µm/N]")
        name_curves(axes)
        return axes
