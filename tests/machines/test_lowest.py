"""The lowest limit over a range of speeds: dips between the lines of a chart are in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from repeats import repeats

from jointlib.arrays import Array
from machines.cutting.amplitude.frozen_lobes import lobes_at_amplitude
from machines.cutting.amplitude.lobes_over_range import lobes_over_range, over_the_range
from machines.cutting.amplitude.pocket import best_pocket
from machines.cutting.rest import dips
from machines.files.machine_file import read_machine
from machines.lobes import Cutting, StabilityLobes, ToolModel, stability_lobes

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


def tool(seed: int) -> ToolModel:
    """Two modes in each direction at random."""
    rng = np.random.default_rng(seed)
    frequency = np.sort(rng.uniform(200, 1500, 3))
    shapes = rng.uniform(-1, 1, (2, 3))
    return ToolModel.from_modes(frequency, rng.uniform(0.01, 0.05, 3), rng.uniform(0.3, 3, 3), shapes)


CUT = Cutting(process="milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.15)


def chart(seed: int, speeds: Array) -> StabilityLobes:
    return stability_lobes(tool(seed), CUT, speeds, "collocation")


def over(seed: int, speeds: Array) -> StabilityLobes:
    return over_the_range(chart(seed, speeds), lambda more: chart(seed, more))


@pytest.mark.slow
@pytest.mark.parametrize("seed", repeats(range(2), lambda _: False, lambda seed: seed == 0))
def test_the_minimum_does_not_depend_on_where_the_lines_stand(seed: int) -> None:
    one, other = (over(seed, np.linspace(5000, 15000, count)) for count in (40, 57))
    assert one.minimum_depth == pytest.approx(other.minimum_depth, rel=1e-3)
    plain = chart(seed, np.linspace(5000, 15000, 40))
    assert one.minimum_depth <= plain.minimum_depth
    at = chart(seed, np.array([one.minimum_at]))
    assert at.depth[0] == pytest.approx(one.minimum_depth, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_no_line_of_a_far_finer_chart_lies_below_it(seed: int) -> None:
    found = over(seed, np.linspace(5000, 15000, 100))
    fine = chart(seed, np.linspace(5000, 15000, 2001))
    assert found.minimum_depth <= (1 + 1e-3) * fine.minimum_depth


def test_a_chatter_that_barely_meets_half_of_the_teeth_is_looked_at_there() -> None:
    """Of the end mill a dip of 7 rpm, 12 % deep, lies between lines 90 rpm apart; the chatter bends towards it."""
    machine = read_machine(LIBRARY / "end_mill.toml")
    lines = np.linspace(6000, 24000, 200)
    found = lobes_over_range(machine, lines[(lines > 20300) & (lines < 20800)])
    fine = lobes_at_amplitude(machine, np.arange(20530.0, 20545.0, 0.5))
    assert found.minimum_depth == pytest.approx(fine.minimum_depth, rel=1e-3)
    assert found.minimum_depth < 0.94 * np.min(found.depth[found.kind == "hopf"])


def test_a_dip_is_among_the_speeds_so_that_no_pocket_lies_over_it() -> None:
    """A boundary 4 mm deep with a dip of a tenth of a line spacing, in which the chatter passes half a tooth."""
    grid = np.linspace(3000.0, 12000.0, 100)

    def made(speeds: Array) -> StabilityLobes:
        dip = np.abs(speeds - 7045.0) < 5.0
        depth = np.where(dip, 1e-3 * (1 + np.abs(speeds - 7045.0) / 5), 4e-3)
        half = np.where(speeds < 7045.0, 0.45, 0.55) * 2 * speeds / 60
        return StabilityLobes(
            "collocation", speeds, depth, np.where(dip, speeds / 60, half), np.where(dip, "flip", "hopf"),
            np.zeros(len(speeds), dtype=np.int64), np.full(len(speeds), np.inf), float(np.min(depth)), 0.0, 0.0, 2, (),
            chart(0, np.array([9000.0])).outcome, (), (),
        )  # fmt: skip

    assert np.min(made(grid).depth) == 4e-3
    found = over_the_range(made(grid), made)
    assert found.minimum_depth == pytest.approx(1e-3, rel=0.02)
    assert found.minimum_at == pytest.approx(7045.0, abs=0.2)
    best = best_pocket(found.speed, found.depth, CUT)
    assert best is not None
    assert abs(best.speed - 7045.0) > 0.02 * 7045.0


def test_the_lowest_lobe_of_a_chatter_tells_where_it_may_be_low_again() -> None:
    """A chatter of 612 Hz that stands to three teeth as at 2400 rpm: with 5.1 and 4.1 waves between them."""
    speed = np.array([2000.0, 2400.0, 2600.0, 612 * 20 / 4.1, 3400.0])
    frequency = np.array([612.0, 612.0, 612.0, 612.3, 612.0])
    known = {"speed": speed, "depth": np.array([1.3, 1.0, 1.3, 1.02, 1.3]), "chatter_frequency": frequency}
    known |= {"lobe": np.floor(20 * frequency / speed), "kind": np.full(5, "hopf")}
    asked = dips.alike(known, 3, False)
    order = np.concatenate([np.arange(8) + 0.1, np.arange(1, 8) / 2])
    alone = np.array([n for n in 20 * 612.0 / order if np.min(np.abs(n - speed)) > 1e-3 * n and 2000 < n < 3400])
    np.testing.assert_allclose(asked, np.sort(alone), rtol=1e-12)


def test_level_ground_above_the_lowest_place_is_known() -> None:
    speed = np.array([2000.0, 2400.0, 2600.0, 3000.0, 3400.0])
    for middle, looked in ((1.0206, False), (1.03, True)):
        depth, lobe = np.array([1.2, 1.0, middle, 1.02, middle]), np.arange(5, 0, -1)
        known = {"speed": speed, "depth": depth, "lobe": lobe, "kind": np.full(5, "hopf")}
        assert np.any(dips.beside(known, dips.NEAR) > 2600.0) == looked
