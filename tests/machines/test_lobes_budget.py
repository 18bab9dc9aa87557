"""A chart whose time is up: it ends with what is known, spread over the range, and says so."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

from jointlib.io.joint_file import read_joint
from jointlib.shown.progress import Silent
from machines import lobes_at_amplitude, lobes_over_range, read_machine
from machines.answers.told.lobes_preview import previewed
from machines.cutting.amplitude import charts_by_amplitude
from machines.cutting.amplitude import lobes_over_range as lowest
from machines.cutting.process.chart import BY_SPEED
from machines.verbs.lobes import command

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
SPEEDS = np.linspace(6000.0, 12000.0, 60)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every look at the clock finds it a second later."""
    seconds = count()
    monkeypatch.setattr(lowest, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))


@pytest.mark.usefixtures("clock")
def test_the_speeds_of_a_chart_cut_short_are_spread_over_its_range_and_right() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    chart = lobes_over_range(machine, SPEEDS, budget=20.0)
    assert 10 < chart.speed.size < 30
    assert chart.minimum_at is None
    assert np.all(np.isin(chart.speed, SPEEDS))
    assert np.all(np.diff(chart.speed) > 0)
    assert np.max(np.diff(chart.speed)) < 3 * (SPEEDS[-1] - SPEEDS[0]) / chart.speed.size
    at_once = lobes_at_amplitude(machine, chart.speed)
    np.testing.assert_allclose(chart.depth, at_once.depth, rtol=1e-6)
    assert chart.minimum_depth == np.min(chart.depth)
    (said,) = [warning for warning in chart.warnings if "Time was up after 20 s" in warning]
    assert f"{chart.speed.size} of 60 speeds" in said
    assert sorted([*chart.speed, *chart.left_out]) == SPEEDS.tolist()
    assert chart.short_of == f", {chart.speed.size} of 60 speeds, time was up"


@pytest.mark.thorough
@pytest.mark.usefixtures("clock")
def test_a_chart_whose_dips_are_not_looked_for_to_the_end_says_so() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    chart = lobes_over_range(machine, SPEEDS[::2], budget=15.0)
    assert np.all(np.isin(SPEEDS[::2], chart.speed))
    assert chart.minimum_at is None
    assert "Time was up after 15 s: of what dips between the 30 speeds not all was looked for." in chart.warnings


@pytest.mark.thorough
def test_a_budget_that_is_not_spent_changes_nothing() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    speeds = np.linspace(8000.0, 10000.0, 9)
    with_budget, without = lobes_over_range(machine, speeds, budget=600.0), lobes_over_range(machine, speeds)
    np.testing.assert_array_equal(with_budget.depth, without.depth)
    assert with_budget.minimum_at == without.minimum_at
    assert with_budget.warnings == without.warnings


def test_points_of_a_chart_cut_short_are_not_joined_over_speeds_that_are_left_out() -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    whole = lobes_at_amplitude(machine, SPEEDS[:9])
    known = np.array([0, 1, 4, 8])
    values = {key: getattr(whole, key)[known] for key in BY_SPEED}
    chart = replace(whole, **values, left_out=tuple(np.delete(SPEEDS[:9], known).tolist()))
    (line,) = chart.plot().get_lines()
    assert line.get_marker() == "o"
    assert line.get_label() == f"{chart.method}, 4 of 9 speeds, time was up"
    drawn = dict(zip(*line.get_data(), strict=True))
    assert [rpm for rpm, depth in drawn.items() if np.isnan(depth)] == sorted(chart.left_out)
    np.testing.assert_allclose([drawn[rpm] for rpm in chart.speed], 1e3 * chart.depth)
    (other,) = whole.plot().get_lines()
    assert (other.get_marker(), other.get_label()) == ("None", whole.method)


def test_a_picture_of_a_chart_cut_short_says_so_and_so_does_what_is_printed(tmp_path: Path) -> None:
    target = tmp_path / "short.svg"
    words = [str(LIBRARY / "two_mode_tool.toml"), "--budget", "1 ms", "-o", str(target)]
    said = CliRunner().invoke(command, words)
    assert said.exit_code == 0
    begin = "No speed and depth are recommended: nowhere are three speeds known within 2 % of one, 5 of 200 speeds"
    assert begin in said.stdout
    assert "onset of chatter, 5 of 200 speeds, time was up" in target.read_text()
    assert "zero-order, a preview" in target.read_text()
    assert "above the limit" not in target.read_text()


def test_the_verb_ends_with_what_it_knows() -> None:
    said = CliRunner().invoke(command, [str(LIBRARY / "two_mode_tool.toml"), "--budget", "1 ms"])
    assert said.exit_code == 0
    assert said.stdout.startswith("stable at these speeds below ")
    assert "Time was up after 0.001 s: 5 of 200 speeds are computed" in said.stdout
    refused = CliRunner().invoke(command, [str(LIBRARY / "two_mode_tool.toml"), "--budget", "-1"])
    assert "--budget: -1, expected at least 0 s" in str(refused.exception)


def test_zero_order_previews_the_speeds_that_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    with monkeypatch.context() as patched:
        seconds = count()
        patched.setattr(lowest, "time", SimpleNamespace(monotonic=lambda: float(next(seconds))))
        chart = lobes_over_range(machine, SPEEDS, budget=20.0)
    preview, (said,) = previewed(machine, chart, Silent())
    expected = lobes_at_amplitude(machine, SPEEDS, 0.0, "zero-order")
    np.testing.assert_allclose(preview.depth, expected.depth, rtol=1e-9)
    assert said == (
        f"By zero-order, a preview, the cut is stable at all 60 speeds below {np.min(expected.depth) * 1e3:.4g} mm."
    )
    assert previewed(machine, replace(chart, left_out=()), Silent()) == (None, [])


@pytest.mark.thorough
@pytest.mark.usefixtures("clock")
def test_a_recommendation_from_a_chart_cut_short_says_so() -> None:
    said = CliRunner().invoke(command, [str(LIBRARY / "two_mode_tool.toml"), "--budget", "60 s"])
    (line,) = [line for line in said.stdout.splitlines() if line.startswith("recommended: ")]
    assert re.search(r", \d+ of 200 speeds, time was up$", line)


def test_a_chart_at_an_amplitude_ends_with_its_budget_where_very_many_joints_make_it_dear(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(charts_by_amplitude, "_MANY", 0)
    machine = read_machine(LIBRARY / "guide_mill.toml").with_joint("guide", read_joint(LIBRARY / "guide.joint.toml"))
    speeds = np.linspace(9000.0, 12000.0, 40)
    (chart,) = charts_by_amplitude.charts_by_amplitude(machine, speeds, (5e-6,), None, 1e-3)
    assert "Time was up after 0.001 s: 1 of 40 speeds are computed at every amplitude" in " ".join(chart.warnings)
    assert len(chart.left_out) == 39
    assert chart.depth == lobes_at_amplitude(machine, chart.speed, 5e-6).depth
