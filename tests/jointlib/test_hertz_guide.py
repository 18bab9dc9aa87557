"""The preloaded guide: published and independently derived figures."""

from __future__ import annotations

import numpy as np
import pytest
from samples import KAPPA
from scipy.integrate import quad
from scipy.optimize import brentq

from jointlib.laws.hertz_guide import HertzGuide, centred_gain, row_harmonics

GUIDE = HertzGuide(630.0, KAPPA)


def force(z: float) -> float:
    return float(GUIDE.force(np.array(z), np.array(0.0)))


def test_explicit_force_solves_the_row_equations_of_the_paper() -> None:
    """Eqs 5 and 6: the row deflections from the row loads, P from their balance; P_L found by root search (eq. 7)."""
    s = np.sin(GUIDE.contact_angle)
    for load in (500.0, 1500.0, 2500.0):

        def balance(lower: float, load: float = load) -> float:
            upper = (2 * s * lower - load) / (2 * s)
            return max(upper, 0.0) ** (2 / 3) - 2 * GUIDE.preload ** (2 / 3) + lower ** (2 / 3)

        lower = brentq(balance, load / (2 * s), 8 * GUIDE.preload, xtol=1e-10)
        z = KAPPA * (lower ** (2 / 3) - GUIDE.preload ** (2 / 3)) / s
        assert force(z) == pytest.approx(load, rel=1e-9)


def test_lift_off_happens_at_the_load_of_eq_9() -> None:
    assert GUIDE.lift_off_load == pytest.approx(2520.0, rel=1e-12)
    assert force(GUIDE.lift_off_displacement) == pytest.approx(GUIDE.lift_off_load, rel=1e-12)
    assert GUIDE.lift_off_displacement == pytest.approx(4.0859e-6, rel=2e-5)


def test_past_lift_off_one_row_carries_the_load() -> None:
    """P = 2 P_L sin φ and eq. 5 give z = κ (P_L^(2/3) − P0^(2/3))/sin φ."""
    s, load = np.sin(GUIDE.contact_angle), 4000.0
    z = KAPPA * ((load / (2 * s)) ** (2 / 3) - 630.0 ** (2 / 3)) / s
    assert z == pytest.approx(7.033779e-6, rel=1e-6)
    assert force(z) == pytest.approx(load, rel=1e-12)
    assert force(-z) == pytest.approx(-load, rel=1e-12)


@pytest.mark.parametrize(("z", "load"), [(1e-6, 652.5126), (3e-6, 1912.695), (6e-6, 3455.364)])
def test_force_at_published_displacements(z: float, load: float) -> None:
    assert force(z) == pytest.approx(load, rel=1e-6)


@pytest.mark.parametrize(
    ("r", "gain"),
    [
        (0.25, 0.998027),
        (0.5, 0.991854),
        (1.0, 0.960337),
        (1.5, 0.902591),
        (2.0, 0.878742),
        (3.0, 0.881648),
        (5.0, 0.946836),
    ],
)
def test_gain_of_the_guide_about_its_centre(r: float, gain: float) -> None:
    assert centred_gain(np.array(r))[0] == pytest.approx(gain, abs=6e-7)


@pytest.mark.parametrize("r", [1e-3, 0.1, 0.7, 0.999, 1.0, 1.001, 1.7, 6.0, 100.0])
def test_gain_agrees_with_adaptive_quadrature(r: float) -> None:
    def rows(theta: float) -> float:
        x = r * np.cos(theta)
        return (max(1 + x, 0) ** 1.5 - max(1 - x, 0) ** 1.5) * np.cos(theta)

    kink = [float(np.arccos(-1 / r)), float(np.arccos(1 / r))] if r > 1 else None
    value = quad(rows, 0, np.pi, points=kink, epsabs=1e-14, epsrel=1e-13, limit=200)[0] * 2 / np.pi / (3 * r)
    # Near r = 0 the integrand is a difference of nearly equal powers: rounding over r.
    assert centred_gain(np.array(r))[0] == pytest.approx(value, rel=1e-11 + 1e-15 / r)


def test_gain_and_slope_are_continuous_through_lift_off() -> None:
    g, slope = centred_gain(np.array([1 - 1e-12, 1.0, 1 + 1e-12]))
    np.testing.assert_allclose(g, 32 * np.sqrt(2) / (15 * np.pi), rtol=1e-11)
    # g'' is logarithmic at lift-off: 1e-12·log(1e12) is far below this tolerance.
    np.testing.assert_allclose(slope, -4 * np.sqrt(2) / (15 * np.pi), rtol=1e-9)


def test_guide_softens_to_its_minimum_and_then_hardens() -> None:
    at = brentq(lambda r: float(centred_gain(np.array(r))[1]), 2.0, 3.0, xtol=1e-12)
    assert at == pytest.approx(2.384114, abs=1e-6)
    assert centred_gain(np.array(at))[0] == pytest.approx(0.874655, abs=1e-6)
    assert centred_gain(np.array(6.328869))[0] == pytest.approx(1.0, abs=1e-7)


def test_small_amplitudes_give_the_cubic_of_the_series() -> None:
    """P ≈ K0 z − K0 (sin φ/d0)² z³/24, so G falls by (3/4)/24 (A sin φ/d0)²."""
    r = 1e-3
    assert 1 - centred_gain(np.array(r))[0] == pytest.approx(r**2 / 32, rel=1e-5)


@pytest.mark.parametrize(
    ("bias", "amplitude", "mean", "gain"),
    [
        (1, 2, 641.583633, 643.344920),
        (1, 5, 562.564467, 605.325509),
        (3, 5, 1726.327596, 580.504436),
        (6, 1, 3461.735538, 513.730966),
    ],
)
def test_biased_describing_function(bias: float, amplitude: float, mean: float, gain: float) -> None:
    harmonic = GUIDE.first_harmonic(amplitude * 1e-6, 1.0, bias * 1e-6)
    assert harmonic.mean == pytest.approx(mean, abs=1e-6)
    assert harmonic.gain.real / 1e6 == pytest.approx(gain, abs=1e-6)


def test_mean_and_gain_of_a_bias_satisfy_their_reciprocity() -> None:
    """∂(A G)/∂z0 = 2 ∂N0/∂A for any memoryless force."""
    A, z0, h = 3e-6, 1.5e-6, 1e-10
    left = (GUIDE.first_harmonic(A, 1, z0 + h).gain - GUIDE.first_harmonic(A, 1, z0 - h).gain).real * A
    right = 2 * (GUIDE.first_harmonic(A + h, 1, z0).mean - GUIDE.first_harmonic(A - h, 1, z0).mean)
    assert left == pytest.approx(float(right), rel=1e-5)


def test_mean_force_of_one_row_grows_with_amplitude() -> None:
    mean = row_harmonics(np.array(1.0), np.array([0.5, 1.0, 2.0]))[1]
    np.testing.assert_allclose(mean, [1.0475, 1.2004, 1.8271], atol=5e-5)
