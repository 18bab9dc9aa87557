"""Growth at a depth of tools with modes so fast that no map of a tooth period could follow them."""

from __future__ import annotations

import numpy as np
import pytest

from jointlib.errors import CheckFailed
from machines.cutting.cutters.pattern_multipliers import largest_multipliers
from machines.cutting.cutters.settled_multipliers import settled_multipliers
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel

MILL = Cutting(process="milling", teeth=2, tangential=7e8, normal=2.5e8, mode="down", immersion=0.4)
TURN = Cutting(process="turning", specific=2e9)


def tool(*fast: float) -> ToolModel:
    """Modes at 410 and 730 Hz, and stiff ones at frequencies in Hz."""
    frequency = np.array([410.0, 730.0, *fast])
    mass = np.array([2.0, 1.5, *(0.05 for _ in fast)])
    shapes = np.array([[1.0, 0.3, *(0.7 for _ in fast)], [0.2, 1.0, *(0.5 for _ in fast)]])
    return ToolModel.from_modes(frequency, np.full(len(frequency), 0.02), mass, shapes)


@pytest.mark.parametrize(("cut", "speed", "method"), [(MILL, 3000.0, "multi-frequency"), (TURN, 900.0, "turning")])
def test_the_limiting_depth_of_another_method_is_where_growth_begins(cut: Cutting, speed: float, method: str) -> None:
    stiff, rpm = tool(60e3, 95e3), np.array([speed])
    depth = float(stability_lobes(stiff, cut, rpm, method).depth[0])
    around = depth * np.array([0.5, 0.999, 1.001, 1.5])
    with pytest.raises(CheckFailed, match="nodes for modes of up to"):
        largest_multipliers(stiff, cut, rpm, around)
    mu = settled_multipliers(stiff, cut, rpm, around)[0]
    assert np.all(mu[:2] < 1)
    assert np.all(mu[2:] > 1)


def test_a_tool_whose_modes_can_be_followed_is_followed_in_all_of_them() -> None:
    rpm, depth = np.array([6000.0]), np.array([0.5e-3, 2e-3])
    np.testing.assert_array_equal(
        settled_multipliers(tool(), MILL, rpm, depth), largest_multipliers(tool(), MILL, rpm, depth)
    )
