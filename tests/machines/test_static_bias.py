"""Joints that vibrate about a static load: dual-input describing functions against motion in time and each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_statics import KAPPA, hung, written

import machines
from jointlib.arrays import Array
from jointlib.errors import Outcome
from jointlib.harmonic import numerical_first_harmonic
from jointlib.joint import Joint
from jointlib.law import JointLaw, MemorylessLaw, Motion
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic import Quadratic
from jointlib.laws.viscous import Viscous
from machines import (
    Connection,
    Lumped,
    Machine,
    StaticLoad,
    mean_displacement,
    operating_point,
    read_machine,
    response,
    static_point,
)
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.newton import Problem
from machines.statics.mean_force import MeanForce

LIBRARY = Path(machines.__file__).parent / "library"
MASS, DAMPING = 60.0, 4e4


def in_time(law: MemorylessLaw, load: float, force: float, omega: float) -> tuple[float, complex]:
    """Mean and first harmonic of the steady motion of one mass, by integration until nothing of the start is left."""

    def motion(t: float, x: Array) -> list[float]:
        pull = float(law.force(np.array(x[0]), np.array(x[1]))) + DAMPING * x[1]
        return [x[1], (load + force * np.cos(omega * t) - pull) / MASS]

    period = 2 * np.pi / omega
    t = np.arange(121 * 256) * period / 256
    found = solve_ivp(motion, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-14, method="DOP853")
    last, before = found.y[0][-256:], found.y[0][-512:-256]
    assert np.max(np.abs(last - before)) < 1e-6 * np.ptp(last)
    return float(np.mean(last)), complex(2 * np.mean(last * np.exp(-1j * omega * t[-256:])))


def neglected(law: MemorylessLaw, omega: float, z0: float, z: complex) -> float:
    """First-order estimate of what harmonics 2 to 6 change in mean and first harmonic, m.

    Harmonics of the force at the sinusoidal motion move the mass, and their motion changes mean and first harmonic of
    the force; the three equations of the describing function turn that into motion.
    """
    theta = 2 * np.pi * np.arange(2048) / 2048

    def force(mean: float, first: complex, rest: Array) -> Array:
        at = mean + np.real(first * np.exp(1j * theta)) + rest
        return np.fft.rfft(law.force(at, 0 * at)) / len(theta) * np.where(np.arange(1025) == 0, 1, 2)

    def dynamic(h: int) -> complex:
        return -((h * omega) ** 2) * MASS + 1j * h * omega * DAMPING

    def equations(mean: float, first: complex, rest: Array) -> Array:
        g = force(mean, first, rest)
        one = dynamic(1) * first + g[1]
        return np.array([g[0].real, one.real, one.imag])

    g, still = force(z0, z, 0 * theta), np.zeros_like(theta)
    tangent = float(np.mean(law.slopes(z0 + np.real(z * np.exp(1j * theta)), 0 * theta)[0]))
    rest = sum(np.real(-g[h] / (dynamic(h) + tangent) * np.exp(1j * h * theta)) for h in range(2, 7))
    step = 1e-5 * abs(z)
    base = equations(z0, z, still)
    columns = [(equations(z0 + a * step, z + (b + 1j * c) * step, still) - base) / step for a, b, c in np.eye(3)]
    change = np.linalg.solve(np.array(columns).T, equations(z0, z, np.asarray(rest)) - base)
    return float(np.linalg.norm(change))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "load", "force", "frequency"),
    [
        (HertzGuide(630.0, KAPPA), 1500.0, 400.0, 500.0),
        (HertzGuide(630.0, KAPPA), 2500.0, 600.0, 480.0),
        (HertzContact(2000.0, KAPPA), -300.0, 200.0, 330.0),
        (HertzContact(2000.0, KAPPA), 900.0, 600.0, 400.0),
    ],
)
def test_amplitude_and_mean_are_those_of_the_motion_in_time(
    law: MemorylessLaw, load: float, force: float, frequency: float
) -> None:
    machine = hung(load, law, Viscous(DAMPING), mass=MASS)
    (branch,) = response(machine, force, [frequency]).branches[0]
    z = complex(branch.joint[0, 0])
    z0 = float(mean_displacement(machine, np.abs(branch.joint), branch.frequency)[0, 0])
    omega = 2 * np.pi * frequency
    mean, first = in_time(law, load, force, omega)
    error = np.hypot(z0 - mean, abs(z - first))
    estimate = neglected(law, omega, z0, z)
    assert estimate < 0.05 * abs(z)
    assert error < 1.2 * estimate + 1e-5 * abs(z)
    # The mean moves, by more than the describing function errs, and the gain at the static position would not do.
    assert abs(z0 - static_point(machine).of("guide")[0]) > 2 * abs(z0 - mean)


def test_the_mean_force_balances_the_load_at_every_amplitude() -> None:
    law = HertzContact(2000.0, KAPPA)
    machine = hung(900.0, law, Viscous(DAMPING))
    amplitude = np.geomspace(1e-9, 3e-5, 40)[:, None]
    z0 = mean_displacement(machine, amplitude, 400.0)
    mean = numerical_first_harmonic(law, amplitude, 1.0, z0).mean
    np.testing.assert_allclose(mean, 900.0, rtol=1e-9)
    assert np.all(np.diff(z0[:, 0]) < 0)


def test_a_quadratic_term_softens_a_free_mean_as_much_as_theory_says() -> None:
    K, K2 = 654.164e6, 28.582e12
    machine = hung(0.0, Linear(K), Quadratic(K2))
    A = np.array([1e-7, 1e-6, 5e-6])
    gain = Assembly(machine, (), ()).moving[0].first_harmonic(A, 1.0).gain.real
    z0 = mean_displacement(machine, A[:, None], 1.0)[:, 0]
    # N0 = K z0 + K2 (z0² + A²/2) = 0 and G = K + 2 K2 z0.
    exact = (-K + np.sqrt(K**2 - 2 * (K2 * A) ** 2)) / (2 * K2)
    np.testing.assert_allclose(z0, exact, rtol=1e-9)
    np.testing.assert_allclose(gain, K + 2 * K2 * exact, rtol=1e-12)
    assert gain[1] - K == pytest.approx(-((K2 * 1e-6) ** 2) / K, rel=2e-3)


@pytest.mark.parametrize("load", [0.0, 1500.0])
def test_slopes_with_a_moving_mean_are_differences_of_the_gain(load: float) -> None:
    joint = Assembly(hung(load, HertzContact(2000.0, KAPPA), Jenkins(4e7, 36.0)), (), ()).moving[0]
    A, h = np.array([0.3e-6, 2e-6, 6e-6, 2e-5]), 1e-4
    found = joint.first_harmonic(A, 2000.0)
    difference = (joint.first_harmonic(A * (1 + h), 2000.0).gain - joint.first_harmonic(A * (1 - h), 2000.0).gain) / (
        2 * h * A
    )
    np.testing.assert_allclose(found.d_amplitude, difference, rtol=1e-4, atol=1e-6 * np.max(np.abs(found.gain / A)))


def two_guides(load: float) -> Machine:
    slide = Lumped("slide", ("z",), np.array([[20.0]]))
    table = Lumped("table", ("z",), np.array([[40.0]]), np.array([[2e3]]), np.array([[5e7]]))
    upper = Joint((HertzContact(2500.0, KAPPA), Viscous(1e4)))
    lower = Joint((HertzGuide(630.0, KAPPA), Viscous(2e4)))
    connections = (
        Connection("upper", ("slide.z", "table.z"), upper),
        Connection("lower", ("table.z", "ground"), lower),
    )
    static = StaticLoad((0.0, 0.0, 9.81), {"slide.z": load}, {"lower": 0.5e-6})
    return Machine((slide, table), connections, tool={"y": "slide.z"}, static=static)


def test_several_joints_whose_means_move_together_have_the_exact_jacobian() -> None:
    assembly = Assembly(two_guides(800.0), ("slide.z",), ("slide.z",))
    view = assembly.at(2 * np.pi * np.array([350.0, 420.0, 700.0]))
    problem = Problem.of(view, assembly.moving, np.full(3, 300.0), np.ones(2))
    z = np.array([[3e-6 + 1e-6j, -1e-6j], [2e-6, 4e-6 - 3e-6j], [6e-6j, 5e-6]])
    _, gain, slope = problem.residual(z, problem.driven)
    J = problem.jacobian(z, gain, slope)
    assert slope.shape == (3, 2, 2)
    for k in range(4):
        step = 1e-11 * np.eye(4)[k]
        delta = step[:2] + 1j * step[2:]
        up, down = (problem.residual(z + s * delta, problem.driven)[0] for s in (1, -1))
        column = (up - down) / 2e-11
        np.testing.assert_allclose(np.concatenate([column.real, column.imag], axis=1), J[:, :, k], atol=2e-5)


def test_two_joints_balance_first_harmonic_and_mean_together() -> None:
    machine = two_guides(800.0)
    (branch,) = response(machine, 300.0, np.linspace(300.0, 700.0, 41)).branches[0]
    assert branch.outcome is Outcome.CONVERGED
    assert len(branch.frequency) == 41
    A = np.abs(branch.joint)
    z0 = mean_displacement(machine, A, branch.frequency)
    omega = 2 * np.pi * branch.frequency
    upper, lower = (joint.first_harmonic(A[:, i], omega, z0[:, i]) for i, joint in enumerate(machine.joints()))
    # Static balance of the slide, then of the table, whose own spring is stretched by its mean displacement.
    np.testing.assert_allclose(upper.mean, 800.0 + 20 * 9.81, rtol=1e-9)
    table = z0[:, 1] - 0.5e-6
    np.testing.assert_allclose(lower.mean + 5e7 * table - upper.mean, 40 * 9.81, rtol=1e-7)
    # Dynamic balance, F on the slide.
    z = branch.joint
    motion = z[:, 1], z[:, 0] + z[:, 1]
    np.testing.assert_allclose(-(omega**2) * 20 * motion[1] + upper.gain * z[:, 0], 300.0, rtol=1e-8)
    own = -(omega**2) * 40 + 2e3j * omega + 5e7
    np.testing.assert_allclose(own * motion[0] + lower.gain * z[:, 1], upper.gain * z[:, 0], rtol=1e-8)
    assert np.ptp(z0[:, 0]) > 1e-8


def test_a_prescribed_tool_amplitude_is_reached_under_load_and_at_rest_it_is_the_tangent() -> None:
    machine = two_guides(800.0)
    lines = np.array([330.0, 450.0, 600.0])
    point = operating_point(machine, lines, 3e-6)
    assert point.outcomes == (Outcome.CONVERGED,) * 3
    np.testing.assert_allclose(np.abs(point.frf.receptance[:, 0, 0]) * point.force, 3e-6, rtol=1e-9)
    for line, force in zip(lines, point.force, strict=True):
        answer = response(machine, float(force), [float(line)])
        assert abs(answer.branches[0][0].output[0, 0]) == pytest.approx(3e-6, rel=1e-8)
    rest = operating_point(machine, lines, 0.0).frf.receptance[:, 0, 0]
    small = response(machine, 1e-3, lines).frfs[0].receptance[:, 0, 0]
    np.testing.assert_allclose(rest, small, rtol=1e-8)
    unloaded = response(two_guides(0.0), 1e-3, lines).frfs[0].receptance[:, 0, 0]
    assert np.max(np.abs(unloaded / rest - 1)) > 0.02


def test_a_carriage_of_rows_under_load_is_the_guide_along_its_normal(tmp_path: Path) -> None:
    text = """
    schema = "jointlib/machine/1"
    [[component]]
    name = "slide"
    kind = "rigid"
    mass = 60
    inertia = [0.1, 0.1, 0.1]
    [[bundle]]
    name = "guide"
    kind = "linear-guide"
    between = ["slide", "ground"]
    axes = [[1, 0, 0], [0, 0, 1]]
    preload = "630 N"
    kappa = 3.931408125e-8
    damping = 20000
    width = "25 mm"
    length = "70 mm"
    [static]
    gravity = true
    force = { "slide.uz" = -1500 }
    [response]
    drive = "slide.uz"
    """
    carriage = written(tmp_path, text)
    one = hung(-1500.0 - 60 * 9.80665, HertzGuide(630.0, KAPPA), Viscous(20000.0))
    lines = np.linspace(400.0, 700.0, 31)
    rows, guide = (response(m, [50.0, 250.0], lines) for m in (carriage, one))
    for a, b in zip(rows.frfs, guide.frfs, strict=True):
        np.testing.assert_allclose(a.receptance, b.receptance, rtol=1e-9)
    sin = np.sqrt(0.5)
    for name, (z, force) in {n: static_point(carriage).of(n) for n in rows.connections}.items():
        side = -1.0 if "upper" in name else 1.0
        assert z == pytest.approx(-side * sin * static_point(one).of("guide")[0], rel=1e-10)
        assert force > 0 if side > 0 else force < 0


def test_friction_under_a_static_load_shakes_down_to_what_does_not_slip() -> None:
    stiffness, slip = 1e8, 30.0
    mean = MeanForce(Joint((Jenkins(stiffness, slip),)))
    A = np.array([0.0, 5e-8, 1.5e-7, 2.9e-7, 3.1e-7, 1e-6])
    z0 = np.full(6, 2e-7)
    # 20 N carried, as long as the cycle of ±kA leaves room for it below the slip force.
    expected = np.minimum(20.0, np.maximum(slip - stiffness * A, 0.0))
    np.testing.assert_allclose(mean.mean(A, np.ones(6), z0), expected, atol=1e-10)
    law, state = Jenkins(stiffness, slip), np.zeros((6, 1))
    path = np.concatenate([np.linspace(0, 1, 50)[:, None] * z0, z0 + A * np.sin(np.arange(2000) / 50)[:, None]])
    forces = []
    for z in path:
        force, state = law.step(Motion(z, 0 * z), state)
        forces.append(force)
    last = np.array(forces)[-629:]
    np.testing.assert_allclose((last.max(axis=0) + last.min(axis=0)) / 2, expected, atol=0.05)


def test_without_a_static_section_nothing_changes_and_with_an_idle_one_only_rounding() -> None:
    plain = read_machine(LIBRARY / "two_mass.toml")
    idle = response(replace(plain, static=StaticLoad()), 50.0)
    bare = response(plain, 50.0)
    for a, b in zip(idle.peaks, bare.peaks, strict=True):
        assert a.amplitude == pytest.approx(b.amplitude, rel=1e-9)
        assert a.frequency == pytest.approx(b.frequency, rel=1e-9)
    assert Assembly(plain, (), ()).biased is None
    assert all(x is y for x, y in zip(Assembly(plain, (), ()).joints, plain.joints(), strict=True))


def test_a_mean_that_cannot_be_balanced_ends_the_branch_by_name() -> None:
    laws: tuple[JointLaw, ...] = (Linear(6e8), Quadratic(2.8e13), Viscous(2e3))
    machine = hung(0.0, *laws)
    # Past K²/(2 K2²) = A² the mean of the quadratic has no balance.
    end = 6e8 / (np.sqrt(2) * 2.8e13)
    assembly = Assembly(machine, (), ())
    assert assembly.biased is not None
    assert assembly.limits[0].amplitude <= end
    assert assembly.limits[0].outcome in (Outcome.NO_EQUILIBRIUM, Outcome.PAST_FORCE_PEAK)
