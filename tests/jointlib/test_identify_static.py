"""Preload and contact constant from a loading curve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.identification import fit_hertz
from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.rig.static import StaticRig, push_and_pull

TRUE = HertzGuide(630.0, 3.931408125e-8)


def implicit_deflection(load: float) -> float:
    """Deflection in m by solving the balance of the two ball rows for the lower one (eqs 5–7), no explicit law used."""
    sine, P0, kappa = np.sin(np.pi / 4), 630.0, 3.931408125e-8

    def closure(lower: float) -> float:
        upper = max(lower - load / (2 * sine), 0.0)
        return float(lower ** (2 / 3) + upper ** (2 / 3) - 2 * P0 ** (2 / 3))

    if load >= 4 * np.sqrt(2) * P0 * sine:
        lower = load / (2 * sine)
    else:
        lower = brentq(closure, load / (2 * sine), 10 * P0 + load, xtol=1e-12)
    return float((kappa * lower ** (2 / 3) - kappa * P0 ** (2 / 3)) / sine)


def test_fit_finds_the_guide_behind_the_implicit_equations() -> None:
    load = np.linspace(50, 4400, 60)
    fit = fit_hertz(np.array([implicit_deflection(p) for p in load]), load)
    assert fit.law.preload == pytest.approx(630, rel=1e-6)
    assert fit.law.kappa == pytest.approx(3.931408125e-8, rel=1e-6)
    assert fit.law.lift_off_load == pytest.approx(2520, rel=1e-6)
    assert fit.law.lift_off_displacement == pytest.approx(4.0859e-6, rel=1e-5)
    assert fit.rms < 1e-4


def test_reference_points_of_the_loading_curve() -> None:
    assert implicit_deflection(1500.0) == pytest.approx(2.326626e-6, rel=1e-6)
    assert implicit_deflection(4000.0) == pytest.approx(7.033779e-6, rel=1e-6)
    assert TRUE.force(np.array(2.326626e-6), np.array(0.0)) == pytest.approx(1500, rel=1e-6)


def test_true_values_lie_within_their_errors_over_many_tests() -> None:
    path, rig = push_and_pull(7.4e-6, 40), StaticRig(Joint((TRUE,)))
    t = np.empty((30, 2))
    for seed in range(30):
        z, f = rig.curve(np.random.default_rng(seed), path)
        fit = fit_hertz(z, f)
        miss = np.array([fit.law.preload - TRUE.preload, fit.law.kappa - TRUE.kappa])
        t[seed] = miss / np.sqrt(np.diag(fit.covariance.matrix))
        assert fit.correlation > 0.9
        # Load cell 15 N and 10 nm on 560 N/um of mean slope.
        assert fit.rms == pytest.approx(np.hypot(15, 5.6), rel=0.2)
    assert np.max(np.abs(t)) < 3.5
    # Two thirds within one error: 30 ± 2.6 draws of 30·0.683 = 20.5.
    assert np.all(np.abs(np.count_nonzero(np.abs(t) < 1, axis=0) - 20.5) < 8)
    assert float(np.prod(t, axis=1).sum() / np.sqrt(np.prod((t**2).sum(axis=0)))) > 0.9


def test_sweep_has_one_valley_at_the_preload() -> None:
    z, f = StaticRig(Joint((TRUE,))).curve(np.random.default_rng(4), push_and_pull(7.4e-6, 40))
    fit = fit_hertz(z, f)
    best = int(np.argmin(fit.rms_by_preload))
    assert fit.preloads[best] == pytest.approx(fit.law.preload, rel=0.05)
    assert np.all(np.diff(fit.rms_by_preload[: best + 1]) <= 1e-9)
    assert np.all(np.diff(fit.rms_by_preload[best:]) >= -1e-9)
    assert fit.rms <= fit.rms_by_preload[best]
    assert fit.resolved


def test_kappa_at_each_preload_is_the_least_squares_one() -> None:
    z, f = StaticRig(Joint((TRUE,))).curve(np.random.default_rng(4), push_and_pull(7.4e-6, 40))
    fit = fit_hertz(z, f)
    for k in (40, 80, 120):
        for factor in (0.999, 1.001):
            other = HertzGuide(fit.preloads[k], fit.kappas[k] * factor)
            rms = np.sqrt(np.mean((f - other.force(z, np.zeros_like(z))) ** 2))
            assert rms > fit.rms_by_preload[k]


def test_held_preload_leaves_kappa_alone_to_the_fit() -> None:
    z = push_and_pull(7.4e-6, 20)
    fit = fit_hertz(z, TRUE.force(z, np.zeros_like(z)), preload=630.0)
    assert fit.law.kappa == pytest.approx(TRUE.kappa, rel=1e-9)
    assert fit.covariance.names == ("kappa",)


def test_held_kappa_leaves_the_preload() -> None:
    z = push_and_pull(7.4e-6, 20)
    fit = fit_hertz(z, TRUE.force(z, np.zeros_like(z)), kappa=TRUE.kappa)
    assert fit.law.preload == pytest.approx(630, rel=1e-6)


def test_another_angle_gives_the_same_curve() -> None:
    z = push_and_pull(7.4e-6, 20)
    f = TRUE.force(z, np.zeros_like(z))
    steep = fit_hertz(z, f, contact_angle=np.radians(60)).law
    assert steep.force(z, np.zeros_like(z)) == pytest.approx(f, abs=1e-2)
    assert steep.preload * np.sin(np.radians(60)) == pytest.approx(630 * np.sin(np.pi / 4), rel=1e-5)


def test_straight_curve_does_not_tell_the_preload() -> None:
    z = np.linspace(-1e-7, 1e-7, 40)
    assert not fit_hertz(z, 600e6 * z).resolved


@pytest.mark.parametrize(
    ("z", "f", "word"),
    [
        (np.zeros(20), np.linspace(0, 1, 20), "deflection is zero"),
        (np.linspace(0, 1, 20), np.zeros(20), "load is zero"),
        (np.linspace(0, 1, 20), -np.linspace(0, 1, 20), "opposite signs"),
        (np.ones(3), np.ones(3), "3 points"),
    ],
)
def test_unusable_curves_are_refused(z: Array, f: Array, word: str) -> None:
    with pytest.raises(InputError, match=word):
        fit_hertz(z, f)
