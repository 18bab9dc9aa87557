"""Growth in the cut of any cutter for many tools at once: against eigenvalues of the map of one tool over a pattern."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from machines.cutting.cutters.many_tools import Teeth, Tools
from machines.cutting.cutters.pattern_map import pattern_map
from machines.cutting.process.cutter import Cutter
from machines.cutting.process.cutting import Cutting
from machines.tool.tool_model import ToolModel

MILL = Cutting("milling", teeth=4, mode="up", immersion=0.3, tangential=1.9e9, normal=7e8, diameter=0.012)


def tool(k: int) -> ToolModel:
    frequency = np.array([905.0, 960.0, 2100.0]) * (1 + 0.02 * k)
    return ToolModel.from_modes(frequency, [0.026, 0.028, 0.02], [0.9, 0.85, 0.25], [[1, 0, 1], [0.1, 1, 0.3]])


def side_by_side(models: list[ToolModel], tangential: np.ndarray, normal: np.ndarray, damping: np.ndarray) -> Tools:
    outputs = [one.weight[:, None] / 2 * one.outputs for one in models]
    parts = [one.poles for one in models], outputs, [one.inputs for one in models], [one.direct for one in models]
    return Tools(*(np.array(part) for part in parts), tangential, normal, damping)


@pytest.mark.parametrize(
    "change",
    [
        {"pitch": (70, 110, 85, 95)},
        {"pitch": (83, 97, 83, 97), "helix": 35.0},
        {"pitch": (70, 110, 85, 95), "helix": (30.0, 35.0, 30.0, 35.0)},
        {"helix": 40.0, "immersion": 0.9},
    ],
)
def test_many_tools_grow_as_the_map_of_each_says(change: dict[str, object]) -> None:
    """Forces in two ratios and flanks that rub on one of the tools."""
    cutting, depth, speed = replace(MILL, **change), 3e-3, 7000.0  # type: ignore[arg-type]
    models, force = [tool(k) for k in range(3)], np.array([1.0, 1.3, 0.8])
    normal, rubs = np.array([7e8, 9e8, 4e8]), np.array([0.0, 0.0, 4e4])
    fastest = max(one.fastest for one in models)
    tools = side_by_side(models, force * 1.9e9, normal, rubs)
    grown, angle = Teeth(cutting, (0, 1), speed, fastest).growth(tools, depth)
    for k, one in enumerate(models):
        own = replace(cutting, tangential=force[k] * 1.9e9, normal=normal[k], process_damping=rubs[k] or None)
        cutter = Cutter.of(own)
        value = np.linalg.eigvals(pattern_map(one, cutter, np.array([speed]), depth).maps()[0])
        largest = value[np.argmax(np.abs(value))]
        # A thousandth of a tooth's growth is about a thousandth of the depth.
        assert grown[k] == pytest.approx(np.log(abs(largest)) / len(cutter.flutes), abs=2e-4)
        assert angle[k] == pytest.approx(abs(np.angle(largest)), abs=2e-3)
