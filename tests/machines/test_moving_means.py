"""Joints whose means move under a static load: further harmonics, arc length and Hill's method against time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_static_bias import DAMPING, MASS, two_guides
from test_statics import KAPPA, hung

from jointlib.arrays import Array
from jointlib.errors import InputError, Outcome
from jointlib.harmonic import numerical_first_harmonic
from jointlib.joint import Joint
from jointlib.law import MemorylessLaw, Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_contact import HertzContact
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.quadratic import Quadratic
from jointlib.laws.viscous import Viscous
from machines import (
    AmplitudeMap,
    ArcLength,
    Machine,
    Newton,
    linear_check,
    lobes_at_amplitude,
    mean_displacement,
    response,
    static_point,
)
from machines.coupling.second_order import machine_equations
from machines.harmonic_balance.assembly import Assembly
from machines.harmonic_balance.balance import Balance
from machines.operating.branches import Branch, Stability
from machines.stability.hill import growth

SAMPLES = 512


def orbit(branch: Branch, i: int, joint: int = 0) -> Array:
    """One period of a joint's displacement in m, its mean included."""
    theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    z = [branch.joint[i, joint], *(branch.overtones[i, :, joint] if len(branch.harmonics) > 1 else [])]
    parts = [(x * np.exp(1j * h * theta)).real for h, x in zip(branch.harmonics, z, strict=True)]
    return np.asarray(branch.mean[i, joint] + np.sum(parts, axis=0))


def settled(rate: object, size: int, omega: float, periods: int = 100) -> Array:
    """The last period of a motion from rest, (samples, size)."""
    assert callable(rate)
    t = np.arange((periods + 1) * SAMPLES) * 2 * np.pi / omega / SAMPLES
    found = solve_ivp(rate, (0.0, t[-1]), np.zeros(size), t_eval=t, rtol=1e-10, atol=1e-15, method="DOP853").y.T
    last, before = found[-SAMPLES:], found[-2 * SAMPLES : -SAMPLES]
    assert np.max(np.abs(last - before)) < 1e-7 * np.max(np.ptp(last, axis=0))
    return np.asarray(last)


def one_mass(law: MemorylessLaw, load: float, force: float, omega: float) -> Array:
    def rate(t: float, x: Array) -> list[float]:
        pull = float(law.force(np.array(x[0]), np.array(x[1]))) + DAMPING * x[1]
        return [x[1], (load + force * np.cos(omega * t) - pull) / MASS]

    return settled(rate, 2, omega)[:, 0]


def at(machine: Machine, force: float, frequency: float, harmonics: tuple[int, ...]) -> tuple[Branch, int]:
    """The one branch at a frequency."""
    lines = np.array([0.99, 1.0, 1.01]) * frequency
    (branch,) = response(machine, force, lines, harmonics=harmonics).branches[0]
    return branch, int(np.flatnonzero(branch.frequency == frequency)[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "load", "force", "frequency", "highest"),
    [
        (HertzContact(2000.0, KAPPA), 900.0, 600.0, 400.0, 7),
        # Lifts off once a period: the overtones fall slowly.
        (HertzContact(2000.0, KAPPA), -700.0, 900.0, 300.0, 12),
        (HertzGuide(630.0, KAPPA), 2500.0, 600.0, 480.0, 8),
    ],
)
def test_the_whole_orbit_is_that_of_the_motion_in_time(
    law: MemorylessLaw, load: float, force: float, frequency: float, highest: int
) -> None:
    machine = hung(load, law, Viscous(DAMPING), mass=MASS)
    branch, i = at(machine, force, frequency, tuple(range(highest + 1)))
    expected = one_mass(law, load, force, 2 * np.pi * frequency)
    assert branch.harmonics == tuple(range(1, highest + 1))
    # What is left out is of the size of the last two that were not.
    left = 3 * np.sum(np.abs(branch.overtones[i, -2:, 0])) + 1e-7 * np.ptp(expected)
    assert np.max(np.abs(orbit(branch, i) - expected)) < left
    assert abs(np.mean(expected) - branch.mean[i, 0]) < left
    # One harmonic with a mean does not do.
    one, k = at(machine, force, frequency, (1,))
    assert np.max(np.abs(orbit(one, k) - expected)) > 10 * left


