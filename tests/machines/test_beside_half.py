"""Crossings at and beside half the tooth frequency, where two are born, by both exact methods and by multipliers."""

from __future__ import annotations

import numpy as np
import pytest

from machines.cutting.loops.collocation import arc_map
from machines.lobes import Cutting, ToolModel, stability_lobes

FLIPS_BORN = (
    ToolModel.from_modes(
        [713.3, 353.8, 985.9, 475.5],
        [0.0382, 0.0225, 0.0272, 0.049],
        [3.143, 4.372, 0.948, 7.341],
        [[0.201, 0.215, 0.33, 1.393]],
        axes=("x",),
    ),
    Cutting("milling", teeth=1, tangential=6e8, normal=3.83e8, mode="slot"),
    24643.5,
)
"""A flip at 0.104 m, stable again from about 0.11 m, and a Hopf crossing at 0.140 m."""
FEW_TEETH = (
    ToolModel.from_modes(
        [527.2, 515.1, 719.9], [0.0177, 0.0362, 0.0128], [5.774, 4.717, 0.051], [[0.496, -1.911, 0.147]], axes=("x",)
    ),
    Cutting("milling", teeth=2, tangential=6e8, normal=2.36e8, mode="up", immersion=0.1),
    6968.3,
)
HOPF_PARTED = (
    ToolModel.from_modes(
        [1261.5, 998.6, 413.0, 819.8],
        [0.0281, 0.0147, 0.0389, 0.0128],
        [0.398, 0.774, 0.49, 1.121],
        [[-1.055, -0.391, 0.482, -0.239], [0.958, -0.2, 0.024, 1.546]],
    ),
    Cutting("milling", teeth=2, tangential=6e8, normal=1.94e8, mode="up", immersion=0.5),
    8944.3,
)
"""A Hopf crossing at 0.499 of the tooth frequency, 0.2 % below the flip."""
ANOTHER_FLIP = (
    ToolModel.from_modes(
        [1481.0, 1039.3, 595.0],
        [0.0344, 0.0302, 0.0207],
        [9.586, 0.15, 0.249],
        [[1.23, -0.467, 0.628], [-2.168, -0.322, 0.516]],
    ),
    Cutting("milling", teeth=1, tangential=6e8, normal=1.97e8, mode="up", immersion=0.05),
    32278.0,
)
"""With six harmonics the first flip is where the second one is in truth."""
FOUR_TEETH = (
    ToolModel.from_modes(
        [478.6, 1331.5, 1463.7, 1318.7],
        [0.0492, 0.0088, 0.0085, 0.0318],
        [0.167, 7.459, 0.454, 0.09],
        [[-0.272, 0.756, 1.307, 1.464], [0.146, 1.204, -0.659, -1.027]],
    ),
    Cutting("milling", teeth=4, tangential=6e8, normal=3.01e8, mode="up", immersion=0.1),
    6898.7,
)


@pytest.mark.parametrize("method", ["collocation", "multi-frequency"])
@pytest.mark.parametrize(
    ("case", "kind"),
    [(FLIPS_BORN, "flip"), (FEW_TEETH, "flip"), (HOPF_PARTED, "hopf"), (ANOTHER_FLIP, "flip"), (FOUR_TEETH, "flip")],
)
def test_the_multipliers_leave_the_circle_at_the_depth_that_is_told(
    case: tuple[ToolModel, Cutting, float], kind: str, method: str
) -> None:
    """Up to it none does at any depth of a hundred, and within 5e-4 past it one does."""
    tool, cutting, speed = case
    chart = stability_lobes(tool, cutting, [speed], method)
    assert chart.kind.tolist() == [kind]
    share = np.append(np.linspace(0.01, 0.9995, 100), 1.0005)
    largest = np.max(np.abs(arc_map(tool, cutting, speed, 20).multipliers(chart.depth[0] * share)), axis=-1)
    assert np.all(largest[:-1] < 1)
    assert largest[-1] > 1
