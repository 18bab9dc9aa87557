"""A record whose motion does not close: what its accelerations do not tell. Simulated, by time integration."""

from __future__ import annotations

import numpy as np
import pytest
from integrated_rig import FREQUENCY, INVERSE, LINEAR, M1, M2, M3, Array, C, K, drive
from rig_samples import PERIOD, RATE, measurement, record
from scipy.integrate import solve_ivp

from jointlib.joint import Joint
from jointlib.loop.balance.bench import Raw, observe, view_of
from jointlib.loop.balance.bodies import rig_of
from jointlib.loop.balance.floor import excited_band, noise_floor
from jointlib.loop.balance.spectra import spectra_of

PERIODS, RUN_IN, SHARE = 4, 3, 0.05


def warming() -> tuple[Array, Array, Array]:
    """P, z and f at the samples of four periods, over which the stiffness grows by a twentieth."""
    P, T = drive(1.0), PERIOD / RATE
    k = np.flatnonzero(P)
    w = 2 * np.pi * FREQUENCY[k]
    n = PERIODS * PERIOD

    def force(t: float, y: Array) -> float:
        return float(K * (1 + SHARE * (t / T - RUN_IN) / PERIODS) * y[0] + C * y[1])

    def course(t: float, y: Array) -> Array:
        return np.array([y[1], float((P[k] @ np.exp(1j * w * t)).real) / M1 - INVERSE * force(t, y)])

    at = RUN_IN * T + np.arange(n) / RATE
    y = solve_ivp(course, (0, at[-1]), np.zeros(2), "DOP853", at, rtol=1e-8, atol=1e-15).y
    push = np.tile(np.fft.irfft(P, PERIOD) * PERIOD / 2, PERIODS)
    return push, y[0], np.array([force(t, q) for t, q in zip(at, y.T, strict=True)])


@pytest.mark.slow
def test_a_ramp_and_a_parabola_of_z_close_the_joint_equation_of_a_motion_that_does_not_return() -> None:
    P, z, f = warming()
    a1, a2 = (P - f) / M1, f / (M2 + M3)
    spectra, _ = spectra_of(record({"a1": a1, "a2": a2, "a3": a2, "P": P}), measurement(settle=0))
    floor = noise_floor(spectra)
    raw = Raw(spectra, floor, rig_of(measurement()), excited_band([spectra], [floor], (2e3, 20e3)))
    o = observe(raw, Joint(LINEAR))
    use = (o.frequency >= 2e3) & (o.frequency <= 20e3)
    w = 2 * np.pi * o.frequency[use]
    A1, A2, F, E = (np.fft.rfft(x)[o.lines][use] for x in (a1, a2, f, K * SHARE * np.arange(len(z)) / len(z) * z))
    lacking = F - E + (K + 1j * w * C) * (A1 - A2) / w**2
    columns = view_of(raw, o).open_ends[:, use, 2]
    theta = np.linalg.lstsq(*(np.concatenate([x.real, x.imag], axis=-1).T for x in (columns, lacking)), rcond=None)[0]
    before, after = (np.linalg.norm(x) / np.linalg.norm(F) for x in (lacking, lacking - theta @ columns))
    assert before > 0.01
    # What is left is the fold of the jump of the acceleration itself, (ω·sample)²/12 of its share.
    assert after < 2e-5
