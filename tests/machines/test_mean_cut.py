"""The mean cut of a tool on a machine whose stiffest parts move far above all that chatters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointlib.arrays import Array, ComplexArray
from machines import Cutting
from machines.cutting.cutters import mean_cut
from machines.cutting.process.cutter import Cutter
from machines.tool.bounded_band import shape
from machines.tool.tool_model import ToolModel
from machines.tool.tool_point import tool_point

STIFF = ToolModel.from_modes(
    [80.0, 900.0, 1100.0, 6e3, 3e5], [0.03] * 5, [400.0, 0.5, 0.6, 0.2, 0.01], [[1, 1, 0, 1, 1], [0, 0, 1, 1, -1]]
)
CUTTING = Cutting(
    process="milling", teeth=4, tangential=1.9e9, normal=6.5e8, immersion=0.5, mode="down", helix=38.0, diameter=0.016
)


@pytest.mark.thorough
@pytest.mark.parametrize("rubbing", [None, 4e4])
@pytest.mark.parametrize("speed", [1500.0, 4000.0, 9000.0])
def test_the_lowest_depth_is_that_of_all_frequencies_and_few_of_them_are_asked(
    speed: float, rubbing: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = 0

    def counted(frequency: Array) -> ComplexArray:
        nonlocal asked
        asked += frequency.size
        return STIFF(frequency)

    point = tool_point(counted, STIFF.axes, STIFF.lines)
    seen, cutter = shape(point), Cutter.of(replace(CUTTING, process_damping=rubbing))
    asked = 0
    first = mean_cut.mean_crossings(point, cutter, speed, 0.0, seen)
    few, asked = asked, 0
    every = mean_cut.mean_crossings(point, cutter, speed, 5 * first[0][0], seen)
    loop, _ = mean_cut._loop(point, cutter, speed)
    asked = 0
    whole = mean_cut._crossings(loop, np.union1d(point.lines, np.arange(1.0, 6e5, 2.0)), 5 * first[0][0])
    assert asked > 20 * few
    assert first[0][0] == pytest.approx(whole[0][0], rel=1e-9)
    np.testing.assert_allclose([one[0] for one in every], [one[0] for one in whole], rtol=1e-9)


def test_a_receptance_has_the_same_bits_on_many_lines_as_on_few() -> None:
    lines = np.linspace(1.0, 5e4, 40_001)
    np.testing.assert_array_equal(STIFF(lines)[:1000], STIFF(lines[:1000]))
