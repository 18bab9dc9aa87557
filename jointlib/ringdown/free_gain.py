"""What holds a mode while it decays: the describing function of a joint, with what further harmonics make of it."""

from __future__ import annotations

import numpy as np

from jointlib.arrays import Array, ComplexArray
from jointlib.joint import Joint

_POINTS, _HARMONICS = 128, 7
_ROUNDS = 4
_NOTHING = 1e-6
"""Of the first harmonic; others below it change nothing."""
_SPREAD = 40


def free_gain(joint: Joint, amplitude: Array, omega: Array, modal_mass: float, *, alone: bool = True) -> ComplexArray:
    """G = k + jωc in N/m over the amplitudes in m of a free motion at ω in rad/s.

    z = z₀ + A cos θ + Re Σ Zₙ e^(jnθ). A free mode has no outer force at any harmonic: n² M ω² Zₙ = Fₙ and F₀ = 0. Zₙ
    is found by repetition, and G = F₁/A along that motion. Where other modes would answer too (``alone`` false), only
    the mean is balanced.
    """
    return _cycle(joint, amplitude, omega, modal_mass, alone)[0]


def second_harmonic(joint: Joint, amplitude: Array, omega: Array, modal_mass: float) -> Array:
    """abs(Z₂)/A of a free motion."""
    return _cycle(joint, amplitude, omega, modal_mass, True)[1]


def _cycle(joint: Joint, amplitude: Array, omega: Array, modal_mass: float, alone: bool) -> tuple[ComplexArray, Array]:
    A, w = np.asarray(amplitude, dtype=float), np.broadcast_to(np.asarray(omega, dtype=float), np.shape(amplitude))
    timed, untimed = joint.parted(lambda law: law.in_time)
    with_state, plain = timed.parted(lambda law: bool(law.states))
    cycles = 2 if with_state.laws else 1
    theta = 2 * np.pi * np.arange(cycles * _POINTS + (cycles > 1)) / _POINTS
    turn = np.exp(1j * np.outer(theta, np.arange(_HARMONICS + 1)))
    take = slice(len(theta) - _POINTS, None)
    Z = np.zeros((_HARMONICS + 1, len(A)), dtype=complex)
    Z[1] = A
    n = np.arange(_HARMONICS + 1)[:, None]
    middle = float(np.median(w)) if len(w) else 1.0
    F, k = np.zeros_like(Z), modal_mass * w**2
    for turned in range(2 if with_state.laws else _ROUNDS):
        z = (turn @ Z).real
        rate = (turn @ (1j * n * Z)).real
        force = plain.force_along(z, rate * w, 1.0)[take]
        if with_state.laws:
            force = force + with_state.force_along(z, rate * middle, 2 * np.pi / (_POINTS * middle))[take]
        F = (turn[take].conj().T @ force) * (2 / _POINTS)
        F[0] = F[0] / 2
        others = F[:1] if with_state.laws else F[[0, *range(2, _HARMONICS + 1)]]
        if turned == 0 and not np.any(np.abs(others) > _NOTHING * np.abs(F[1])):
            break
        Z[0] = np.clip((Z[0] - F[0] / k).real, -0.5 * A, 0.5 * A)
        if alone:
            Z[2:] = (F[2:] - k * Z[2:]) / (k * (n[2:] ** 2 - 1))
            size = np.abs(Z[2:])
            Z[2:] = Z[2:] * np.minimum(1.0, 0.3 * A / np.maximum(size, 1e-300))
    gain = F[1] / A
    for law in untimed.laws:
        gain = gain + law.first_harmonic(A, w).gain
    return gain, np.abs(Z[2]) / A


def grid(lowest: float, highest: float) -> Array:
    """Amplitudes in m over which a gain is worked out once."""
    return np.geomspace(0.98 * lowest, 1.02 * highest, _SPREAD)
