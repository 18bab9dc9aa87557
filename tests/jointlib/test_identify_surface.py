"""Two-dimensional Chebyshev fit and the choice of its order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rig_samples import measurement, record, shaken

from jointlib.errors import InputError
from jointlib.identification import RestoringForce, fit_surface, restoring_force
from jointlib.identification.force_balance import balance_of
from jointlib.laws.polynomial import Polynomial

TRUE = Polynomial(((0.0, 463.0), (654e6, 0.0), (0.0, -2e13), (-1.7e18, 0.0)))
"""Order (3, 1): a softening spring with a damping that depends on displacement."""


def surfaces(noise: float, seed: int = 0) -> list[RestoringForce]:
    """The rig's motion with the force of the true surface and white noise (N) on top."""
    steady, rng = shaken(), np.random.default_rng(seed)
    out = []
    for k in range(2):
        one = restoring_force(measurement(), record({c: v[:, k] for c, v in steady.channels.items()}))
        force = TRUE.force(one.z, one.v) + noise * rng.standard_normal(len(one.z))
        out.append(replace(one, f=one.filtered(force)))
    return out


@pytest.mark.thorough
def test_given_order_returns_the_surface() -> None:
    fit = fit_surface(tuple(balance_of(s) for s in surfaces(0.0)), (3, 1))
    table, _ = fit.polynomial()
    z, v = surfaces(0.0)[1].z, surfaces(0.0)[1].v
    assert table.force(z, v) == pytest.approx(TRUE.force(z, v), abs=1e-6 * np.max(TRUE.force(z, v)))
    assert np.array(table.coefficients)[3, 0] == pytest.approx(-1.7e18, rel=1e-6)
    assert np.array(table.coefficients)[2, 1] == pytest.approx(-2e13, rel=1e-6)
    assert max(fit.rms) < 1e-6
    assert not fit.mean_seen
    assert fit.law.force(np.array(0.0), np.array(0.0)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("noise", [0.0, 0.5, 5.0, 20.0])
def test_order_follows_the_surface_and_not_the_noise(noise: float) -> None:
    for seed in range(4):
        fit = fit_surface(tuple(balance_of(s) for s in surfaces(noise, seed)))
        order = tuple(n - 1 for n in np.shape(fit.law.coefficients))
        assert order == (3, 1) if noise < 20 else order <= (3, 1)
        held_out = {trial.order: trial.held_out for trial in fit.trials}
        assert held_out[7, 3] >= held_out[3, 1] * (1 if noise else 0)


def test_coefficients_lie_within_their_errors() -> None:
    truth = np.ravel(fit_surface(tuple(balance_of(s) for s in surfaces(0.0)), (3, 1)).law.coefficients)
    t = []
    for seed in range(30):
        fit = fit_surface(tuple(balance_of(s) for s in surfaces(3.0, seed)), (3, 1))
        t.append((np.ravel(fit.law.coefficients) - truth)[1:] / np.sqrt(np.diag(fit.covariance))[1:])
    assert np.max(np.abs(t)) < 4.5
    assert np.mean(np.abs(t) < 1) == pytest.approx(0.68, abs=0.1)


def test_change_of_basis_carries_the_covariance() -> None:
    fit = fit_surface(tuple(balance_of(s) for s in surfaces(3.0)), (3, 1))
    table, matrix = fit.polynomial()
    z, v = 1e-6, 0.05
    by_power = np.ravel([[z**i * v**j for j in range(2)] for i in range(4)])
    scaled = np.polynomial.chebyshev.chebvander2d(z / fit.law.displacement_scale, v / fit.law.velocity_scale, [3, 1])
    assert table.force(np.array(z), np.array(v)) == pytest.approx(fit.law.force(np.array(z), np.array(v)))
    assert by_power @ matrix @ by_power == pytest.approx(np.ravel(scaled) @ fit.covariance @ np.ravel(scaled))


def test_more_coefficients_than_data_are_refused() -> None:
    one = surfaces(0.0)[0]
    few = replace(one, gain=one.gain * (np.arange(len(one.gain)) < 30))
    with pytest.raises(InputError, match="more data"):
        fit_surface((balance_of(few),), (7, 3))