@pytest.mark.slow
def test_two_joints_and_their_means_move_as_in_time() -> None:
    machine, force, frequency = two_guides(800.0), 300.0, 440.0
    upper, lower = HertzContact(2500.0, KAPPA), HertzGuide(630.0, KAPPA)
    omega = 2 * np.pi * frequency

    def rate(t: float, x: Array) -> list[float]:
        z, v = x[0] - x[1], x[2] - x[3]
        above = float(upper.force(np.array(z), np.array(0.0))) + 1e4 * v
        below = float(lower.force(np.array(x[1] + 0.5e-6), np.array(0.0))) + 2e4 * x[3]
        slide = (800.0 + force * np.cos(omega * t) - above) / 20 + 9.81
        return [x[2], x[3], slide, (above - below - 5e7 * x[1] - 2e3 * x[3]) / 40 + 9.81]

    x = settled(rate, 4, omega)
    branch, i = at(machine, force, frequency, tuple(range(8)))
    for joint, expected in enumerate((x[:, 0] - x[:, 1], x[:, 1] + 0.5e-6)):
        left = 3 * np.sum(np.abs(branch.overtones[i, -2:, joint]))
        assert left < 1e-3 * np.ptp(expected)
        assert np.max(np.abs(orbit(branch, i, joint) - expected)) < left
        assert abs(np.mean(expected) - branch.mean[i, joint]) < left
        moved = np.mean(expected) - static_point(machine).displacement[joint]
        assert abs(moved) > 1e-3 * np.ptp(expected)


@pytest.mark.slow
def test_small_vibrations_are_those_of_the_dual_input_describing_function() -> None:
    """What further harmonics change falls with the square of the amplitude, in the mean's own move too."""
    machine = hung(900.0, HertzContact(2000.0, KAPPA), Viscous(DAMPING), mass=MASS)
    rest, apart, moved = static_point(machine).displacement[0], [], []
    for force in (80.0, 40.0):
        several, i = at(machine, force, 420.0, (0, 1, 2, 3))
        one, k = at(machine, force, 420.0, (1,))
        apart.append(abs(several.joint[i, 0] / one.joint[k, 0] - 1))
        moved.append(abs((several.mean[i, 0] - rest) / (one.mean[k, 0] - rest) - 1))
        assert one.mean[k, 0] == pytest.approx(mean_displacement(machine, np.abs(one.joint[k]), 420.0)[0, 0], rel=1e-12)
    for size in (apart, moved):
        assert size[0] / size[1] == pytest.approx(4.0, rel=0.05)
        assert size[1] < 1e-2


@pytest.mark.slow
def test_the_estimate_counts_the_second_harmonic_that_a_one_sided_law_raises() -> None:
    """A quadratic law raises a mean and a second harmonic and nothing else: without these the estimate were 0."""
    true, estimated = [], []
    cases = (
        (hung(0.0, Linear(654.164e6), Quadratic(28.582e12), Viscous(DAMPING), mass=MASS), 400.0),
        (hung(900.0, HertzContact(2000.0, KAPPA), Viscous(DAMPING), mass=MASS), 300.0),
        (hung(-300.0, HertzContact(2000.0, KAPPA), Viscous(DAMPING), mass=MASS), 150.0),
    )
    for machine, force in cases:
        for frequency in (250.0, 400.0, 500.0):
            one, k = at(machine, force, frequency, (1,))
            several, i = at(machine, force, frequency, (0, 1, 2, 3, 4, 5, 6, 7))
            true.append(abs(one.joint[k, 0] - several.joint[i, 0]) / abs(several.joint[i, 0]))
            estimated.append(one.error[k])
    ratio = np.array(estimated) / true
    assert min(true) > 1e-6
    assert np.all((ratio > 0.6) & (ratio < 1.6))


@pytest.mark.slow
def test_harmonics_are_added_under_load_where_the_first_is_not_enough() -> None:
    machine = hung(900.0, HertzContact(2000.0, KAPPA), Viscous(DAMPING), mass=MASS)
    found = response(machine, [5.0, 600.0], [300.0, 600.0], points=30, harmonics="auto")
    assert [p.harmonics for p in found.peaks] == [1, 5]
    assert found.outcomes == (Outcome.CONVERGED,) * 2
    assert found.warnings == ()
    assert max(b.error.max() for b in found.branches[1]) < 1e-3


@pytest.mark.slow
def test_arc_length_finds_the_branches_and_folds_of_the_map_under_load() -> None:
    machine = hung(900.0, HertzContact(2000.0, KAPPA), Viscous(4e3), mass=MASS)
    mapped, traced = (
        response(machine, [20.0, 120.0], [380.0, 520.0], points=80, method=m) for m in (AmplitudeMap(), ArcLength())
    )
    assert [len(b) for b in mapped.branches] == [len(b) for b in traced.branches] == [1, 3]
    for a, b in zip(mapped.peaks, traced.peaks, strict=True):
        assert b.amplitude == pytest.approx(a.amplitude, rel=1e-8)
        assert b.frequency == pytest.approx(a.frequency, rel=1e-7)
    for a, b in zip(mapped.branches[1], traced.branches[1], strict=True):
        assert (a.stability, a.ends) == (b.stability, b.ends)
        # The map closes a branch on the last line it has beside the fold; the curve turns at the fold itself.
        assert b.frequency[[0, -1]] == pytest.approx(a.frequency[[0, -1]], rel=1e-3)


