"""Describing functions of joints: the paper's equation 33, python-control, sampling error, sums."""

from __future__ import annotations

import control
import numpy as np
import pytest
from samples import KAPPA, SURFACE

from jointlib.describing import DescribingFunction
from jointlib.errors import InputError
from jointlib.harmonic import numerical_first_harmonic
from jointlib.joint import Joint
from jointlib.laws.chebyshev import Chebyshev
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.polynomial import Polynomial
from jointlib.laws.viscous import Viscous


def test_equation_33_is_reproduced() -> None:
    """G = K1 + (3/4) K3 A² + jω (c0 + c2 A²/4), A in µm as printed."""
    A, omega = np.array([0.5e-6, 1e-6, 3e-6, 5e-6]), 2 * np.pi * 4800.0
    a = A * 1e6
    printed = (654.1640 - 1.7083 * 0.75 * a**2) * 1e6 + 1j * omega * (463.0620 - 19.8415 * a**2 / 4)
    np.testing.assert_allclose(Joint((Polynomial(SURFACE),)).first_harmonic(A, omega).gain, printed, rtol=1e-14)


def test_even_terms_of_equation_16_do_not_enter_the_gain_about_a_clamped_mean() -> None:
    full = ((-70.6689, 463.062), (654.164e6, 22.3744e6), (28.582e12, -19.8415e12), (-1.7083e18, 44.3015e18))
    A, omega = np.array([1e-6, 4e-6]), 3000.0
    np.testing.assert_allclose(
        Polynomial(full).first_harmonic(A, omega).gain, Polynomial(SURFACE).first_harmonic(A, omega).gain, rtol=1e-14
    )


def test_sampling_a_polynomial_is_exact_from_its_degree_plus_two_samples() -> None:
    law = Polynomial(((0, 400.0, 3.0), (6e8, 2e7, 1e6), (1e13, 1e12, 0), (1e18, 0, 0)))
    exact = law.first_harmonic(3e-6, 3e3)
    assert numerical_first_harmonic(law, 3e-6, 3e3, samples=6).gain == pytest.approx(complex(exact.gain), rel=1e-13)
    aliased = numerical_first_harmonic(law, 3e-6, 3e3, samples=4).gain
    assert abs(aliased / exact.gain - 1) > 1e-6


def test_chebyshev_surface_equals_its_polynomial() -> None:
    surface = Chebyshev(((3.0, 60.0, 1.0), (2600.0, -4.0, 2.0), (5.0, 7.0, 0.5), (-40.0, 2.0, 0.1)), 4e-6, 0.12)
    z, v = np.linspace(-4e-6, 4e-6, 41)[:, None], np.linspace(-0.12, 0.12, 31)
    np.testing.assert_allclose(surface.polynomial().force(z, v), surface.force(z, v), rtol=0, atol=1e-12 * 2700)
    A = np.array([1e-6, 3.9e-6])
    np.testing.assert_allclose(
        surface.first_harmonic(A, 3e3).gain, surface.polynomial().first_harmonic(A, 3e3).gain, rtol=1e-12
    )


def test_plain_sampling_across_a_kink_says_its_error() -> None:
    law = Jenkins(stiffness=1e7, slip_force=50.0)
    exact = complex(law.first_harmonic(1e-5).gain)
    assert exact / 1e7 == pytest.approx(0.5 + 0.318310j, abs=5e-7)
    before = np.inf
    for samples in (64, 256, 1024):
        sampled = numerical_first_harmonic(law, 1e-5, samples=samples)
        error = abs(complex(sampled.gain) - exact)
        assert error < before / 4
        assert error <= float(sampled.error) < 20 * error
        before = error
    assert abs(complex(numerical_first_harmonic(law, 1e-5).gain) - exact) < 1e-12 * abs(exact)


def test_slow_cycle_dissipates_coulomb_work() -> None:
    law, x = Jenkins(stiffness=1e7, slip_force=50.0), 1e-4
    work = np.pi * x**2 * complex(law.describing_function(x, omega=1.0)).imag
    assert work == pytest.approx(4 * law.slip_force * (x - law.slip_force / law.stiffness))


