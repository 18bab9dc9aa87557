"""The modes that the tool feels decide where chatter is looked for, not the band that somebody typed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, lobes_at_amplitude, read_machine
from machines.components.measured import Measured
from machines.cutting.amplitude.chattering_tool import operating_receptance
from machines.tool.chatter_band import _natural, chatter_band, frequency_range

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
TURNING = {"process": "turning", "specific": 1e9}


def spring_mass(frequency: tuple[float, float] | None, stiffness: float = 1e7) -> Machine:
    """One mode at 100 Hz with a damping ratio of 3 %."""
    joint = Joint((Linear(stiffness), Viscous(954.9)))
    return Machine(
        (Lumped("slide", ("x",), np.array([[25.33]])),),
        (Connection("guide", ("slide.x", "ground"), joint),),
        tool={"x": "slide.x"},
        frequency=frequency,
        cutting=TURNING,
    )


def test_without_a_band_it_runs_from_a_third_of_the_lowest_to_three_times_the_highest_mode() -> None:
    machine = spring_mass(None)
    natural = np.sqrt(1e7 / 25.33) / (2 * np.pi)
    assert frequency_range(machine) == pytest.approx((natural / 3, 3 * natural), rel=1e-9)
    assert chatter_band(machine).felt == pytest.approx([natural], rel=1e-9)
    assert "No frequency in [response]" in chatter_band(machine).said[0]


def test_a_machine_without_a_tool_has_the_band_of_all_its_modes() -> None:
    natural = np.sqrt(1e7 / 25.33) / (2 * np.pi)
    assert frequency_range(replace(spring_mass(None), tool={})) == pytest.approx((natural / 3, 3 * natural), rel=1e-3)


@pytest.mark.parametrize("band", [(10.0, 60.0), (300.0, 900.0), (60.0, 99.0)])
def test_a_band_that_leaves_the_mode_out_is_widened_and_said(band: tuple[float, float]) -> None:
    found = chatter_band(spring_mass(band))
    assert found.low < 100 < found.high
    assert "cuts off modes of the tool" in found.said[0]
    chart = lobes_at_amplitude(spring_mass(band), [2350.0])
    assert chart.depth[0] == pytest.approx(lobes_at_amplitude(spring_mass((30.0, 300.0)), [2350.0]).depth[0], rel=1e-9)
    assert set(found.said) <= set(chart.warnings)


def test_a_band_that_holds_the_modes_stays_as_it_is() -> None:
    found = chatter_band(spring_mass((60.0, 200.0)))
    assert (found.low, found.high, found.said) == (60.0, 200.0, ())


def test_the_band_holds_at_an_amplitude_too() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    machine = replace(machine, cutting=TURNING, frequency=(1000.0, 1100.0))
    lines = operating_receptance(machine, 1e-6).frf.frequency
    assert lines[-1] > 5000


def test_of_a_measured_part_nothing_is_claimed_beyond_its_record() -> None:
    f = np.linspace(20.0, 400.0, 2000)
    s = 2j * np.pi * f
    H = 1 / (25.33 * s**2 + 954.9 * s + 1e7)
    part = Measured("tool", ("x",), f, H[:, None, None], interpolation="rational")
    machine = Machine((part,), tool={"x": "tool.x"}, cutting=TURNING)
    band = chatter_band(machine)
    assert (band.low, band.high, band.whole) == (20.0, 400.0, False)
    chart = lobes_at_amplitude(machine, [2350.0])
    assert chart.known_to == 400.0
    assert chart.depth[0] == pytest.approx(lobes_at_amplitude(spring_mass(None), [2350.0]).depth[0], rel=1e-4)
    wider = replace(machine, frequency=(5.0, 1000.0))
    assert (chatter_band(wider).low, chatter_band(wider).high) == (20.0, 400.0)
    again = lobes_at_amplitude(wider, [2350.0])
    assert again.depth[0] == pytest.approx(chart.depth[0], rel=1e-12)
    assert any("reaches beyond what is known of the measured parts, 20 to 400 Hz" in said for said in again.warnings)
    with pytest.raises(InputError, match="frequency is 500 to 600 Hz, expected a band within 20 to 400 Hz"):
        chatter_band(replace(machine, frequency=(500.0, 600.0)))


def test_a_tool_that_feels_no_mode_needs_a_band() -> None:
    block = Modal("block", ("x",), np.array([0.0]), np.array([0.0]), np.array([[1.0]]), np.array([5.0]))
    with pytest.raises(InputError, match="feels no mode"):
        chatter_band(Machine((block,), tool={"x": "block.x"}))


@pytest.mark.parametrize("rate", [0.0, 1e-9])
@pytest.mark.parametrize("method", ["turning", "collocation", None])
def test_of_a_tool_without_damping_no_depth_is_told(rate: float, method: str | None) -> None:
    joint = Joint((Linear(1e7), Viscous(rate))) if rate else Joint((Linear(1e7),))
    base = spring_mass(None)
    machine = replace(base, connections=(Connection("guide", ("slide.x", "ground"), joint),))
    with pytest.raises(InputError, match=r"the mode at 100 Hz that the tool feels has a damping ratio of .*no depth"):
        lobes_at_amplitude(machine, [2350.0], 0.0, method)


def test_slow_modes_beside_a_joint_that_is_far_too_stiff_are_found() -> None:
    """A joint mistyped by a million makes a mode a hundred thousand times faster; the others stay where they are."""
    M, stiff = np.diag([25.33, 1e-3]), Joint((Linear(1e12),))
    machine = Machine(
        (Lumped("slide", ("x", "u"), M),),
        (
            Connection("guide", ("slide.x", "ground"), Joint((Linear(1e5), Viscous(30.0)))),
            Connection("head", ("slide.u", "slide.x"), Joint((*stiff.laws, Viscous(1.0)))),
        ),
        tool={"x": "slide.u"},
        cutting=TURNING,
    )
    slow = np.sqrt(1e5 / 25.331) / (2 * np.pi)
    assert _natural(machine)[0] == pytest.approx(slow, rel=1e-3)


def test_a_mode_faint_beside_a_soft_foundation_is_kept() -> None:
    """With a peak of 5e-5 of that of its foundation it has the receptance to itself where it rings."""
    mass, stiffness = np.array([5000.0, 25.0]), np.array([4.9e6, 4e9])
    damping = 2 * np.array([0.002, 0.05]) * np.sqrt(stiffness * mass)
    joints = [Joint((Linear(k), Viscous(c))) for k, c in zip(stiffness, damping, strict=True)]
    machine = Machine(
        (Lumped("bed", ("x",), mass[:1, None]), Lumped("head", ("x",), mass[1:, None])),
        (Connection("mount", ("bed.x", "ground"), joints[0]), Connection("way", ("head.x", "bed.x"), joints[1])),
        tool={"x": "head.x"},
        cutting=TURNING,
    )
    model = chatter_band(machine).model
    assert model is not None
    frequency = np.geomspace(1, 4000, 50)
    omega = 2 * np.pi * frequency
    bed, way = stiffness[:, None] + 1j * omega * damping[:, None]
    # Written out: the head on its way on the bed on its mounts.
    below = 1 / (bed - mass[0] * omega**2 + 1 / (1 / way - 1 / (mass[1] * omega**2)))
    alone = 1 / (way - mass[1] * omega**2)
    truth = alone * (1 + way**2 * below * alone)
    np.testing.assert_allclose(model(frequency)[:, 0, 0], truth, rtol=1e-8)
