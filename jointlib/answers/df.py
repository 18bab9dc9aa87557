"""Describing function of a joint at amplitudes and frequencies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from jointlib.answers.given import File, Quantities, Quantity, joint_of, one, several
from jointlib.arrays import Array, ComplexArray
from jointlib.describing import DescribingFunction
from jointlib.joint import Joint
from jointlib.shown.pictures import axes_of, draw_stiffness, name_curves
from jointlib.shown.result import Columns, Shown
from jointlib.system.memory import refuse_beyond

_EACH = 800.0
"""Bytes that an amplitude at a frequency takes until it is printed, 660 in a table and 800 as JSON."""


@dataclass(frozen=True, eq=False, repr=False)
class Gains(Shown):
    """G(A, ω) of a joint; equivalent stiffness Re G and, times 1/ω, damping Im G."""

    joint: Joint
    amplitude: Array
    """m, (nA,)."""
    frequency: Array
    """Hz, (nf,)."""
    gain: ComplexArray
    """N/m, (nA, nf)."""
    warnings: tuple[str, ...]

    @property
    def damping(self) -> Array:
        """Im G/ω in N s/m, (nA, nf); nan at 0 Hz."""
        omega = 2 * np.pi * np.where(self.frequency, self.frequency, np.nan)
        return np.asarray(self.gain.imag / omega)

    def finding(self) -> str:
        """From which stiffness to which the joint goes over these amplitudes."""
        stiffness = self.gain.real / 1e6
        low, high = self.amplitude[[0, -1]] * 1e6
        return (
            f"joint {self.joint.name!r}: {stiffness[0, 0]:.4g} N/µm at {low:g} µm, {stiffness[-1, 0]:.4g} N/µm at "
            f"{high:g} µm ({self.frequency[0]:g} Hz)"
        )

    def columns(self) -> Columns:
        """A row per amplitude and frequency."""
        A, f = (np.ravel(x) for x in np.meshgrid(self.amplitude, self.frequency, indexing="ij"))
        return {
            "amplitude": (A, "m"),
            "frequency": (f, "Hz"),
            "stiffness": (np.ravel(self.gain.real), "N/m"),
            "damping": (np.ravel(self.damping), "N s/m"),
        }

    def plot(self, ax: Any = None) -> Any:
        """Equivalent stiffness in N/µm over the amplitude in µm, a curve a frequency."""
        axes = axes_of(ax)
        for k, f in enumerate(self.frequency):
            draw_stiffness(axes, self.amplitude, self.gain[:, k], marker=".", label=f"{f:g} Hz")
        axes.set(xlabel="amplitude [µm]", ylabel="stiffness [N/µm]")
        name_curves(axes)
        return axes


def df(joint: Joint | File, *, amplitude: Quantities, frequency: Quantities, bias: Quantity = 0.0) -> Gains:
    """Describing function G(A, ω) of a joint, what ``jointlib df`` prints.

    Parameters
    ----------
    joint
        A joint or its file.
    amplitude
        Peak relative displacements, m or with units.
    frequency
        Hz or with units.
    bias
        Mean relative displacement, m or with its unit.
    """
    model, mean = joint_of(joint), one(bias, "m", "bias") or 0.0
    A, f = (np.array(several(x, unit, where, 0)) for x, unit, where in
            ((amplitude, "m", "amplitude"), (frequency, "Hz", "frequency")))  # fmt: skip
    refuse_beyond(_EACH * len(A) * len(f), f"--amplitude, --frequency: {len(A)} amplitudes at {len(f)} frequencies")
    harmonic = DescribingFunction(model, mean).harmonic(A[:, None], 2 * np.pi * f)
    said = []
    low, high = model.validity.get("amplitude", (0.0, np.inf))
    outside = (low > A) | (high < A)
    if np.any(outside):
        listed = ", ".join(f"{a * 1e6:g} um" for a in A[outside])
        said.append(f"outside the amplitudes the joint was identified on (up to {high * 1e6:g} um): {listed}")
    largest = np.max(np.abs(np.where(np.isfinite(harmonic.gain), harmonic.gain, 0)), initial=1)
    if np.max(harmonic.error) > 1e-6 * largest:
        said.append(f"numerical, with an error of up to {np.max(harmonic.error):.2g} N/m")
    return Gains(model, A, f, harmonic.gain, tuple(said))
