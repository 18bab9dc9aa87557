"""The chart as a picture: zones over amplitude, bands and lenses are drawn where they are, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from machines.cutting.amplitude.unstable_depths import unstable_depths_of
from machines.cutting.amplitude.zones import Zones, safe_limit
from machines.lobes import Cutting, StabilityLobes, ToolModel, stability_lobes
from machines.report.figures.lobes_figure import axis_top, lobes_figure

TOOL = ToolModel.from_modes([922.0], [0.011], [0.03993], [[1.0]], axes=("x",))
CUT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.1, feed=1e-4, diameter=0.02)


@pytest.fixture(scope="module")
def chart() -> StabilityLobes:
    return stability_lobes(TOOL, CUT, np.linspace(17000.0, 19000.0, 21), "collocation")


def test_between_charts_the_safe_limit_is_the_lowest_and_the_ceiling_the_highest(chart: StabilityLobes) -> None:
    low, high = (replace(chart, depth=share * chart.depth) for share in (0.7, 1.2))
    zones = Zones.between([(0.0, chart), (1e-6, low), (2e-6, high)])
    assert zones is not None
    np.testing.assert_allclose(zones.safe, 0.7 * chart.depth)
    np.testing.assert_allclose(zones.onset, chart.depth)
    np.testing.assert_allclose(zones.ceiling, 1.2 * chart.depth)
    assert zones.reach == "over 2 amplitudes of up to 2 µm"
    assert Zones.between([(1e-6, low), (2e-6, high)]) is None
    assert Zones.between([(0.0, chart)]) is None


def test_the_limit_to_stay_under_is_the_lowest_of_amplitudes_and_band(chart: StabilityLobes) -> None:
    band = chart.depth * np.array([[0.5], [1.0], [1.5]])
    band[0, 3] = 9.0
    zones = Zones(0.8 * chart.depth, chart.depth, chart.depth, np.array([1e-6]))
    expected = 0.5 * chart.depth
    expected[3] = 0.8 * chart.depth[3]
    np.testing.assert_allclose(safe_limit([chart], zones, band), expected)
    np.testing.assert_allclose(safe_limit([chart], None, None), chart.depth)


@pytest.mark.thorough
def test_the_picture_speaks_of_what_it_draws_and_of_nothing_else(chart: StabilityLobes) -> None:
    plain = lobes_figure([(0.0, chart)], CUT)
    assert not any(word in plain.caption for word in ("istable", "finite size", "lens", "samples", "Grey"))
    zones = Zones(0.7 * chart.depth, chart.depth, 1.3 * chart.depth, np.array([1e-6, 5e-6]))
    unstable = unstable_depths_of(TOOL, CUT, chart, 1e-3 * axis_top([chart]))
    drawn = lobes_figure([(0.0, chart)], CUT, None, zones, chart.depth * np.array([[0.9], [1.0], [1.1]]), unstable)
    for words in ("Bistable", "Chatter of finite size", "a lens", "95 % of the samples", "removal rate", "5 µm"):
        assert words in drawn.caption
    falling = Zones(0.7 * chart.depth, chart.depth, chart.depth, np.array([1e-6, 5e-6]))
    assert "finite size" not in lobes_figure([(0.0, chart)], CUT, None, falling).caption


def test_a_single_speed_or_no_limit_at_all_still_makes_a_picture(chart: StabilityLobes) -> None:
    one = stability_lobes(TOOL, CUT, [18000.0], "collocation")
    assert "<svg" in lobes_figure([(0.0, one)], CUT).svg
    stable = replace(chart, depth=np.full(chart.depth.shape, np.inf), kind=np.full(chart.kind.shape, ""))
    assert "<svg" in lobes_figure([(0.0, stable)], CUT).svg


@pytest.mark.parametrize("kinds", [("hopf", "flip"), ("hopf",)])
def test_the_marks_of_the_chatter_frequency_have_a_legend_where_there_are_both(
    chart: StabilityLobes, kinds: tuple[str, ...]
) -> None:
    assert {"hopf", "flip"} <= set(np.ravel(chart.kind))
    some = replace(chart, kind=np.where(np.isin(chart.kind, kinds), chart.kind, "hopf"))
    drawn = lobes_figure([(0.0, some)], CUT).svg
    assert [name in drawn for name in ("<!-- Hopf -->", "<!-- flip (period doubling) -->")] == [len(kinds) == 2] * 2