@pytest.mark.slow
def test_arc_length_of_several_joints_under_load_passes_the_solutions_of_newton() -> None:
    machine = two_guides(800.0)
    newton, traced = (response(machine, 300.0, [420.0, 540.0], points=25, method=m) for m in (Newton(), ArcLength()))
    for a, b in zip(newton.peaks, traced.peaks, strict=True):
        assert b.amplitude == pytest.approx(a.amplitude, rel=1e-8)
    (curve,), (line,) = traced.branches[0], newton.branches[0]
    both = np.intersect1d(curve.frequency, line.frequency)
    assert len(both) >= 25
    for frequency in both:
        i, k = (int(np.flatnonzero(b.frequency == frequency)[0]) for b in (curve, line))
        np.testing.assert_allclose(curve.joint[i], line.joint[k], rtol=1e-8)
        np.testing.assert_allclose(curve.mean[i], line.mean[k], rtol=1e-9)


@pytest.mark.parametrize("harmonics", [(1, 0), (1, 2, 3, 0)])
def test_the_jacobian_with_means_is_the_derivative_of_the_residual(harmonics: tuple[int, ...]) -> None:
    lower = Joint((HertzGuide(630.0, KAPPA), Viscous(2e4), Jenkins(4e7, 36.0)))
    assembly = Assembly(two_guides(800.0).with_joint("lower", lower), ("slide.z",), ("slide.z",))
    balance = Balance.of(assembly, np.array([2 * np.pi * 400.0]), np.array([300.0]), harmonics)
    rng, shape = np.random.default_rng(1), (1, len(harmonics), 2)
    z = 1.5e-6 * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    z[:, -1] = 0.1 * z[:, -1].real
    J, m = balance.jacobian(balance.forces(z))[0], 2 * len(harmonics)
    # A mean is real: what its imaginary part would do means nothing.
    for k in range(2 * m - 2):
        step = np.zeros(2 * m)
        step[k] = 1e-11
        dz = (step[:m] + 1j * step[m:]).reshape(shape)
        up, down = (balance.residual(x, balance.forces(x).force).ravel() for x in (z + dz, z - dz))
        column = (up - down) / 2e-11
        assert np.max(np.abs(np.concatenate([column.real, column.imag]) - J[:, k])) < 1e-4 * np.max(np.abs(J))


