"""Motion outside the band, and noise through a swinging tangent. All records simulated, by time integration."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from integrated_rig import LINEAR, M1, M2, M3, PEAK, Array, C, K, drive, integrated, observed
from rig_samples import PERIOD

from jointlib.effects.stribeck import StribeckFriction
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.loop.balance.bench import Raw, observe
from jointlib.loop.balance.equations import Observed
from jointlib.loop.balance.excess import force_of_modulation
from jointlib.loop.balance.unseen import passed_on, unseen_motion

SLIP, ROUNDING = 0.03 * K * PEAK, 5e-3
TRUE = Joint((*LINEAR, Coulomb(SLIP, ROUNDING)))
OVER = 4
"""Points of the integrated motion for a sample of the record."""


@cache
def motion() -> tuple[Array, Array]:
    """z and f over a period of the rig with dry friction, four points a sample."""

    def rate(y: Array) -> tuple[float, Array]:
        return K * y[0] + C * y[1] + SLIP * np.tanh(y[1] / ROUNDING), np.zeros(0)

    return integrated(drive(1.0), rate, 0)


def lines(x: Array) -> np.ndarray:
    """Peaks on the lines of the period that a record has."""
    return np.asarray(np.fft.rfft(x)[: PERIOD // 2 + 1] * 2 / len(x))


def rubbing(noise: float, seed: int = 5) -> Observed:
    """A record of that motion."""
    P, f = drive(1.0), lines(motion()[1])
    return observed(P, np.asarray((P - f) / M1), f, seed, noise)


def raw(o: Observed) -> Raw:
    return Raw(o.spectra, o.floor, o.rig, o.band)


@pytest.mark.slow
def test_friction_moves_the_joint_outside_the_band_as_time_integration_says() -> None:
    o = rubbing(1e-4)
    found = unseen_motion(o, TRUE)
    assert found is not None
    n = OVER * PERIOD
    true = np.fft.rfft(motion()[0])
    f = np.arange(len(true)) * 100.0
    for inside in ((f > 0) & (f < 2e3), (f > 20e3) & (f < 60e3)):
        size = np.linalg.norm(true[inside]) / n
        error = np.linalg.norm(found[inside] - true[inside]) / n
        assert size > 1e-6 * PEAK
        assert error < 0.1 * size  # the second round leaves the square of what the first moved


@pytest.mark.slow
def test_nothing_is_added_where_z_is_measured() -> None:
    o = rubbing(1e-4)
    found = unseen_motion(o, TRUE)
    assert found is not None
    on = found[1 : o.on_period.sum() + 1]
    assert not on[o.kept[o.on_period]].any()
    assert found[0] == 0


@pytest.mark.thorough
def test_a_linear_joint_moves_nowhere_else() -> None:
    assert unseen_motion(rubbing(1e-4), Joint(LINEAR)) is None


@pytest.mark.thorough
def test_without_a_driven_mass_nothing_can_be_told() -> None:
    o = rubbing(1e-4)
    blind = replace(o, rig=replace(o.rig, m1=None))
    assert unseen_motion(blind, TRUE) is None


def test_the_true_law_reaches_its_noise_only_with_the_motion_that_is_not_measured() -> None:
    o = observe(raw(rubbing(1e-4)), TRUE)
    without = replace(o, unseen=None, passed_on=None, _forces={})
    left, more = (np.sum(np.abs(x.whitened(TRUE)[x.valid[:, 2], 2]) ** 2) / x.valid[:, 2].sum() for x in (o, without))
    assert left < 1.3
    assert more > 3 * left


def test_the_tangent_of_friction_passes_noise_of_the_speed_on_as_many_drawn_noises_show() -> None:
    noise = 5e-3
    o = rubbing(noise)
    told = passed_on(o, TRUE)
    assert told is not None
    law = TRUE.laws[-1]
    assert isinstance(law, Coulomb)
    z, v, _ = o.path
    rng = np.random.default_rng(1)
    size = np.where(o.kept & o.on_period, np.sqrt(o.displacement_noise), 0)
    g = law.slopes(z, v)[1]
    powers = []
    for _ in range(200):
        drawn = size * (rng.standard_normal(len(size)) + 1j * rng.standard_normal(len(size))) / np.sqrt(2)
        moved = replace(o, unseen=spread(o, drawn))
        # The mean of the tangent belongs to the linear part of the covariance.
        F = o.lines_of((g - g.mean()) * (moved.path[1] - v))
        powers.append(np.abs(F) ** 2)
    drawn_power = np.mean(powers, axis=0)[o.on_period]
    assert np.sum(told[o.on_period]) == pytest.approx(np.sum(drawn_power), rel=0.05)
    band = drawn_power > 0.1 * drawn_power.max()
    np.testing.assert_allclose(told[o.on_period][band], drawn_power[band], rtol=0.5)  # 200 draws: 7 %, and 5 sigma


def spread(o: Observed, Z: np.ndarray) -> np.ndarray:
    """Lines of a record on the oversampled period."""
    out = np.zeros(OVER * PERIOD // 2 + 1, dtype=complex)
    out[1 : o.on_period.sum() + 1] = Z[o.on_period] * OVER / o.spectra.periods
    return out


def test_a_modulation_is_felt_as_both_bodies_yield_to_it() -> None:
    o = rubbing(1e-4)
    E = np.exp(1j * np.arange(len(o.frequency)))
    felt = force_of_modulation(replace(o, extra=E))
    assert not force_of_modulation(o).any()
    for i in (20, 400, 700):
        w = o.omega[i]
        D = K + 1j * w * C
        # m1 x1'' = -(D z + E), M x2'' = D z + E, z = x1 - x2.
        S = np.array([[D - M1 * w**2, -D], [-D, D - (M2 + M3) * w**2]])
        x1, x2 = np.linalg.solve(S, [-E[i], E[i]])
        assert felt[i] == pytest.approx(D * (x1 - x2) + E[i], rel=1e-9)


def test_a_law_whose_tangent_stands_still_passes_on_no_more_than_its_linear_part() -> None:
    o = rubbing(1e-4)
    assert passed_on(o, Joint(LINEAR)) is None
    weak, strong = (passed_on(o, Joint((*LINEAR, Cubic(s * K / PEAK**2)))) for s in (0.01, 0.1))
    assert weak is not None
    assert strong is not None
    np.testing.assert_allclose(strong[o.on_period], 100 * weak[o.on_period], rtol=1e-9)


def test_a_bump_narrower_than_the_rounding_at_zero_speed_is_no_stribeck_friction() -> None:
    effect, joint = StribeckFriction(), Joint(LINEAR)
    v = np.linspace(0, 0.1, 2000)
    for bump, named in ((4e-3, False), (20e-3, True)):
        shape = {"smoothing_velocity": 5e-3, "stribeck_velocity": bump}
        force = (1 + 0.4 * np.exp(-((v / bump) ** 2))) * np.tanh(v / 5e-3)
        assert (np.diff(force).min() < -1e-3 * force.max() / len(v)) == named
        assert (effect.apply(np.array([1.0, 0.4]), shape, joint) is not None) == named
