"""Lobes of a machine whose joint depends on amplitude: harmonic balance, a delay equation in time, limits, advice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from turning_lathe import CUBIC, DAMPING, MASS, SPEED, STIFFNESS, lathe

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Machine, lobes_at_amplitude, operating_point, read_machine, stability_lobes
from machines.cutting.amplitude.chattering_tool import operating_receptance
from machines.cutting.amplitude.frozen_modes import multipliers
from machines.cutting.forced.advice import advice
from machines.lobes import Cutting

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


@pytest.mark.parametrize(
    ("law", "amplitude", "depth", "chatter"),
    [
        (Cubic(CUBIC), 30e-6, 0.68847, 105.139),
        (Cubic(CUBIC), 60e-6, 0.66325, 105.894),
        (Cubic(-CUBIC), 30e-6, 0.71108, 104.665),
        (Cubic(-CUBIC), 60e-6, 0.75348, 103.999),
        (Coulomb(5.0), 30e-6, 0.89207, 105.706),
        (Coulomb(5.0), 60e-6, 0.79560, 105.322),
    ],
)
def test_depth_at_which_a_vibration_persists(law: JointLaw, amplitude: float, depth: float, chatter: float) -> None:
    """Figures of harmonic balance, which a simulation of the delay equation confirmed to 0.1 %."""
    chart = lobes_at_amplitude(lathe(law), [SPEED], amplitude)
    assert chart.depth[0] * 1e3 == pytest.approx(depth, rel=2e-5)
    assert chart.chatter_frequency[0] == pytest.approx(chatter, rel=1e-5)


def test_a_vibration_of_the_predicted_size_neither_grows_nor_dies() -> None:
    """The delay equation m ẍ + f(x, ẋ) = −K_s b (x − x(t − τ)) in time, hardening joint, 30 µm: an unstable cycle.

    A little below that amplitude the vibration dies out, a little above it grows.
    """
    amplitude = 30e-6
    chart = lobes_at_amplitude(lathe(Cubic(CUBIC)), [SPEED], amplitude)
    stiffness, chatter = 1e9 * chart.depth[0], 2 * np.pi * chart.chatter_frequency[0]
    steps = 800
    h = 60 / SPEED / steps

    def envelope(start: float) -> tuple[float, float]:
        history = start * np.cos(chatter * h * np.arange(-steps, 1))
        x, v = history[-1], 0.0
        path = list(history)
        for i in range(steps, 25 * steps):
            delayed = path[i - steps], 0.5 * (path[i - steps] + path[i - steps + 1]), path[i - steps + 1]

            def rate(x: float, v: float, late: float) -> tuple[float, float]:
                force = STIFFNESS * x + CUBIC * x**3 + DAMPING * v + stiffness * (x - late)
                return v, -force / MASS

            a1, b1 = rate(x, v, delayed[0])
            a2, b2 = rate(x + h / 2 * a1, v + h / 2 * b1, delayed[1])
            a3, b3 = rate(x + h / 2 * a2, v + h / 2 * b2, delayed[1])
            a4, b4 = rate(x + h * a3, v + h * b3, delayed[2])
            x, v = x + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), v + h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
            path.append(x)
        late = np.abs(path)
        return float(late[3 * steps : 6 * steps].max()), float(late[-3 * steps :].max())

    early, late = envelope(0.98 * amplitude)
    assert late < early
    early, late = envelope(1.02 * amplitude)
    assert late > early


def test_onset_is_the_linear_chart() -> None:
    chart = lobes_at_amplitude(lathe(Cubic(CUBIC)), [SPEED, 3000.0])
    linear = lobes_at_amplitude(lathe(), [SPEED, 3000.0], 50e-6)
    assert chart.depth[0] * 1e3 == pytest.approx(0.69920, rel=2e-5)
    # At an amplitude the receptance is interpolated between lines that are close to 1e-4.
    np.testing.assert_allclose(chart.depth, linear.depth, rtol=1e-5)


def test_published_depths_of_the_two_mode_tool_come_out_of_its_machine_file() -> None:
    chart = lobes_at_amplitude(
        read_machine(LIBRARY / "two_mode_tool.toml"), [6000, 9000, 12000, 15000, 20000], method="zero-order"
    )
    published = [1.945738, 1.116571, 4.033539, 1.957969, 1.134418]
    np.testing.assert_allclose(chart.depth * 1e3, published, rtol=1e-6)
    assert chart.minimum_depth * 1e3 == pytest.approx(1.0868291, rel=1e-6)
    assert chart.minimum_frequency == pytest.approx(632.978, rel=1e-6)


def mill(*more: JointLaw) -> Machine:
    guide = Joint((Linear(6e8), Viscous(480.0), *more))
    return read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", guide)


def test_in_milling_the_force_points_where_the_chatter_does() -> None:
    """The frozen receptance must be its own: with the force along its chattering eigenvector it comes out again."""
    machine = mill(Jenkins(4e7, 36.0))
    point = operating_receptance(machine, 6e-6)
    cutting = Cutting(**dict(machine.cutting or {}))
    at = np.searchsorted(point.frf.frequency, [200.0, 340.0, 355.0, 900.0, 1100.0])
    lines = point.frf.frequency[at]
    values, vectors = np.linalg.eig(cutting.mean_stiffness @ point.frf.receptance[at])
    first = np.argmin(values.real, axis=1)
    direction = vectors[np.arange(len(lines)), :, first]
    again = operating_point(machine, lines, 6e-6, direction)
    np.testing.assert_allclose(again.frf.receptance, point.frf.receptance[at], rtol=1e-4)


@pytest.mark.slow
def test_micro_slip_raises_the_limit_of_a_large_vibration() -> None:
    speeds = np.linspace(3300, 5000, 6)
    without = [lobes_at_amplitude(mill(), speeds, A).depth.min() for A in (0.0, 6e-6)]
    slipping = [lobes_at_amplitude(mill(Jenkins(4e7, 36.0)), speeds, A).depth.min() for A in (0.0, 6e-6)]
    assert without[1] == pytest.approx(without[0], rel=1e-4)
    assert slipping[1] > 3 * slipping[0]


@pytest.mark.thorough
def test_a_joint_beyond_its_range_is_said_where_the_chart_chatters() -> None:
    machine = mill(Jenkins(4e7, 36.0))
    joint = machine.joints()[0]
    narrow = machine.with_joint("guide", replace(joint, validity={"amplitude": (0.0, 1e-8), "frequency": (2e3, 2e4)}))
    chart = lobes_at_amplitude(narrow, np.linspace(3000, 6000, 12), 6e-6)
    assert any("held at its limit" in w for w in chart.warnings)
    assert any(w.startswith("guide: used from 100 to 1600 Hz, identified from 2000") for w in chart.warnings)


def test_ideal_friction_holds_a_joint_at_rest_so_that_nothing_starts() -> None:
    chart = lobes_at_amplitude(lathe(Coulomb(5.0)), [SPEED])
    assert chart.depth[0] == np.inf


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"cutting": None}, r"no \[cutting\]"),
        ({"tool": {"y": "slide.x"}}, r"\[tool\] has no x"),
        ({"tool": {}}, "tool"),
    ],
)
def test_what_lobes_need_is_asked_for(change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        lobes_at_amplitude(replace(lathe(), **change), [SPEED])  # type: ignore[arg-type]


def test_advice_tells_a_growing_limit_from_a_falling_one() -> None:
    speeds = np.array([SPEED])

    def said(law: JointLaw) -> tuple[str, ...]:
        charts = [(A, lobes_at_amplitude(lathe(law), speeds, A)) for A in (0.0, 60e-6)]
        return advice(charts, Cutting(**dict(lathe().cutting or {})), None)

    assert "dies out below 0.753 mm" in said(Cubic(-CUBIC))[1]
    assert "lasts from 0.663 mm on, below the 0.699 mm" in said(Cubic(CUBIC))[1]
    assert len(said(Cubic(1e-3 * CUBIC))) == 1


def test_a_receptance_at_an_amplitude_is_no_tangent() -> None:
    assert operating_receptance(mill(Jenkins(4e7, 36.0)), 6e-6).frf.kind.value == "frozen"
    assert operating_receptance(mill(Jenkins(4e7, 36.0)), 0.0).frf.kind.value == "tangent"
    assert operating_receptance(mill(), 6e-6).frf.kind.value == "linear"


def test_a_machine_and_its_own_receptance_give_one_chart() -> None:
    machine = mill()
    frf = operating_receptance(machine, 1e-6).frf
    cutting, speeds = Cutting(**dict(machine.cutting or {})), [4000.0, 5000.0]
    averaged = stability_lobes(frf, cutting, speeds, "zero-order", axes=("x", "y"))
    np.testing.assert_allclose(
        averaged.depth, lobes_at_amplitude(machine, speeds, method="zero-order").depth, rtol=2e-4
    )
    # The record ends close above the last mode, and says what that costs.
    direct = stability_lobes(frf, cutting, speeds, axes=("x", "y"))
    share = float(next(w for w in direct.warnings if "known from" in w).split("up to ")[1].split(" %")[0])
    exact = lobes_at_amplitude(machine, speeds).depth
    assert np.max(np.abs(direct.depth / exact - 1)) < 1e-2 * share
    np.testing.assert_allclose(lobes_at_amplitude(machine, speeds, 1e-6).depth, exact, rtol=2e-4)


def test_modes_with_frozen_joints_carry_the_multipliers() -> None:
    """At the depth that the collocation chart of an amplitude gives, a vibration neither grows nor dies."""
    machine = mill(Jenkins(4e7, 36.0))
    chart = lobes_at_amplitude(machine, [3473.0], 6e-6, "collocation")
    assert any("springs and dampers that they are at this amplitude" in w for w in chart.warnings)
    mu = multipliers(machine, 3473.0, float(chart.depth[0]) * np.array([0.999, 1.0, 1.001]), 6e-6)[0]
    assert mu[1] == pytest.approx(1.0, abs=1e-6)
    assert mu[0] < 1 < mu[2]
