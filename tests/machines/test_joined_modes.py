"""Modes beyond those kept, joined into one a direction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from machines import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel

LOW = 1000.0
FLEXIBLE = (0, 1, 3, 7, 11)
"""Seeds of machines that keep less than a mode a direction, the others being far beyond."""


def test_a_mode_a_direction_is_kept_as_it_is() -> None:
    """But for the square of its damping ratio."""
    damping, shapes = [0.03, 1e-5, 2e-5], [[1, 1, 0.2], [0.3, 0.4, 1]]
    model = ToolModel.from_modes([400.0, 1500.0, 1700.0], damping, [1.0, 0.2, 0.3], shapes)
    lines, few = np.linspace(10, 4000, 200), model.up_to(LOW)
    assert np.sort(np.abs(few.poles)) == pytest.approx(2 * np.pi * np.array([400.0, 1500.0, 1700.0]), rel=1e-8)
    assert few(lines) == pytest.approx(model(lines), abs=1e-6 * float(np.max(np.abs(model(lines)))))


def test_a_mode_far_beyond_is_flexibility() -> None:
    model = ToolModel.from_modes([400.0, 9000.0], [0.03, 0.02], [1.0, 0.01], [[1, 1], [0.5, 0.4]])
    few = model.up_to(LOW)
    assert few.fastest == pytest.approx(2 * np.pi * 400)
    assert few(np.zeros(1)) == pytest.approx(model(np.zeros(1)), rel=1e-9)


@pytest.mark.parametrize("seed", [seed for seed in range(20) if seed not in FLEXIBLE])
def test_many_modes_beyond(seed: int) -> None:
    """As s⁶ is the first term that differs, half the frequency has 2⁻⁶ of the error; damping leaves some in s³."""
    rng = np.random.default_rng(seed)
    frequency = np.concatenate([rng.uniform(100, 900, 3), np.geomspace(1100, 9000, 8)])
    model = ToolModel.from_modes(frequency, np.full(11, 1e-6), rng.uniform(0.1, 1, 11), rng.normal(size=(2, 11)))
    few = model.up_to(LOW)

    def error(line: float) -> float:
        at = np.array([line])
        return float(np.linalg.norm((few(at) - model(at))[0].real))

    assert np.all(few.poles.real < 0)
    assert few.fastest <= 2 * 2 * np.pi * LOW
    assert error(200.0) < error(400.0) / 2**5.5
    assert len(few.poles) == 5
    flexible = ToolModel(few.poles[:3], few.inputs[:3], few.outputs[:3], few.direct, few.axes)
    rest = model(np.zeros(1))[0].real - flexible(np.zeros(1))[0].real
    alone = np.linalg.norm((flexible(np.array([400.0])) + rest - model(np.array([400.0])))[0].real)
    assert error(400.0) < alone / 20


@pytest.mark.slow
@pytest.mark.parametrize(
    "more", [pytest.param({"helix": 38.0}, marks=pytest.mark.thorough), {"pitch": (85.0, 95.0, 85.0, 95.0)}]
)
def test_collocation_of_a_cutter_joins_modes_that_would_ask_for_thousands_of_nodes(more: dict[str, Any]) -> None:
    """A mode at 300 kHz turns 8000 rad in a tooth period: no map could follow it, and nothing chatters there."""
    stiff = ToolModel.from_modes(
        [80.0, 900.0, 1100.0, 6e3, 3e5], [0.03] * 5, [400.0, 0.5, 0.6, 0.2, 0.01], [[1, 1, 0, 1, 1], [0, 0, 1, 1, -1]]
    )
    cutting = Cutting(
        process="milling", teeth=4, tangential=1.9e9, normal=6.5e8, immersion=0.5, mode="down", diameter=0.016, **more
    )
    speeds = np.array([4000.0])
    nodes, lines = (stability_lobes(stiff, cutting, speeds, method) for method in ("collocation", "multi-frequency"))
    np.testing.assert_allclose(nodes.depth, lines.depth, rtol=3e-5)
    assert any("act together" in said for said in nodes.warnings)
    assert not any("act together" in said for said in lines.warnings)
