"""Periodic steady states: they repeat, they are those that waiting would bring, and few runs find them."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest
from test_resimulation import linear_record

from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.loop.balance import steady
from jointlib.loop.balance.steady import steady_force
from jointlib.loop.balance.tangents import tangents

SAMPLES, STEP, PEAK, K = 2560, 1e-5, 3e-6, 1e8


def path() -> tuple[Array, Array]:
    """A multisine of 40 lines that is not symmetric: z in m with its largest value PEAK, ż in m/s."""
    rng, omega = np.random.default_rng(4), 2 * np.pi / (SAMPLES * STEP)
    lines = np.zeros(SAMPLES // 2 + 1, dtype=complex)
    lines[8:48] = np.exp(2j * np.pi * rng.random(40))
    z = np.fft.irfft(lines, SAMPLES)
    size = PEAK / np.abs(z).max()
    return size * z, size * np.fft.irfft(1j * omega * np.arange(len(lines)) * lines, SAMPLES)


def waited(law: JointLaw, z: Array, v: Array, state: Array, periods: int) -> Array:
    """The force over the last of so many periods, stepped one after the other."""
    force = np.empty(len(z))
    for _ in range(periods):
        for i in range(len(z)):
            force[i], state = law.step(Motion(z[i], v[i], STEP), state)
    return force


@pytest.mark.parametrize("reach", [0.8, 1.6, 4.0])
def test_a_loop_that_hardly_forgets_repeats_all_the_same(reach: float) -> None:
    law = BoucWen(K, K * reach * PEAK, 8.0)
    z, v = path()
    force = steady_force(law, z, v, STEP)
    end = np.array([z[-1], force[-1] / K])
    np.testing.assert_allclose(waited(law, z, v, end, 1), force, atol=1e-7 * np.abs(force).max())


@pytest.mark.parametrize(
    "law",
    [
        Jenkins(K, 0.02 * K * PEAK),
        Jenkins(K, 0.4 * K * PEAK, 0.1 * PEAK),
        Jenkins(K, 2 * K * PEAK),
        Iwan((K, K / 2, K / 3), (0.05 * K * PEAK, 0.2 * K * PEAK, 0.3 * K * PEAK)),
        Dahl(K, 0.3 * K * PEAK),
    ],
    ids=["short", "play", "stuck", "several", "gradual"],
)
def test_the_steady_state_is_the_one_that_waiting_brings(law: JointLaw) -> None:
    z, v = path()
    middle = np.asarray((z.max() + z.min()) / 2)
    force = steady_force(law, z, v, STEP)
    np.testing.assert_allclose(waited(law, z, v, law.initial_state(middle), 3), force, atol=1e-9 * np.abs(force).max())


@pytest.mark.parametrize(
    ("law", "runs"),
    [(Jenkins(K, 0.1 * K * PEAK), 3), (Dahl(K, 0.3 * K * PEAK), 6), (BoucWen(K, 1.6 * K * PEAK, 8.0), 12)],
    ids=["sliders", "gradual", "nearly elastic"],
)
def test_a_handful_of_runs_settles(law: JointLaw, runs: int) -> None:
    with patch.object(steady, "_stepped", wraps=steady._stepped) as stepped:
        steady_force(law, *path(), STEP)
    assert stepped.call_count <= runs


def test_the_slope_of_a_bounded_parameter_at_zero_is_taken_within_its_bounds() -> None:
    o, weak = linear_record(), BoucWen(1e-6, 1e-12, 2.0, 0.0)
    (slope,) = tangents([o], Joint((weak,)), ["bouc_wen.shape"])["bouc_wen.shape"]
    assert 0 < np.linalg.norm(slope) < 1e-9 * np.linalg.norm(o.joint_force)
