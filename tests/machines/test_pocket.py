"""The recommended pocket: stable when the speed is a little off, and the best of its kind."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from jointlib.errors import InputError
from machines import lobes_at_amplitude, read_machine
from machines.cutting.amplitude.pocket import WANDER, limit_of, pocket, removal_rate
from machines.cutting.forced.forced_vibration import forced_vibration
from machines.cutting.forced.quiet_pocket import LOUD, pocket_in_cut, quiet_pocket
from machines.lobes import Cutting, StabilityLobes
from machines.report.figures.lobes_figure import lobes_figure

TOOL = read_machine("machines/library/two_mode_tool.toml")
CUT = Cutting(**(TOOL.cutting or {}))


@pytest.fixture(scope="module")
def chart() -> StabilityLobes:
    return lobes_at_amplitude(TOOL, np.linspace(4000.0, 25000.0, 400))


@pytest.mark.slow
def test_the_pocket_is_stable_at_every_speed_inside_its_band(chart: StabilityLobes) -> None:
    found = pocket([chart], CUT)
    assert found is not None
    near = found.speed * np.linspace(1 - WANDER, 1 + WANDER, 101)
    finer = lobes_at_amplitude(TOOL, near)
    assert finer.depth.min() > found.depth
    assert finer.depth[50] == pytest.approx(found.limit, rel=1e-9)
    assert found.margin == pytest.approx(found.limit / found.depth - 1)


@pytest.mark.slow
def test_no_other_speed_removes_more_with_the_same_reserve(chart: StabilityLobes) -> None:
    found = pocket([chart], CUT, limit_of(TOOL, (0.0,), chart.method))
    assert found is not None
    for speed in np.linspace(4200.0, 24000.0, 60):
        inside = np.abs(chart.speed / speed - 1) <= WANDER
        edges = lobes_at_amplitude(TOOL, speed * np.array([1 - WANDER, 1 + WANDER])).depth
        lowest = min(chart.depth[inside].min(), edges.min())
        assert 0.9 * lowest * speed <= found.depth * found.speed * (1 + 2e-2)  # between the lines


def test_a_deeper_limit_at_one_amplitude_does_not_count_where_another_is_lower(chart: StabilityLobes) -> None:
    lower = dataclasses.replace(chart, depth=0.5 * chart.depth)
    alone, both = pocket([chart], CUT), pocket([chart, lower], CUT)
    assert alone is not None
    assert both is not None
    assert both.depth == pytest.approx(alone.depth / 2)


def test_beside_a_pocket_on_a_resonance_stands_the_best_one_with_little_vibration(chart: StabilityLobes) -> None:
    best = pocket([chart], CUT)
    assert best is not None
    assert CUT.feed is not None
    size = float(forced_vibration(TOOL, best.speed, best.depth).amplitude[0])
    quiet = quiet_pocket(TOOL, chart.speed, chart.depth, None, best, size)
    assert quiet is not None
    bound = LOUD * CUT.feed
    assert forced_vibration(TOOL, quiet.speed, quiet.depth).amplitude[0] <= bound < size
    inside = np.abs(chart.speed / quiet.speed - 1) <= WANDER
    assert quiet.depth == pytest.approx(0.9 * chart.depth[inside].min(), rel=3e-2)
    edges = lobes_at_amplitude(TOOL, quiet.speed * np.array([1 - WANDER, 1 + WANDER]))
    assert quiet.depth <= 0.9 * min(chart.depth[inside].min(), edges.depth.min())
    for speed in np.linspace(4200.0, 24000.0, 60):
        depth = 0.9 * chart.depth[np.abs(chart.speed / speed - 1) <= WANDER].min()
        if forced_vibration(TOOL, speed, depth).amplitude[0] < bound:
            assert depth * speed <= quiet.depth * quiet.speed * (1 + 3e-2)
    assert quiet_pocket(TOOL, chart.speed, chart.depth, None, best, 0.9 * bound) is None


def test_removal_rate_is_the_volume_swept_in_a_minute() -> None:
    """A slot 20 mm wide and 2 mm deep, fed at 3 teeth × 0.1 mm × 5000 rpm = 1500 mm/min: 60 cm³/min."""
    slot = dataclasses.replace(CUT, mode="slot", immersion=None, feed=1e-4, diameter=0.02)
    assert removal_rate(slot, 5000.0, 2e-3) == pytest.approx(60e-6 / 60)
    bar = Cutting(process="turning", specific=1e9, feed=2e-4, diameter=0.1)
    assert removal_rate(bar, 600.0, 1e-3) == pytest.approx(np.pi * 0.1 * 10 * 2e-4 * 1e-3)
    assert removal_rate(dataclasses.replace(CUT, diameter=None), 5000.0, 2e-3) is None


def test_too_few_speeds_recommend_nothing(chart: StabilityLobes) -> None:
    few = lobes_at_amplitude(TOOL, [6000.0, 9000.0, 12000.0])
    assert pocket([few], CUT) is None
    with pytest.raises(InputError, match="different speeds"):
        pocket([chart, few], CUT)


def test_a_chart_without_a_limit_recommends_nothing(chart: StabilityLobes) -> None:
    assert pocket([dataclasses.replace(chart, depth=np.full(chart.speed.shape, np.inf))], CUT) is None


def test_no_pocket_is_deeper_than_the_edges_of_the_cutter_reach(chart: StabilityLobes) -> None:
    free = pocket([chart], CUT)
    assert free is not None
    short = dataclasses.replace(CUT, flute_length=0.8 * free.depth)
    found = pocket([chart], short, limit_of(TOOL, (0.0,), chart.method))
    assert found is not None
    assert found.depth == pytest.approx(0.8 * free.depth)
    assert found.speed >= free.speed  # where depth is given, the fastest speed removes most
    assert found.limit > found.depth
    unlimited = dataclasses.replace(chart, depth=np.full(chart.speed.shape, np.inf))
    found = pocket([unlimited], short)
    assert found is not None
    assert (found.depth, found.limit) == (pytest.approx(0.8 * free.depth), np.inf)
    with pytest.raises(InputError, match=r"flute_length is -0\.01"):
        dataclasses.replace(CUT, flute_length=-0.01)


def test_a_depth_that_few_cutters_have_the_edges_for_is_told(chart: StabilityLobes) -> None:
    best = pocket([chart], CUT)
    assert best is not None
    for diameter, length, told in (
        (best.depth / 4, None, True),
        (best.depth / 2, None, False),
        (best.depth / 4, 1.0, False),
    ):
        table = {**(TOOL.cutting or {}), "diameter": diameter}
        machine = dataclasses.replace(TOOL, cutting=table if length is None else {**table, "flute_length": length})
        said = pocket_in_cut(machine, chart.speed.ravel(), chart.sure.ravel(), None, best)[2]
        assert any("4.0 diameters deep, and few cutters" in sentence for sentence in said) == told


def test_the_picture_shows_pocket_and_removal_rates(chart: StabilityLobes) -> None:
    found = pocket([chart], CUT)
    assert found is not None
    figure = lobes_figure([(0.0, chart)], CUT, found)
    assert found.words() in figure.caption
    assert "cm³/min" in figure.caption
    plain = lobes_figure([(0.0, chart)], dataclasses.replace(CUT, feed=None), found)
    assert "Broken lines" not in plain.caption
    assert len(plain.svg) < len(figure.svg)
