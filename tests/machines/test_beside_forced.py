"""Joints that the teeth shake: what they are to a small line, and what becomes of chatter beside the forced motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.cubic import Cubic
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Machine, lobes_at_amplitude, read_machine
from machines.cutting.amplitude.amplitude_limits import amplitude_limits
from machines.cutting.amplitude.pocket import pocket
from machines.cutting.forced.advice import advice
from machines.cutting.forced.beside_forced import BesideForced, beside_forced
from machines.cutting.forced.forced_field import forced_field
from machines.cutting.forced.forced_vibration import forced_vibration
from machines.cutting.forced.shaken_limits import agreeing_limit, limits_beside, shaken_limit, shakes
from machines.lobes import Cutting

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
TOOTH = 2 * np.pi * 300.0
PATH = np.array([1e-7, 1.2e-6, 0.5e-6j])


def guide_mill(*more: JointLaw) -> Machine:
    """The guide as `jointlib run` mends it; or a spring and a damper in its place, and more."""
    laws = (HertzGuide(611.98356, 3.980787e-8, np.pi / 4), Viscous(481.67365), Jenkins(3.91397e7, 35.6987))
    guide = Joint((Linear(6e8), Viscous(480.0), *more) if more else laws, validity={"amplitude": (0.0, 4.6e-6)})
    return read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", guide)


def test_a_cubic_beside_a_forced_motion_has_its_closed_two_tone_gain() -> None:
    """k·(3⟨z_F²⟩ + ¾A²): the mean of the tangent along the forced motion, and the own share of the line."""
    law = BesideForced(Joint((Cubic(2e17),)), PATH, TOOTH, 2 * TOOTH)
    mean_square = 1e-14 + (1.2e-6**2 + 0.5e-6**2) / 2
    for A in (1e-8, 1e-6, 3e-6):
        expected = 2e17 * (3 * mean_square + 0.75 * A**2)
        assert law.gains(np.array(A), np.array(0.7 * TOOTH)) == pytest.approx(expected, rel=1e-6)
        assert law.first_harmonic(A, 0.7 * TOOTH).gain == pytest.approx(expected, rel=3e-3)


def test_elastic_slip_beside_a_forced_motion_answers_as_a_long_path_does() -> None:
    """The line's share of the force over 160 tooth periods, stepped as one path, by least squares."""
    slip = Jenkins(4e7, 36.0)
    law = BesideForced(Joint((slip,)), PATH, TOOTH, 4 * TOOTH)
    A, w = np.array([3e-7, 1.5e-6, 1.5e-6]), np.array([1.137, 1.137, 3.3719]) * TOOTH
    count, periods = 256, 160
    t = np.arange(count * periods) * 2 * np.pi / TOOTH / count
    forced = (np.exp(1j * TOOTH * t[:, None] * np.arange(3)) @ PATH).real
    z, slider, f = forced[:, None] + A * np.cos(t[:, None] * w), np.zeros((3, 1)), np.empty((len(t), 3))
    for i, place in enumerate(z):
        f[i], slider = slip.step(Motion(place, np.zeros(3)), slider)
    late, k = slice(len(t) // 5, None, 7), np.arange(1, 40) * TOOTH
    found = law.gains(A, w)
    for i in range(3):
        basis = np.exp(1j * t[late, None] * np.array([w[i], *k]))
        columns = np.concatenate([basis.real, -basis.imag, np.ones((len(basis), 1))], axis=1)
        share = np.linalg.lstsq(columns, f[late, i], rcond=None)[0]
        assert abs(found[i] - (share[0] + 1j * share[basis.shape[1]]) / A[i]) < 0.02 * slip.stiffness
    assert abs(found[0] - slip.first_harmonic(A[0], w[0]).gain) > 0.3 * slip.stiffness


def test_far_above_the_forced_motion_the_gain_is_that_of_the_law_alone() -> None:
    joint = Joint((Jenkins(4e7, 36.0),))
    law = BesideForced(joint, PATH, TOOTH, 4 * TOOTH)
    A = np.array([60.0, 200.0]) * law.size
    assert law.first_harmonic(A, TOOTH).gain == pytest.approx(joint.first_harmonic(A, TOOTH).gain, rel=1e-12)


@pytest.mark.slow
def test_chatter_beside_the_forced_motion_is_that_of_the_cut_in_time() -> None:
    """At 4300 rpm chatter settles at 1.63 µm in a cut of 1 mm in time, and at 3.41 µm if the teeth force nothing."""
    machine = guide_mill()
    assert shakes(machine)
    alone = float(lobes_at_amplitude(machine, [4300.0], 3.41e-6, "collocation").depth[0])
    assert alone == pytest.approx(1e-3, rel=0.02)
    assert (
        shaken_limit(machine, 4300.0, 1e-3, 0.95 * 1.63e-6) < 1e-3 < shaken_limit(machine, 4300.0, 1e-3, 1.05 * 1.63e-6)
    )
    assert shaken_limit(machine, 4300.0, 2e-3) > 2e-3


@pytest.mark.slow
def test_told_amplitudes_beside_the_forced_motion() -> None:
    """Settled amplitudes of a cut in time: 1.63, 0, 0 µm at 4300 rpm and 1, 2, 3 mm; 1.02, 0, 0 at 3700 and 2, 3, 5."""
    machine = guide_mill()
    limits = amplitude_limits(machine, [4300.0, 3700.0], np.geomspace(2e-7, 8e-6, 8), "collocation")
    for index, depth, settled in ((0, 1e-3, 1.63e-6), (0, 2e-3, 0), (0, 3e-3, 0), (1, 2e-3, 1.02e-6), (1, 3e-3, 0)):
        moved = beside_forced(machine, forced_vibration(machine, limits.speed[[index]], depth))
        beside = limits_beside(moved, limits, index)
        assert beside is not None
        stable = [cycle.amplitude for cycle in beside.cycles(depth) if cycle.stable]
        assert beside.starts_by_itself(depth) == bool(settled)
        assert stable == ([pytest.approx(settled, rel=0.05)] if settled else [])


@pytest.mark.slow
def test_the_agreeing_limit_persists_beside_its_own_forced_motion() -> None:
    machine = guide_mill()
    rest = float(lobes_at_amplitude(machine, [4175.0]).depth[0])
    found = agreeing_limit(machine, 4175.0, 0.0, rest)
    assert shaken_limit(machine, 4175.0, found) == pytest.approx(found, rel=1e-2)
    assert shaken_limit(machine, 4175.0, 0.5 * found) > 0.5 * found


def test_joints_that_are_springs_and_dampers_are_not_touched() -> None:
    machine = guide_mill(Viscous(1.0))
    assert beside_forced(machine, forced_vibration(machine, 4300.0, 1e-3)) is machine
    chart = lobes_at_amplitude(machine, [4000.0, 4300.0, 11727.0])
    field = forced_field(machine, chart, np.array([1e-3, 2e-3]))
    assert field is not None
    np.testing.assert_array_equal(field.limit, chart.depth)
    np.testing.assert_allclose(field.amplitude[:, 1], 2 * field.amplitude[:, 0], rtol=1e-12)
    assert field.words() == []


@pytest.mark.slow
def test_advice_tells_the_forced_motion_of_the_pocket_and_the_reason_of_the_change() -> None:
    machine = guide_mill()
    speeds = np.array([10440.0, 10455.0, 10470.0, 11500.0, 11600.0, 11727.0, 11800.0, 11900.0])
    charts = [(A, lobes_at_amplitude(machine, speeds, A)) for A in (0.0, 1e-5)]
    cutting = Cutting(**dict(machine.cutting or {}))
    best = pocket([chart for _, chart in charts], cutting)
    said = advice(charts, cutting, best, machine)
    assert any("There the tooth-passing vibration is " in line for line in said)
    assert any("the cut is stable at the speeds computed" in line for line in said)
    (last,) = [line for line in said if "dies out below" in line]
    assert "beside that of the teeth" in last
    assert "because the joints lose stiffness (" in last
    assert advice(charts, cutting, best)[-1].startswith("Below ")
