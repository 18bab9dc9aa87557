"""``jointlib lobes`` where amplitude matters: limits in words, the simulation at a point, and bands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command_line import jointlib


@pytest.mark.slow
def test_at_a_chosen_speed_the_limits_over_amplitude_are_told(lathe: str) -> None:
    done = jointlib(f"lobes {lathe} --speed 2350")
    assert done.status == 0
    assert "At 2350 rpm every vibration of up to 200 µm at the tool dies out below 0.645 mm." in done.out
    assert "Between that and 0.699 mm the cut is quiet unless a knock" in done.out
    assert "Above 0.699 mm it chatters by itself at 104.9 Hz" in done.out
    data = jointlib(f"lobes {lathe} --speed 2350 --json").json
    assert data["over_amplitude"]["safe_depth"] == pytest.approx([0.64514e-3], rel=1e-3)
    assert data["over_amplitude"]["onset_depth"] == pytest.approx([0.69918e-3], rel=1e-4)
    assert data["told"][0] in done.out


def test_limits_over_amplitude_end_with_the_budget(lathe: str) -> None:
    """In a thousandth of a second not even two amplitudes are known, the chart at rest still is."""
    data = jointlib(f"lobes {lathe} --speed 2350 --budget 0.001 --json").json
    assert re.match(r"Limits over amplitude were left out, \S+ s being left of --budget: not done", data["told"][-1])
    assert data["minimum_depth"] == pytest.approx(0.61798e-3, rel=1e-4)
    assert "over_amplitude" not in data


@pytest.mark.slow
def test_the_limit_of_a_machine_that_depends_on_amplitude_is_said_to_be_that_of_small_vibrations(lathe: str) -> None:
    """The joint hardens: its least depth over every speed is that at rest, b = 2kζ(1 + ζ)/K_s."""
    done = jointlib(f"lobes {lathe} --speed 2350")
    assert "stable at every speed below 0.61798 mm for small vibrations" in done.out
    assert "vibrations of up to 200 um, as a knock leaves them, die out at every speed below 0.61798 mm" in done.out


def test_a_machine_without_amplitude_says_nothing_about_it(here: Path) -> None:
    data = jointlib("lobes machines/library/two_mode_tool.toml --speed 6000 --json").json
    assert "over_amplitude" not in data


@pytest.mark.slow
def test_the_witness_simulates_the_point_and_says_from_which_amplitude_it_grows(lathe: str) -> None:
    point = "--speed 2350 --depth 0.66324mm --amplitude 57um 59um 61um 63um --witness --json"
    (found,) = jointlib(f"lobes {lathe} {point}").json["witness"][0]
    assert found["grows"] == [False, False, True, True]
    assert found["cycles"][0]["amplitude"] == pytest.approx(60e-6, rel=2e-3)
    assert found["cycles"][0]["stable"] is False


@pytest.mark.slow
def test_bands_come_from_the_covariance_of_the_joints(lathe: str) -> None:
    done = jointlib(f"lobes {lathe} --speed 2350 --amplitude 1um --samples 100")
    assert "2350 rpm at a tool-point amplitude of 1 um: 0.6" in done.out
    assert "mm in 95 % of 100 samples, median 0." in done.out
    band = jointlib(f"lobes {lathe} --speed 2350 --samples 100 --json").json["band"]
    low, middle, high = (row[0] for row in band["depth"])
    assert low < middle < high
    assert band["share"] == [0.025, 0.5, 0.975]
    assert "nothing to sample" in jointlib("lobes machines/library/two_mode_tool.toml --speed 6000 --samples 100").err


FLIP = """
schema = "jointlib/machine/1"
name = "flip tool"
[[component]]
name = "tool"
kind = "lumped"
dofs = ["x"]
mass = [[0.03993]]
stiffness = [[1340050.0]]
damping = [[5.0889]]
[tool]
x = "tool.x"
[response]
frequency = ["100 Hz", "4000 Hz"]
[cutting]
process = "milling"
teeth = 2
tangential = 6e8
normal = 2e8
mode = "down"
immersion = 0.1
"""


def test_above_a_lens_the_cut_is_said_to_be_stable_again(here: Path) -> None:
    (here / "flip.toml").write_text(FLIP, encoding="utf-8")
    data = jointlib("lobes flip.toml --speed 18000 5000 --json").json
    (first, second), (other,) = data["unstable"]["intervals"]
    assert [first["low"], first["high"], second["low"]] == pytest.approx([0.8157e-3, 3.118e-3, 3.831e-3], rel=1e-3)
    assert (first["kind"], first["end"], second["high"], other["high"]) == ("flip", "flip", None, None)
    assert data["unstable"]["deepest"] == pytest.approx([6 * b for b in data["depth"]])
    assert "stable again between 3.118 and 3.831 mm" in jointlib("lobes flip.toml --speed 18000").out
    assert "unstable" not in jointlib("lobes flip.toml --speed 18000 --amplitude 1um --json").json
