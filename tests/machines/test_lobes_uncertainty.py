"""Bands from samples: against error propagation, repeatability, bounds, and a published band of depths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from jointlib.errors import InputError
from jointlib.frf import FRF
from jointlib.joint import Covariance, Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Measured, lobes_at_amplitude
from machines.lobes import Cutting, stability_lobes
from machines.uncertainty.drawn_machines import draws, refuse_too_many, sampled_joint, sampled_machines
from machines.uncertainty.lobe_bands import frf_band, lobe_band, measured_lobe_band, sampled_depths

MASS, STIFFNESS, DAMPING = 25.0, 1e7, 950.0
HALF_UP = Cutting("milling", teeth=3, tangential=6e8, normal=0.07 * 6e8, mode="up", immersion=0.5)
MODES = np.array([[603.0, 0.039, 5.59e6], [666.0, 0.035, 5.715e6]])


def lathe(deviation: tuple[float, float] | None) -> Machine:
    names = ("linear.stiffness", "viscous.damping")
    covariance = None if deviation is None else Covariance(names, np.diag(np.square(deviation)))
    joint = Joint((Linear(STIFFNESS), Viscous(DAMPING)), covariance=covariance)
    return Machine(
        (Lumped("slide", ("x",), np.array([[MASS]])),),
        (Connection("guide", ("slide.x", "ground"), joint),),
        tool={"x": "slide.x"},
        frequency=(60.0, 200.0),
        cutting={"process": "turning", "specific": 1e9},
    )


def two_modes(modes: Array, f: Array) -> ComplexArray:
    """G of one mode in x and one in y from (natural frequency, damping ratio, stiffness), (…, 2, 3)."""
    fn, zeta, k = (modes[..., None, :, i] for i in range(3))
    r = f[:, None] / fn
    G = 1 / (k * (1 - r**2 + 2j * zeta * r))
    return np.asarray(G[..., None] * np.eye(2))


def test_two_percent_on_the_modes_is_a_factor_of_two_on_the_depth() -> None:
    """±2 % (1σ) on f_n, ζ, k: about 2.8 – 3.9 – 6.3 mm published; read from a figure, so to 6 %."""
    lines = np.arange(400.0, 1000.0, 1.5)
    modes = MODES * (1 + 0.02 * draws("modes", 1000, 6).reshape(1000, 2, 3))
    depth = sampled_depths(two_modes(modes, lines), lines, HALF_UP, 12000.0, ("x", "y"))[:, 0]
    np.testing.assert_allclose(np.quantile(depth, (0.025, 0.5, 0.975)) * 1e3, [2.8, 3.9, 6.3], rtol=0.06)


def test_many_charts_at_once_are_the_charts_one_by_one() -> None:
    lines, speeds = np.arange(400.0, 1000.0, 1.0), np.linspace(5000, 25000, 60)
    modes = MODES * (1 + 0.02 * draws("modes", 4, 6).reshape(4, 2, 3))
    together = sampled_depths(two_modes(modes, lines), lines, HALF_UP, speeds, ("x", "y"))
    for depth, own in zip(together, modes, strict=True):

        def tool(f: Array, own: Array = own) -> ComplexArray:
            return two_modes(own, f)

        alone = stability_lobes(tool, HALF_UP, speeds, "zero-order", frequency=lines)
        np.testing.assert_allclose(depth, alone.depth, rtol=1e-3)


@pytest.mark.slow
def test_small_errors_of_a_joint_propagate_linearly() -> None:
    """The lowest depth of one mode is 2kζ(1+ζ)/Ks; at a fixed speed the slope over k and c is taken by differences."""
    deviation = (1e-3 * STIFFNESS, 1e-2 * DAMPING)
    band = lobe_band(lathe(deviation), [2350.0], count=400)

    def depth(k: float, c: float) -> float:
        machine = lathe(None).with_joint("guide", Joint((Linear(k), Viscous(c))))
        return float(lobes_at_amplitude(machine, [2350.0]).depth[0])

    by_k = depth(STIFFNESS + deviation[0], DAMPING) - depth(STIFFNESS - deviation[0], DAMPING)
    by_c = depth(STIFFNESS, DAMPING + deviation[1]) - depth(STIFFNESS, DAMPING - deviation[1])
    expected = np.hypot(by_k, by_c) / 2
    # The error of a standard deviation from 400 samples is 3.5 %.
    assert np.std(band.samples[:, 0]) == pytest.approx(expected, rel=0.1)
    assert band.quantiles[1, 0] == pytest.approx(depth(STIFFNESS, DAMPING), abs=0.2 * expected)


@pytest.mark.thorough
def test_receptance_below_resonance_is_as_uncertain_as_the_stiffness() -> None:
    band = frf_band(lathe((0.02 * STIFFNESS, 0.0)), [1.0], count=1000)
    low, _, high = band.quantiles[:, 0, 0, 0]
    assert (high - low) * STIFFNESS == pytest.approx(2 * 1.96 * 0.02, rel=0.1)


@pytest.mark.thorough
def test_the_same_numbers_stand_behind_every_speed_and_design() -> None:
    machine = lathe((0.01 * STIFFNESS, 0.05 * DAMPING))
    one, other = (lobe_band(machine, s, count=50).samples for s in ([2350.0], [2000.0, 2350.0]))
    np.testing.assert_array_equal(one[:, 0], other[:, 1])
    np.testing.assert_array_equal(draws("guide", 10, 2), draws("guide", 30, 2)[:10])
    assert not np.any(draws("guide", 5, 2) == draws("nut", 5, 2))
    assert not np.any(draws("guide", 5, 2) == draws("guide", 5, 2, seed=1))


def test_correlated_parameters_are_sampled_together() -> None:
    names = ("linear.stiffness", "viscous.damping")
    deviation, correlation = np.array([1e5, 50.0]), np.array([[1.0, -0.9], [-0.9, 1.0]])
    joint = Joint(
        (Linear(STIFFNESS), Viscous(DAMPING)),
        covariance=Covariance(names, correlation * np.outer(deviation, deviation)),
        validity={"amplitude": (0.0, 1e-5)},
    )
    joints, clipped = sampled_joint(joint, "guide", 4000)
    values = np.array([[j.parameters[n] for n in names] for j in joints])
    np.testing.assert_allclose(values.std(axis=0), deviation, rtol=0.05)
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(-0.9, abs=0.02)
    assert clipped == 0
    assert joints[0].validity == joint.validity


def test_a_sampled_damping_below_nothing_is_set_to_nothing_and_counted() -> None:
    _, clipped = sampled_machines(lathe((0.0, 2 * DAMPING)), 1000)
    # Φ(−1/2) of the samples.
    assert clipped == pytest.approx(309, abs=60)


def measured(deviation: float) -> FRF:
    lines = np.arange(60.0, 200.0, 0.5)
    omega = 2 * np.pi * lines
    G = (1 / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING))[:, None, None]
    return FRF(lines, G, ("t.x",), ("t.x",), variance=np.full(G.shape, deviation**2))


def test_the_variance_of_a_measured_frf_is_carried_into_the_lobes() -> None:
    cut = Cutting("turning", specific=1e9)
    wide, narrow = (measured_lobe_band(measured(s), cut, [2350.0], ("x",), 300) for s in (4e-9, 1e-9))
    spread = [float(np.ptp(band.quantiles[:, 0])) for band in (wide, narrow)]
    assert spread[0] == pytest.approx(4 * spread[1], rel=0.3)
    exact = float(lobes_at_amplitude(lathe(None), [2350.0]).depth[0])
    assert narrow.quantiles[1, 0] == pytest.approx(exact, rel=0.02)


def test_the_band_of_a_noisy_record_has_the_noise_of_the_lines_that_its_chart_has() -> None:
    f, rng = np.arange(100.0, 6000.0, 2.0), np.random.default_rng(1)
    G = two_modes(MODES, f)
    noise = 0.004 * np.abs(G) / np.sqrt(2) * (rng.standard_normal(G.shape) + 1j * rng.standard_normal(G.shape))
    part = Measured(
        "tool", ("x", "y"), f, G + noise * np.eye(2), variance=(0.004 * np.abs(G)) ** 2, interpolation="rational"
    )
    keys = ("process", "teeth", "tangential", "normal", "mode", "immersion")
    cutting = {key: getattr(HALF_UP, key) for key in keys}
    machine = Machine((part,), tool={"x": "tool.x", "y": "tool.y"}, cutting=cutting)
    speeds = np.array([7000.0, 9000.0, 12000.0])
    band = lobe_band(machine, speeds, count=40, method="zero-order")
    one_by_one = [lobes_at_amplitude(m, speeds, 0.0, "zero-order").depth for m in sampled_machines(machine, 40)[0][:12]]
    # Straight between the lines for rational there: they differ by as much as the lines are noisy.
    np.testing.assert_allclose(band.samples[:12], one_by_one, rtol=1e-2)


def test_noise_of_a_measured_component_has_its_variance_and_its_symmetry() -> None:
    lines = np.array([50.0, 60.0])
    value = np.tile(np.array([[2.0, 1.0], [1.0, 3.0]]) * 1e-8, (2, 1, 1)).astype(complex)
    part = Measured("base", ("a", "b"), lines, value, variance=np.full((2, 2, 2), 1e-20))
    machines, _ = sampled_machines(Machine((part,)), 3000)
    errors = np.array([m.components[0].value - value for m in machines])  # type: ignore[attr-defined]
    np.testing.assert_allclose(np.mean(np.abs(errors) ** 2, axis=0), 1e-20, rtol=0.1)
    np.testing.assert_array_equal(errors[:, :, 0, 1], errors[:, :, 1, 0])


def test_more_samples_than_fit_into_memory_are_refused_before_one_is_drawn() -> None:
    machine = lathe((1e5, 9.5))
    refuse_too_many(machine, 1000)
    with pytest.raises(InputError, match=r"--samples: 1000000000 samples of 0 measured .* would take .*--limit"):
        refuse_too_many(machine, 10**9)
    with pytest.raises(InputError, match="--samples: 39, expected at least 40"):
        refuse_too_many(machine, 39)


def test_where_nothing_is_uncertain_no_band_is_made() -> None:
    with pytest.raises(InputError, match="nothing to sample"):
        lobe_band(lathe(None), [2350.0])
    bare, cut = replace(measured(1e-9), variance=None), Cutting("turning", specific=1e9)
    with pytest.raises(InputError, match="no variance"):
        measured_lobe_band(bare, cut, [2350.0], ("x",))
