"""Restoring force, damping and parameters from the accelerations of a shaken rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rig_samples import GUIDE, RATE, measurement, noisy, record, shaken

from jointlib.errors import InputError
from jointlib.identification import restoring_force, viscous_damping
from jointlib.identification.estimate import Estimate, estimate
from jointlib.identification.force_balance import balance_of
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins
from jointlib.measurement import Mass, Record

FREE = ("hertz_guide.preload", "hertz_guide.kappa", "viscous.damping")
ROUGH = GUIDE.with_parameters({"hertz_guide.preload": 450.0, "hertz_guide.kappa": 4.4e-8, "viscous.damping": 250.0})


def clean(level: int = 1) -> Record:
    steady = shaken()
    return record({name: value[:, level] for name, value in steady.channels.items()}, f"r{level}.npz")


def fit(records: list[Record], joint: Joint = ROUGH, free: tuple[str, ...] = FREE) -> Estimate:
    m = measurement()
    return estimate(joint, tuple(balance_of(restoring_force(m, r)) for r in records), free)


@pytest.mark.thorough
def test_accelerations_give_back_motion_and_force() -> None:
    surface, steady = restoring_force(measurement(band=(1e3, 40e3)), clean()), shaken()
    for found, true in (
        (surface.z, steady.displacement),
        (surface.v, steady.velocity),
        (surface.f, steady.joint_force),
    ):
        # The rest is the integrator's own error between z and its acceleration.
        assert np.max(np.abs(found - true[:, 1])) < 1e-3 * np.max(np.abs(true[:, 1]))
        assert abs(found.mean()) < 1e-12 * np.max(np.abs(found))


def test_shaker_side_gives_the_same_force() -> None:
    m, one = measurement(), clean()
    riding, driven = restoring_force(m, one), restoring_force(m, one, from_shaker=True)
    assert driven.f == pytest.approx(riding.f, abs=1e-9 * np.max(np.abs(riding.f)))


def test_two_accelerometers_are_enough() -> None:
    m, one = measurement(), clean()
    two = replace(m, channels=tuple(c for c in m.channels if c.name != "a3"))
    fewer = replace(one, channels={k: v for k, v in one.channels.items() if k != "a3"})
    assert restoring_force(two, fewer).f == pytest.approx(restoring_force(m, one).f, rel=1e-12)


def test_offset_and_slow_drift_of_a_sensor_leave_no_trace() -> None:
    m, one = measurement(), clean()
    t = np.arange(len(one)) / RATE
    bent = {**one.channels, "a1": one.channels["a1"] + 5.0 + 30 * np.sin(2 * np.pi * 100 * t)}
    assert restoring_force(m, replace(one, channels=bent)).z == pytest.approx(
        restoring_force(m, one).z, abs=1e-6 * np.max(np.abs(restoring_force(m, one).z))
    )


def test_single_burst_does_not_drift() -> None:
    n = 40960
    t = np.arange(n) / RATE
    swell = 2e-6 * (1 + 0.8 * np.cos(2 * np.pi * 7.3 * t + 1))
    rate = -2e-6 * 0.8 * 2 * np.pi * 7.3 * np.sin(2 * np.pi * 7.3 * t + 1)
    curve = -2e-6 * 0.8 * (2 * np.pi * 7.3) ** 2 * np.cos(2 * np.pi * 7.3 * t + 1)
    w = 2 * np.pi * 4803.7
    z = swell * np.sin(w * t)
    v = rate * np.sin(w * t) + swell * w * np.cos(w * t)
    a = curve * np.sin(w * t) + 2 * rate * w * np.cos(w * t) - swell * w**2 * np.sin(w * t)
    sensor = a + 0.5 + 2.0 * t
    one = record({"a1": sensor, "a2": 0.001 * a, "a3": 0.001 * a, "P": a}, period=None)
    surface = restoring_force(measurement(), one)
    inside = surface.inside
    assert surface.z[inside] == pytest.approx(0.999 * z[inside], abs=4e-9)
    assert surface.v[inside] == pytest.approx(0.999 * v[inside], abs=1e-3 * np.max(np.abs(v)))
    # Summing the samples twice instead carries the motion off by far more than its own size.
    walked = np.cumsum(np.cumsum(sensor)) / RATE**2
    assert np.max(np.abs(walked)) > 100 * np.max(np.abs(z))


def test_settling_periods_and_rest_are_dropped() -> None:
    m, one = measurement(settle=2), clean()
    disturbed = {k: np.concatenate([7 * v, -3 * v, v, v, v[:100]]) for k, v in one.channels.items()}
    found = restoring_force(m, record(disturbed))
    assert found.f == pytest.approx(restoring_force(measurement(), one).f, abs=1e-9 * np.max(np.abs(found.f)))


def test_a_heavier_body_takes_more_force() -> None:
    plain = restoring_force(measurement(), clean())
    mended = measurement(bodies={"runner": Mass(0.942), "rail": Mass(1.1), "block": Mass(1.21)})
    assert restoring_force(mended, clean()).f == pytest.approx(1.05 * plain.f, rel=1e-9)


def test_damping_is_the_force_projected_on_the_velocity() -> None:
    surface = restoring_force(measurement(), clean())
    guide = Joint(GUIDE.laws[:1])
    bare, peeled = viscous_damping(surface), viscous_damping(surface, guide)
    assert bare.damping == pytest.approx(float(np.sum(surface.f * surface.v) / np.sum(surface.v**2)))
    assert bare.damping == pytest.approx(480, rel=2e-3)
    assert peeled.damping == pytest.approx(480, rel=2e-3)
    assert peeled.standard_error < bare.standard_error
    assert viscous_damping(replace(surface, v=-surface.v)).damping < 0


def test_noise_free_rig_gives_its_parameters_back() -> None:
    found = fit([clean(0), clean(1)]).joint.parameters
    # What is left is the difference between z and its twice integrated acceleration, of fourth order in the step.
    for name in FREE:
        assert found[name] == pytest.approx(GUIDE.parameters[name], rel=1e-4)


def test_exact_motion_gives_parameters_to_rounding() -> None:
    surface = restoring_force(measurement(), clean())
    exact = replace(surface, f=surface.filtered(GUIDE.force_along(surface.z, surface.v)))
    found = estimate(ROUGH, (balance_of(exact),), FREE).joint.parameters
    for name in FREE:
        assert found[name] == pytest.approx(GUIDE.parameters[name], rel=1e-6)


def test_true_values_lie_within_their_errors_over_many_noises() -> None:
    steady, still = shaken(), fit([clean(0), clean(1)]).joint.parameters
    truth = np.array([still[n] for n in FREE])
    t = np.empty((30, len(FREE)))
    for seed in range(30):
        found = fit(noisy(steady, seed, snr=50.0), GUIDE)
        values = np.array([found.joint.parameters[n] for n in FREE])
        t[seed] = (values - truth) / np.array([found.covariance.standard_error(n) for n in FREE])
    assert np.max(np.abs(t)) < 4
    assert np.all(np.abs(np.count_nonzero(np.abs(t) < 1, axis=0) - 20.5) < 9)


def test_slider_is_fitted_along_its_loop() -> None:
    joint = Joint((*GUIDE.laws, Jenkins(4e7, 30.0)))
    surface = restoring_force(measurement(), clean())
    lap = [np.tile(x, 2) for x in (surface.z, surface.v)]
    force = joint.force_along(lap[0], lap[1], 1 / RATE)[len(surface.z) :]
    exact = replace(surface, f=surface.filtered(force))
    rough = joint.with_parameters({"jenkins.stiffness": 2.5e7, "jenkins.slip_force": 20.0, "viscous.damping": 600.0})
    free = ("viscous.damping", "jenkins.stiffness", "jenkins.slip_force")
    found = estimate(rough, (balance_of(exact),), free).joint.parameters
    for name in free:
        assert found[name] == pytest.approx(joint.parameters[name], rel=1e-4)


def test_silent_channel_short_record_and_unknown_mass_are_refused() -> None:
    m, one = measurement(), clean()
    silent = replace(one, channels={**one.channels, "a1": np.zeros(len(one))})
    with pytest.raises(InputError, match="'a1' is zero throughout"):
        restoring_force(m, silent)
    with pytest.raises(InputError, match="at least one whole period"):
        restoring_force(measurement(settle=1), one)
    with pytest.raises(InputError, match="mass of 'rail' is unknown"):
        restoring_force(measurement(bodies={**m.bodies, "rail": Mass(None)}), one)
    with pytest.raises(InputError, match="'rail' is held to ground"):
        restoring_force(measurement(bodies={**m.bodies, "rail": Mass(1.1, 0.0, 1e5)}), one)
    with pytest.raises(InputError, match="cycles of the lowest frequency"):
        restoring_force(m, record({k: v[:500] for k, v in one.channels.items()}, period=None))
    without = replace(one, channels={k: v for k, v in one.channels.items() if k != "P"})
    with pytest.raises(InputError, match="no channel 'P'"):
        restoring_force(m, without, from_shaker=True)
