"""A rig with a joint that is not linear, integrated in time by scipy, as a record of the tracer. Simulated."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from rig_samples import PERIOD, RATE, measurement, record
from scipy.integrate import solve_ivp

from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.balance.bodies import rig_of
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.floor import excited_band, noise_floor
from jointlib.loop.balance.spectra import spectra_of

Array = NDArray[np.float64]
K, C = 6e8, 500.0
M1, M2, M3 = 0.942, 1.1, 1.1
INVERSE = 1 / M1 + 1 / (M2 + M3)
LINEAR = (Linear(K), Viscous(C))
PEAK = 3e-6
"""Peak of z in m of the linear rig at level 1."""
FREQUENCY = np.fft.rfftfreq(PERIOD, 1 / RATE)


def drive(level: float, seed: int = 3) -> NDArray[np.complex128]:
    """P on the lines of the period from 2 to 8 kHz, peaks in N, such that the linear rig moves by level · PEAK."""
    inside = (FREQUENCY >= 2e3) & (FREQUENCY <= 8e3)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(FREQUENCY))
    unit = np.where(inside, np.exp(1j * phases), 0)
    w = 2 * np.pi * FREQUENCY
    z = np.fft.irfft(unit / M1 / (INVERSE * (K + 1j * w * C) - w**2), 8 * PERIOD) * 4 * PERIOD
    return np.asarray(unit * level * PEAK / np.abs(z).max(), dtype=complex)


def observed(
    P: NDArray[np.complex128], a1: NDArray[np.complex128], f: NDArray[np.complex128], seed: int, noise: float = 3e-4
) -> Observed:
    """A record of four periods with 70 dB of noise; spectra are peaks on the lines of the period."""
    rng = np.random.default_rng(seed)

    def signal(X: NDArray[np.complex128]) -> Array:
        x = np.tile(np.fft.irfft(X, PERIOD) * PERIOD / 2, 4)
        return np.asarray(x + noise * np.std(x) * rng.standard_normal(len(x)))

    test = measurement(settle=0)
    a2 = f / (M2 + M3)
    spectra, _ = spectra_of(record({"a1": signal(a1), "a2": signal(a2), "a3": signal(a2), "P": signal(P)}), test)
    floor = noise_floor(spectra)
    return Observed(spectra, rig_of(test), floor, excited_band([spectra], [floor], test.band), K, C)


def integrated(
    P: NDArray[np.complex128], rate: Callable[[Array], tuple[float, Array]], states: int
) -> tuple[Array, Array]:
    """z and f over the fourth period, by scipy's Runge–Kutta pair; ``rate`` gives f and the rates of further states."""
    k = np.flatnonzero(P)
    w = 2 * np.pi * FREQUENCY[k]

    def course(t: float, y: Array) -> Array:
        f, inner = rate(y)
        push = float((P[k] @ np.exp(1j * w * t)).real)
        return np.array([y[1], push / M1 - INVERSE * f, *inner])

    T, n = PERIOD / RATE, 4 * PERIOD
    at = 3 * T + np.arange(n) * T / n
    start = np.zeros(2 + states)
    y = solve_ivp(course, (0, 4 * T), start, "RK45", at, rtol=1e-8, atol=1e-14, max_step=T / n).y
    return y[0], np.array([rate(column)[0] for column in y.T])