def test_play_in_series_delays_the_slider() -> None:
    """With play the loop is that of the spring over a travel shortened by the play: same corners, shifted."""
    law, A = Jenkins(1e7, 50.0, clearance=2e-6), 2e-5
    theta = np.linspace(0, 2 * np.pi, 20001)[:-1]
    force = Joint((law,)).force_along(np.tile(A * np.cos(theta), 2), np.zeros(40000))[-20000:]
    work = np.sum(force * -A * np.sin(theta)) * theta[1]
    assert work == pytest.approx(4 * 50.0 * (A - 50.0 / 1e7 - 2e-6), rel=1e-3)


def test_python_control_takes_the_block_as_it_is() -> None:
    joint = Joint((HertzGuide(630.0, KAPPA), Viscous(503.0), Jenkins(4e7, 36.0)))
    A, omega = np.array([1e-6, 3e-6, 6e-6]), 2 * np.pi * 500.0
    block = DescribingFunction(joint).at(omega)
    np.testing.assert_array_equal(control.describing_function(block, A), joint.first_harmonic(A, omega).gain)


def test_python_control_finds_the_limit_cycle_that_harmonic_balance_finds() -> None:
    """A softening spring in negative feedback round an unstable plant: H(jω) G(A) = −1 by hand and by control."""
    joint = Joint((Linear(1.0), Cubic(-0.05)))
    plant = control.tf([4.0], [1.0, 3.0, 3.0, 1.0]) * 3
    block = DescribingFunction(joint).at(1.0)
    amplitudes = np.linspace(0.5, 3.4, 30)
    response = control.describing_function_response(plant, block, amplitudes, np.geomspace(0.5, 5, 2000))
    (amplitude, omega), *_ = response.intersections
    assert omega == pytest.approx(np.sqrt(3.0), rel=1e-3)
    assert amplitude == pytest.approx(np.sqrt((1 - 8 / 12) / (0.75 * 0.05)), rel=1e-3)


def test_control_can_sample_a_block_that_depends_on_displacement_alone() -> None:
    joint = Joint((HertzGuide(630.0, KAPPA),))
    block = DescribingFunction(joint).at(100.0)
    sampled = control.describing_function(block, [2e-6], num_points=200, try_method=False)
    assert sampled[0] == pytest.approx(complex(joint.first_harmonic(2e-6).gain), rel=1e-9)
    with pytest.raises(InputError, match="depends on velocity or memory"):
        DescribingFunction(joint + Viscous(1.0)).at(100.0)(1e-6)


def test_joint_gain_is_the_sum_of_its_parts() -> None:
    parts = (HertzGuide(630.0, KAPPA), Viscous(503.0), Jenkins(4e7, 36.0), Cubic(1e18))
    total = sum(complex(p.first_harmonic(2e-6, 3e3).gain) for p in parts)
    assert complex(Joint(parts).first_harmonic(2e-6, 3e3).gain) == pytest.approx(total, rel=1e-15)


def test_gain_at_rest_is_the_tangent_for_smooth_laws() -> None:
    joint = Joint((HertzGuide(630.0, KAPPA), Polynomial(SURFACE)))
    harmonic = joint.first_harmonic(0.0, 100.0)
    assert harmonic.gain == pytest.approx(654.164e6 * 2 + 100j * 463.062, rel=1e-9)
    assert harmonic.d_amplitude == 0


def test_negative_amplitude_is_refused() -> None:
    with pytest.raises(InputError, match="amplitude"):
        Joint((Linear(1.0),)).first_harmonic(-1e-6)


def test_smoothed_friction_has_the_first_harmonic_of_its_quadrature() -> None:
    """From a damper F/v at rest to ideal friction, 4jF/(πA), at velocities a thousand times the smoothing one."""
    law, A, omega = Coulomb(3.0, 1e-3), np.geomspace(1e-8, 1e-3, 40)[:, None], np.array([50.0, 700.0, 3000.0])
    found, known = law.first_harmonic(A, omega), numerical_first_harmonic(law, A, omega)
    np.testing.assert_allclose(found.gain, known.gain, rtol=1e-12, atol=0)
    np.testing.assert_allclose(found.d_amplitude, known.d_amplitude, rtol=1e-7, atol=1e-3)
    np.testing.assert_allclose(found.d_omega, known.d_omega, rtol=1e-7, atol=1e-12)
    assert law.first_harmonic(0.0, 700.0).gain == pytest.approx(3e3 * 700j, rel=1e-9)
    assert law.first_harmonic(1e-3, 0.0).gain == 0
    assert law.first_harmonic(1e-3, 3e3).gain == pytest.approx(Coulomb(3.0).first_harmonic(1e-3).gain, rel=1e-6)
