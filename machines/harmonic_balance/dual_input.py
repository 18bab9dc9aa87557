"""One harmonic about a mean that moves: dual-input describing functions with the mean as an unknown beside it."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray

from ..statics.bias import Biased
from .harmonics import Forces


def dual_input_forces(biased: Biased, z: ComplexArray, omega: Array, slopes: bool = True) -> Forces:
    """Forces g_1 = G(A, ω, z0) Z and g_0 = N0(z0, A), less what is carried at rest, with their derivatives or 0.

    Parameters
    ----------
    z
        (points, 2, members) in m: the first harmonic Z, and the shift of z0 from the static position (its real part).
    """
    Z, shift = z[:, 0], z[:, 1].real
    A = np.abs(Z)
    if not slopes:
        gain, mean = biased.harmonic(A, omega, shift)
        none = np.zeros((len(z), 2, *z.shape[1:]), dtype=complex)
        return Forces(np.stack([gain * Z, mean - biased.carried], axis=1), none, none, A)
    found = biased.slopes(A, omega, shift)
    turn = np.where(A > 0, Z / np.where(A > 0, A, 1.0), 0.0)
    half, lift = found.gain_by_amplitude * A / 2, found.mean_by_amplitude / 2
    by_bias, by_mean = found.gain_by_bias * Z / 2, found.mean_by_bias / 2
    force = np.stack([found.gain * Z, found.mean - biased.carried], axis=1)
    by_z = np.stack([np.stack([found.gain + half, by_bias], 1), np.stack([lift * turn.conj(), by_mean], 1)], 1)
    by_conjugate = np.stack([np.stack([turn**2 * half, by_bias], 1), np.stack([lift * turn, by_mean], 1)], 1)
    return Forces(force, by_z, by_conjugate, A)