def test_friction_under_load_keeps_its_share_in_the_whole_orbit() -> None:
    """Stepped in time: a mass on a spring with a Jenkins element that was loaded slowly and slips in part."""
    stiffness, stick, slip, load, force, frequency = 2e8, 1.2e8, 150.0, 400.0, 500.0, 300.0
    machine = hung(load, Linear(stiffness), Jenkins(stick, slip), Viscous(DAMPING), mass=MASS)
    branch, i = at(machine, force, frequency, (0, 1, 2, 3, 4, 5, 6, 7))
    n, law, omega = 4096, Jenkins(stick, slip), 2 * np.pi * frequency
    h, x = 2 * np.pi / omega / n, static_point(machine).displacement[0]
    held, state = law.step(Motion(np.array(x), np.array(0.0)), law.initial_state(np.array(0.0)))
    v, last = 0.0, np.empty(n)
    drive = force * np.cos(2 * np.pi * (np.arange(n) + 0.5) / n)
    reach, slider = slip / stick, float(np.ravel(state)[0])
    for _ in range(20):
        for k in range(n):
            last[k] = x
            # Midpoint rule, the slider dragged along.
            half = x + 0.5 * h * v
            stretch = min(max(half - slider, -reach), reach)
            pull = stiffness * half + stick * stretch + DAMPING * v
            v += h * (load + drive[k] - pull) / (MASS + 0.5 * h * DAMPING)
            x = half + 0.5 * h * v
            slider = x - min(max(x - slider, -reach), reach)
    found = orbit(branch, i)[:: SAMPLES // 64]
    assert float(held) > 0
    assert np.ptp(last) > 2 * slip / stick
    assert np.max(np.abs(found - last[:: n // 64])) < 2e-3 * np.ptp(last)


@pytest.mark.thorough
@pytest.mark.parametrize(("load", "force", "frequency"), [(900.0, 600.0, 400.0), (-700.0, 500.0, 320.0)])
def test_disturbances_under_load_die_out_as_in_time(load: float, force: float, frequency: float) -> None:
    law, omega = HertzContact(2000.0, KAPPA), 2 * np.pi * frequency
    machine = hung(load, law, Viscous(DAMPING), mass=MASS)
    highest = tuple(range(1, 13))
    branch, i = at(machine, force, frequency, (0, *highest))
    equations = machine_equations(machine)
    z = np.concatenate([branch.joint[i], branch.overtones[i, :, 0], branch.mean[i]])[None, :, None]
    rate = growth(equations, machine.joints(), z, np.array([omega]), (*highest, 0))[0]

    def tangent(t: float, y: Array) -> list[float]:
        at_t = branch.mean[i, 0] + sum(
            (x * np.exp(1j * h * omega * t)).real for h, x in zip(highest, z[0, :-1, 0], strict=True)
        )
        k = float(law.slopes(np.array(at_t), np.array(0.0))[0])
        return [y[1], -(k * y[0] + DAMPING * y[1]) / MASS]

    columns = [solve_ivp(tangent, (0.0, 2 * np.pi / omega), e, rtol=1e-9, atol=1e-12).y[:, -1] for e in np.eye(2)]
    largest = np.max(np.abs(np.linalg.eigvals(np.array(columns))))
    assert np.exp(2 * np.pi * rate / omega) == pytest.approx(largest, rel=1e-3)
    labelled = response(machine, force, [frequency, 1.01 * frequency], stability="hill").branches[0][0]
    assert labelled.stability is Stability.STABLE


@pytest.mark.slow
def test_the_middle_one_of_three_solutions_under_load_is_unstable_by_folds_and_by_hill() -> None:
    machine = hung(900.0, HertzContact(2000.0, KAPPA), Viscous(4e3), mass=MASS)
    found = response(machine, 120.0, [380.0, 520.0], points=80, stability="hill")
    kinds = [{label.value for label in branch.labels} for branch in found.branches[0]]
    # One harmonic is a tenth off on the upper branches, so that near the folds their multipliers are in doubt.
    assert ["stable" in kind for kind in kinds] == [True, False, True]
    assert "unstable" in kinds[1]


@pytest.mark.slow
def test_lobes_at_an_amplitude_hold_the_joint_at_the_gain_about_its_moved_mean() -> None:
    law, A, load = HertzContact(2000.0, KAPPA), 3e-6, 900.0
    cut = {"tool": {"x": "slide.z"}, "cutting": {"process": "turning", "specific": 1e9}, "frequency": (200.0, 800.0)}
    loaded = replaced(hung(load, law, Viscous(DAMPING), mass=MASS), **cut)
    for amplitude in (0.0, A):
        z0 = mean_displacement(loaded, [[amplitude]], 400.0)[0, 0]
        gain = float(numerical_first_harmonic(law, max(amplitude, 1e-10), 1.0, z0).gain.real)
        held = Linear(gain), Viscous(DAMPING)
        plain = replaced(hung(load, *held, mass=MASS), **cut, static=None)
        expected, found = (lobes_at_amplitude(m, [9000.0, 15000.0], amplitude) for m in (plain, loaded))
        np.testing.assert_allclose(found.depth, expected.depth, rtol=1e-4)
        np.testing.assert_allclose(found.chatter_frequency, expected.chatter_frequency, rtol=1e-4)
    about_zero = replaced(hung(load, law, Viscous(DAMPING), mass=MASS), **cut, static=None)
    unloaded = lobes_at_amplitude(about_zero, [9000.0, 15000.0], A)
    assert np.max(np.abs(unloaded.depth / found.depth - 1)) > 1e-2


def replaced(machine: Machine, **changes: object) -> Machine:
    from dataclasses import replace

    return replace(machine, **changes)  # type: ignore[arg-type]


def test_the_linear_check_at_an_amplitude_is_about_the_moved_means() -> None:
    machine, A = two_guides(800.0), 2e-6
    check = linear_check(machine, A, [100.0, 900.0])
    assert check.passed
    z0 = mean_displacement(machine, [[A, A]], check.resonance)[0]
    for joint, at_mean, k in zip(machine.joints(), z0, check.stiffness, strict=True):
        assert k == pytest.approx(float(numerical_first_harmonic(joint.laws[0], A, 1.0, at_mean).gain.real), rel=1e-8)
    assert np.max(np.abs(z0 - static_point(machine).displacement)) > 1e-8


def test_what_cannot_be_done_is_said() -> None:
    machine = hung(900.0, HertzContact(2000.0, KAPPA), Coulomb(5.0), Viscous(DAMPING), mass=MASS)
    (sentence,) = response(machine, 100.0, [380.0, 420.0], points=5, harmonics=(0, 1, 2)).warnings
    assert "guide: its force jumps" in sentence
    with pytest.raises(InputError, match=r"harmonics is \(0, 1, 2\)"):
        response(replaced(machine, static=None), 100.0, [380.0, 420.0], points=5, harmonics=(0, 1, 2))
