"""A mass on the joint FMU in model exchange: what the Python law says, and what harmonic balance says of it.

The mass stands outside, scipy integrates it, and every force comes out of the FMU. Harmonic balance keeps the first
harmonic of the guide's force. That is enough while the guide softens gently (1 and 3 µm). It is not where rows of balls
lift off, from 4.09 µm on: there the stiffness has a corner, higher harmonics enter, and so close to the tip of a peak
that leans over, a small shift in frequency is a large one in amplitude. Past lift-off the comparison is not made.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from machine_host import LIBRARY, Exchange, library_machine, unpacked
from scipy.integrate import solve_ivp
from tools import require

from jointlib.arrays import Array
from jointlib.io.joint_file import read_joint
from jointlib.law import Motion
from machines import response

MASS = 60.0
GUIDE = read_joint(LIBRARY / "guide.joint.toml")
Force = Callable[[float, float], float]
both_versions = pytest.mark.parametrize("fmi", [2, 3])


def of_law(z: float, v: float) -> float:
    """Force of the guide in N, from the Python law."""
    return float(GUIDE.step(Motion(np.asarray(z), np.asarray(v)), GUIDE.initial_state(0.0))[0])


def of_fmu(fmi: int) -> Force:
    """Force of the guide in N, from its FMU."""
    require("cc")
    fmu = Exchange(unpacked(GUIDE, fmi), fmi)
    assert fmu.n == 0

    def force(z: float, v: float) -> float:
        fmu.put({"displacement": z, "velocity": v})
        return float(fmu.get(["force"])[0])

    return force


def motion(force: Force, peak: float, frequency: float, start: Array, times: Array, rtol: float = 1e-11) -> Array:
    """Displacement and velocity of the mass under a cosine, shape (2, times)."""
    omega = 2 * np.pi * frequency

    def slope(t: float, x: Array) -> list[float]:
        return [x[1], (peak * np.cos(omega * t) - force(x[0], x[1])) / MASS]

    done = solve_ivp(
        slope, (0.0, times[-1]), start, t_eval=times, method="DOP853", rtol=rtol, atol=[1e-7 * rtol, 1e-4 * rtol]
    )
    return np.asarray(done.y)


def steady(force: Force, peak: float, frequency: float, guess: Array) -> Array:
    """The motion that repeats after one period, at 201 instants: Newton's method on its start."""
    times = np.linspace(0.0, 1 / frequency, 201)
    x, size = guess, np.array([1e-9, 1e-9 * 2 * np.pi * frequency])
    for _ in range(10):
        end = motion(force, peak, frequency, x, times)[:, -1]
        columns = [(motion(force, peak, frequency, x + e, times)[:, -1] - end) / e.sum() for e in np.diag(size)]
        move = np.linalg.solve(np.column_stack(columns) - np.eye(2), x - end)
        x = x + move
        if np.max(np.abs(move / size)) < 0.1:
            return motion(force, peak, frequency, x, times)
    pytest.fail("the periodic motion was not found")


@pytest.mark.slow
@both_versions
def test_mass_on_the_fmu_moves_as_on_the_law_also_past_lift_off(fmi: int) -> None:
    times = np.linspace(0.0, 20 / 500.0, 401)
    start = np.array([9e-6, 0.0])
    expected = motion(of_law, 20.0, 500.0, start, times)
    found = motion(of_fmu(fmi), 20.0, 500.0, start, times)
    assert np.max(np.abs(expected[0])) > 2 * 4.09e-6
    difference = np.max(np.abs(found - expected), axis=1) / np.max(np.abs(expected), axis=1)
    assert np.max(difference) < 1e-6


@pytest.mark.parametrize("number", [0, 1])
def test_steady_vibration_of_the_mass_on_the_fmu_has_the_amplitude_of_harmonic_balance(number: int) -> None:
    machine = library_machine("paper_sdof_hertz")
    peak = response(machine, force=machine.force).peaks[number]
    # At the peak the motion lags the force by a quarter of a period.
    guess = np.array([0.0, 2 * np.pi * peak.frequency * peak.amplitude])
    z = steady(of_fmu(2), peak.force, peak.frequency, guess)[0]
    turn = np.exp(-2j * np.pi * np.arange(200) / 200)
    assert abs(2 * np.mean(z[:-1] * turn)) == pytest.approx(peak.amplitude, rel=5e-3)


@pytest.mark.slow
def test_steady_vibration_builds_up_from_rest_to_the_same_amplitude() -> None:
    """Time integration alone, off the peak, where the transient beats and decays by exp(-c t/(2 m))."""
    machine = library_machine("paper_sdof_hertz")
    frequency, peak = 500.0, machine.force[0]
    (_, amplitude, _) = harmonic_balance(peak, frequency)
    periods = int(np.ceil(np.log(1e4) * 2 * MASS / 503.0 * frequency))
    times = np.linspace((periods - 1) / frequency, periods / frequency, 201)[:-1]
    z = motion(of_fmu(3), peak, frequency, np.zeros(2), times, rtol=1e-7)[0]
    turn = np.exp(-2j * np.pi * np.arange(200) / 200)
    assert abs(2 * np.mean(z * turn)) == pytest.approx(amplitude, rel=5e-3)


def harmonic_balance(peak: float, frequency: float) -> tuple[float, float, float]:
    """Force, amplitude and frequency of A |K(A) - m ω² | = F with the guide's describing function, by bisection."""
    omega = 2 * np.pi * frequency
    low, high = 0.0, 4e-6
    for _ in range(60):
        middle = (low + high) / 2
        gain = complex(GUIDE.first_harmonic(middle, omega).gain)
        low, high = (low, middle) if middle * abs(gain - MASS * omega**2) > peak else (middle, high)
    return peak, low, frequency
