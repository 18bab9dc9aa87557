"""The largest stable communication step: closed forms, stepping the loop in time, and what must not matter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fmu.loop_step import Loop, Master, largest_step, natural_frequencies, one_step_map
from jointlib.arrays import Array

JACOBI, GAUSS_SEIDEL = Master.JACOBI, Master.GAUSS_SEIDEL
BOTH = pytest.mark.parametrize("master", list(Master))


def mass_on_joint(ratio: float, m: float = 10.0, k: float = 1e7) -> tuple[Loop, float, float, float]:
    c = 2 * ratio * math.sqrt(k * m)
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    return Loop(m * one, none, none, one, np.array([k]), np.array([c])), m, k, c


def chain(k: tuple[float, ...] = (1e7, 3e7, 1e8), c: tuple[float, ...] = (1e3, 500.0, 4e3)) -> Loop:
    """Three masses, the last on the ground; the middle one also on a spring and damper of its own."""
    return Loop(
        np.diag([1.0, 2.0, 5.0]),
        np.diag([0.0, 30.0, 0.0]),
        np.diag([0.0, 2e6, 0.0]),
        np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]]),
        np.array(k),
        np.array(c),
    )


def growth(loop: Loop, step: float, master: Master, steps: int) -> float:
    """How a disturbed loop grows while a master steps it: each body is integrated by itself, its forces held.

    The energy that is left after the second half, over that after the first; written without any matrix exponential.
    """
    M, C, K, J = loop.mass, loop.damping, loop.stiffness, loop.joints
    n = len(M)

    def force(x: Array) -> Array:
        return loop.joint_stiffness * (J @ x[:n]) + loop.joint_damping * (J @ x[n:])

    def stepped(x: Array, f: Array) -> Array:
        def rate(_: float, x: Array) -> Array:
            return np.concatenate([x[n:], np.linalg.solve(M, -C @ x[n:] - K @ x[:n] - J.T @ f)])

        return np.asarray(solve_ivp(rate, (0, step), x, rtol=1e-11, atol=1e-18).y[:, -1])

    x = np.concatenate([np.linspace(1.0, 2.0, n) * 1e-6, np.zeros(n)])
    given, sizes = force(x), []
    assembled = K + J.T @ (loop.joint_stiffness[:, None] * J)
    for _ in range(steps):
        if master is GAUSS_SEIDEL:
            x = stepped(x, force(x))
        else:
            x, given = stepped(x, given), force(x)
        sizes.append(x[n:] @ M @ x[n:] + x[:n] @ assembled @ x[:n])
    half = steps // 2
    return float(max(sizes[half:]) / max(sizes[:half]))


@pytest.mark.parametrize("ratio", [1e-3, 0.01, 0.05, 0.1])
def test_a_lightly_damped_mass_on_a_joint_has_the_limits_of_a_pure_delay(ratio: float) -> None:
    loop, _, k, c = mass_on_joint(ratio)
    jacobi, seidel = largest_step(loop, JACOBI), largest_step(loop, GAUSS_SEIDEL)
    assert jacobi == pytest.approx(2 * c / (3 * k), rel=0.0125 if ratio == 0.1 else 0.01)
    assert seidel == pytest.approx(2 * c / k, rel=1e-5)


@pytest.mark.parametrize("ratio", [0.01, 0.2, 0.5, 1.0, 3.0])
def test_for_any_damping_the_closed_bounds_hold(ratio: float) -> None:
    loop, m, k, c = mass_on_joint(ratio)
    jacobi, seidel = largest_step(loop, JACOBI), largest_step(loop, GAUSS_SEIDEL)
    assert seidel == pytest.approx(min(2 * c / k, 2 * m / c), rel=1e-5)
    assert jacobi is not None
    bound = 1 / (3 * k / (2 * c) + c / m)
    assert bound * (1 - 1e-5) <= jacobi <= 1.25 * bound


@pytest.mark.slow
@BOTH
@pytest.mark.parametrize(
    "loop", [mass_on_joint(0.05)[0], mass_on_joint(0.8)[0], chain()], ids=["light", "heavy", "chain"]
)
def test_stepping_the_loop_decays_below_the_limit_and_grows_above_it(loop: Loop, master: Master) -> None:
    step = largest_step(loop, master)
    assert step is not None
    assert growth(loop, 0.9 * step, master, 600) < 0.9
    assert growth(loop, 1.1 * step, master, 600) > 1.1


@BOTH
def test_the_limit_is_where_the_one_step_map_leaves_the_unit_circle(master: Master) -> None:
    loop = chain()
    step = largest_step(loop, master)
    assert step is not None

    def radius(h: float) -> float:
        return float(np.max(np.abs(np.linalg.eigvals(one_step_map(loop, h, master)))))

    assert all(radius(share * step) < 1 for share in np.linspace(0.02, 0.9999, 200))
    assert radius(1.0001 * step) > 1


@BOTH
def test_a_twentieth_of_the_jacobi_limit_keeps_the_damping_within_five_per_cent(master: Master) -> None:
    loop, m, _, c = mass_on_joint(0.02)
    limit = largest_step(loop, master)
    assert limit is not None
    step = limit / 20
    kept = -np.log(np.max(np.abs(np.linalg.eigvals(one_step_map(loop, step, master))))) / step
    assert kept / (c / (2 * m)) == pytest.approx(0.95, abs=2e-3)


@BOTH
def test_without_damping_no_step_is_stable(master: Master) -> None:
    assert largest_step(mass_on_joint(0.0)[0], master) is None
    assert largest_step(chain(c=(0.0, 0.0, 0.0)), master) is not None, "the dashpot on the middle mass damps every mode"
    assert largest_step(replace(chain(c=(0.0, 0.0, 0.0)), damping=np.zeros((3, 3))), master) is None
    assert largest_step(replace(mass_on_joint(0.05)[0], joint_damping=np.array([-1.0])), master) is None


@BOTH
def test_a_dashpot_outside_the_joint_is_spent_like_its_own(master: Master) -> None:
    loop, _, k, c = mass_on_joint(0.02)
    beside = replace(loop, damping=np.full((1, 1), c), joint_damping=np.zeros(1))
    # What a body computes inside comes without delay.
    assert largest_step(beside, master) == pytest.approx(c / (master.value * k), rel=2e-3)


@BOTH
def test_free_motion_and_what_no_joint_feels_do_not_matter(master: Master) -> None:
    loop, _, k, c = mass_on_joint(0.05)
    reduced = replace(loop, mass=np.full((1, 1), 3.0 * 6.0 / 9.0))
    apart = Loop(
        np.diag([3.0, 6.0, 1.0]),
        np.zeros((3, 3)),
        np.diag([0.0, 0.0, 1e9]),
        np.array([[1.0, -1.0, 0.0]]),
        np.array([k]),
        np.array([c]),
    )
    assert largest_step(apart, master) == pytest.approx(largest_step(reduced, master), rel=1e-5)


@BOTH
def test_a_joint_that_does_nothing_sets_no_limit(master: Master) -> None:
    dead = replace(mass_on_joint(0.05)[0], joint_stiffness=np.zeros(1), joint_damping=np.zeros(1))
    assert largest_step(dead, master) == math.inf
    none = replace(chain(), joints=np.zeros((0, 3)), joint_stiffness=np.zeros(0), joint_damping=np.zeros(0))
    assert largest_step(none, master) == math.inf


@BOTH
def test_softer_and_more_damped_joints_than_the_stiffest_are_stable_at_its_limit(master: Master) -> None:
    loop = chain()
    step = largest_step(loop, master)
    assert step is not None
    rng = np.random.default_rng(7)
    for _ in range(200):
        softer = replace(
            loop,
            joint_stiffness=loop.joint_stiffness * rng.uniform(0.05, 1.0, 3),
            joint_damping=loop.joint_damping * rng.uniform(1.0, 2.0, 3),
        )
        eigenvalues = np.linalg.eigvals(one_step_map(softer, 0.9 * step, master))
        assert np.max(np.abs(eigenvalues)) < 1


def test_natural_frequencies_are_those_of_the_assembled_machine() -> None:
    loop, m, k, _ = mass_on_joint(0.05)
    assert natural_frequencies(loop) == pytest.approx([math.sqrt(k / m) / (2 * np.pi)])
    pair = replace(loop, mass=np.diag([3.0, 6.0]), damping=np.zeros((2, 2)), stiffness=np.zeros((2, 2)))
    pair = replace(pair, joints=np.array([[1.0, -1.0]]))
    assert natural_frequencies(pair) == pytest.approx([0.0, math.sqrt(k / 2.0) / (2 * np.pi)])
