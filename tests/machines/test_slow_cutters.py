"""Slow spindles with uneven or twisted flutes: the march over a pattern beside maps with a matrix, and two methods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from repeats import repeats
from revolution_steps import Case, growth_in_time

from machines.cutting.cutters.march import Marcher
from machines.cutting.cutters.marched_border import changes
from machines.cutting.cutters.pattern_map import pattern_map
from machines.cutting.cutters.side_lines import SideLines
from machines.cutting.cutters.wide_lines import WideLines
from machines.cutting.loops.multi_frequency import stiffest_direction
from machines.cutting.process.cutter import Cutter
from machines.cutting.process.cutting import Cutting
from machines.cutting.rest.cutter_search import CutterSearch
from machines.cutting.rest.solve import stability_lobes
from machines.tool.bounded_band import Spectrum
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

TOOL = ToolModel.from_modes([420.0, 655.0, 1310.0], [0.03, 0.02, 0.025], [1.1, 0.6, 0.2], [[1, 0, 0.6], [0, 1, 0.8]])
EVEN = Cutting("milling", teeth=4, tangential=7e8, normal=2.5e8, mode="down", immersion=0.6, diameter=0.05)
UNEVEN = replace(EVEN, pitch=(84.0, 96.0, 83.0, 97.0))
CUTTERS = {
    "even": EVEN,
    "pitch": UNEVEN,
    "helix": replace(EVEN, helix=35.0),
    "both": replace(UNEVEN, helix=30.0),
    "helix by flute": replace(UNEVEN, helix=(30.0, 33.0, 30.0, 33.0)),
    "flank": replace(UNEVEN, helix=20.0, process_damping=3e4),
    "free flight": replace(UNEVEN, immersion=0.1),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", CUTTERS)
def test_a_march_has_the_multipliers_of_the_map(name: str) -> None:
    cutter = Cutter.of(CUTTERS[name])
    for speed, depth in ((2500.0, 1e-3), (900.0, 6e-3)):
        every = np.linalg.eigvals(pattern_map(TOOL, cutter, np.array([speed]), depth).maps()[0])
        size = np.sort(np.abs(every))[::-1]
        march = Marcher(TOOL, cutter, speed).at(depth)
        found = np.abs(march.multipliers(count=4))[:4]
        np.testing.assert_allclose(found, size[:4], rtol=1e-7, atol=1e-12 * size[0])
        beyond = np.abs(march.multipliers(0.5 * size[0]))
        assert np.count_nonzero(beyond >= 0.5 * size[0]) == np.count_nonzero(size >= 0.5 * size[0])


@pytest.mark.parametrize("name", ["pitch", "both", "helix by flute", "flank"])
def test_an_applied_loop_is_the_loop(name: str) -> None:
    cutter = Cutter.of(CUTTERS[name])
    lines = SideLines(Spectrum(tool_point(TOOL, TOOL.axes, TOOL.lines), (0.0, np.inf)), cutter, (0, 1), 2500.0, 40)
    x = np.exp(1j * np.arange(164) ** 2)
    for nu, depth in ((0.0, 2e-3), (0.31, 9e-3), (0.5, 20e-3)):
        formed = lines.closed(np.array([nu]), depth)[0] @ x
        np.testing.assert_allclose(WideLines(lines).applied(nu, depth)(x), formed, atol=1e-12 * np.linalg.norm(formed))


@pytest.mark.parametrize(
    "name", repeats(["pitch", "both", "helix by flute", "flank"], lambda _: False, lambda _: False)
)
def test_both_methods_agree_at_six_hundred_rpm(name: str) -> None:
    charts = [stability_lobes(TOOL, CUTTERS[name], [600.0], m) for m in ("multi-frequency", "collocation")]
    np.testing.assert_allclose(charts[0].depth, charts[1].depth, rtol=1e-4)
    np.testing.assert_allclose(charts[0].chatter_frequency, charts[1].chatter_frequency, rtol=1e-4)
    b = float(charts[1].depth[0])
    marcher = Marcher(TOOL, Cutter.of(CUTTERS[name]), 600.0, 10)
    below, above = (abs(marcher.at(share * b).multipliers()[0]) for share in (0.999, 1.001))
    assert below < 1 < above


@pytest.mark.thorough
def test_a_march_finds_every_change_that_the_loop_finds() -> None:
    """One turn of a twisted cutter on a soft tool, where lobes end and begin again as depth grows."""
    soft = ToolModel.from_modes([800.0], [0.02], [0.03], np.eye(1), ("x",))
    thin = Cutting("milling", teeth=1, tangential=6e8, normal=2e8, mode="down", immersion=0.05, diameter=0.008)
    search = CutterSearch.of(tool_point(soft, soft.axes, soft.lines), replace(thin, helix=30.0), soft)
    speed, deepest = 31000.0, 12e-3
    plain, _ = search.found(speed, deepest)
    slow = search.slow(speed, deepest, beyond=0)
    assert slow is not None
    marched = slow.every(deepest, 0.0)
    assert len(plain) == len(marched) > 1
    for one, other in zip(plain, marched, strict=True):
        assert (one.below > one.above) == (other.below > other.above)
        assert other.crossing.depth == pytest.approx(one.crossing.depth, rel=1e-5)
        assert other.crossing.kind == one.crossing.kind


@pytest.mark.slow
def test_a_simulation_denies_no_depth_of_a_slow_uneven_cutter() -> None:
    modes = ToolModel.from_modes([300.0, 340.0], [0.04, 0.04], [1.0, 0.8], np.eye(2))
    cutting = replace(UNEVEN, helix=25.0)
    depth = float(stability_lobes(modes, cutting, [900.0], "collocation").depth[0])
    natural, lag = (2 * np.pi * 300, 2 * np.pi * 340), 2 * np.tan(np.radians(25)) / 0.05
    arc, pitch = (cutting.entry_angle, cutting.exit_angle), tuple(np.radians(UNEVEN.pitch))
    cases = [
        Case(natural, (0.04, 0.04), (1.0, 0.8), 7e8, 2.5e8, arc, pitch, (lag,) * 4, 900.0, share * depth)
        for share in (0.97, 1.03)
    ]
    below, above = growth_in_time(cases, 4000)
    assert below < 1 < above


@pytest.mark.slow
def test_a_march_that_begins_where_something_grows_goes_back_to_where_nothing_does() -> None:
    marcher = Marcher(TOOL, Cutter.of(UNEVEN), 1500.0)
    (one,) = changes(marcher, 1e-3, 30e-3, first=True)[:1]
    (other,) = changes(marcher, 1.3 * one.crossing.depth, 30e-3, first=True)[:1]
    assert (one.below, other.below) == (0, 0)
    assert other.crossing.depth == pytest.approx(one.crossing.depth, rel=1e-4)


def test_unequal_pitches_may_have_more_teeth_in_the_cut_at_once() -> None:
    even = stiffest_direction(replace(EVEN, immersion=0.1), (0, 1))
    close = stiffest_direction(replace(EVEN, immersion=0.1, pitch=(20.0, 160.0, 20.0, 160.0)), (0, 1))
    assert close > 1.5 * even
