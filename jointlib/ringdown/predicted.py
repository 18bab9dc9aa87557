"""The decay that a joint makes of a mode: averaging, amplitude and phase slowly varying."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.ringdown.free_gain import free_gain, grid

_FINE = 2000


@dataclass(frozen=True)
class Predicted:
    """Frequency and damping of a free decay over amplitude."""

    amplitude: Array
    """m, rising."""
    omega: Array
    """rad/s."""
    damping_ratio: Array

    def decay(self, first: float, time: Array) -> tuple[Array, Array]:
        """Amplitude in m and phase in rad at times in s from an amplitude on: dA/dt = −ζ ω A, dφ/dt = ω.

        Time is the integral of dA/(ζωA) down from the first amplitude; below the lowest amplitude known it is nan.
        """
        a = np.geomspace(min(first, float(self.amplitude[-1])), float(self.amplitude[0]), _FINE)
        omega, ratio = (np.interp(a, self.amplitude, y) for y in (self.omega, self.damping_ratio))
        if np.any(ratio <= 0):
            raise InputError("the mode grows where the joint feeds it, expected a damping above 0 at all amplitudes")
        u = -np.log(a)
        late = _integral(1 / (ratio * omega), u)
        phase = _integral(1 / ratio, u)
        return (
            np.exp(np.interp(time, late, np.log(a), right=np.nan)),
            np.interp(time, late, phase, right=np.nan),
        )


def _integral(y: Array, x: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(x))])


def predict(joint: Joint, modal_mass: float, lowest: float, highest: float, *, alone: bool = True) -> Predicted:
    """f(A) and ζ(A) of a mass on a joint that decays freely, by the joint's describing function G(A, ω) = k + jωc.

    M(ṡ + s²) + k + cs = 0 with s = −δ + jω(A) and Ȧ = −δA, so that δ = (c/2M)/(1 + (A/2ω) dω/dA) and
    ω² = k/M − δ² + …; a cycle that loses energy changes amplitude and frequency (Krylov–Bogoliubov averaging).
    """
    A = grid(lowest, highest)
    tangent = float(np.median(free_gain(joint, A, np.ones(len(A)), modal_mass, alone=False).real))
    omega = np.full(len(A), np.sqrt(max(tangent, 1e-12) / modal_mass))
    for _ in range(6):
        gain = free_gain(joint, A, omega, modal_mass, alone=alone)
        if np.any(gain.real <= 0):
            raise InputError(
                f"joint {joint.name!r}: nothing holds the mass at {A[gain.real <= 0][0]:.3g} m, expected stiffness"
            )
        omega = np.sqrt(gain.real / modal_mass)
    c = gain.imag / omega
    slope = scipy.interpolate.CubicSpline(np.log(A), np.log(omega))(np.log(A), 1)
    delta = c / (2 * modal_mass) / (1 + 0.5 * slope)
    fall = scipy.interpolate.CubicSpline(np.log(A), delta)(np.log(A), 1)
    squared = gain.real / modal_mass - delta**2 + fall * delta - delta**2 * slope
    damped = np.sqrt(np.maximum(squared, 1e-300))
    return Predicted(A, damped, delta / np.hypot(damped, delta))
