"""The least depth over amplitude in turning: the same as from lines that are refined everywhere, for fewer of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.system import processes
from machines import Machine, read_machine
from machines.cutting.amplitude import chattering_tool
from machines.cutting.amplitude.frozen_lobes import frozen_lobes
from machines.cutting.amplitude.least_depth import least_depth, least_depth_at
from machines.cutting.rest.solve import stability_lobes
from machines.tool.at_rest import kept_tool

LATHE = Path(__file__).parents[2] / "machines" / "library" / "lathe.toml"
SPEED = np.linspace(800.0, 4000.0, 30)


@pytest.fixture(scope="module")
def lathe() -> Machine:
    return read_machine(LATHE)


@pytest.mark.parametrize("amplitude", [1e-6, 1e-5])
def test_lines_far_from_the_lowest_depth_decide_nothing(
    lathe: Machine, amplitude: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    chattering = chattering_tool.chattering

    def counted(tool: chattering_tool.OpenTool, *rest: object) -> object:
        asked.append(len(tool.frequency))
        return chattering(tool, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(chattering_tool, "chattering", counted)
    found, lines = [np.inf], []
    for _ in range(2):
        asked.clear()
        chattering_tool.known_tool.cache_clear()
        found.append(frozen_lobes(lathe, SPEED, amplitude, "turning", 80, found[-1])[0].minimum_depth)
        lines.append(sum(asked))
    assert found[2] == pytest.approx(found[1], rel=1e-9)
    assert lines[1] < 0.6 * lines[0]
    asked.clear()
    frozen_lobes(lathe, SPEED, amplitude, "turning", 80, found[1])
    assert sum(asked) < 0.3 * lines[1]  # those to begin with are known


@pytest.mark.slow
def test_the_least_depth_is_the_lowest_of_the_charts_over_amplitude(lathe: Machine) -> None:
    chart = stability_lobes(kept_tool(lathe), chattering_tool.Cutting(**dict(lathe.cutting or {})), SPEED)
    sizes: Array = np.array([1e-6, 4e-6])
    every = [frozen_lobes(lathe, SPEED, size, "turning")[0].minimum_depth for size in sizes.tolist()]
    depth, known = least_depth(lathe, chart, sizes)
    assert known == 4e-6
    assert depth == pytest.approx(min(chart.minimum_depth, *every), rel=1e-9)


@pytest.mark.thorough
def test_what_other_processes_found_of_the_tool_is_known_here_as_well(
    lathe: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    cutting = chattering_tool.Cutting(**dict(lathe.cutting or {}))
    chart = stability_lobes(kept_tool(lathe), cutting, SPEED)
    sizes: Array = np.array([1e-6, 2e-6, 4e-6])
    found, points = [], []
    for cores in (1, 2):
        chattering_tool.known_tool.cache_clear()
        monkeypatch.setattr(processes, "_free_cores", lambda cores=cores: cores)
        found.append(least_depth(lathe, chart, sizes))
        points.append([chattering_tool.known_tool(lathe, cutting, size).point for size in sizes.tolist()])
    assert found[0] == found[1]
    for here, there in zip(*points, strict=True):
        np.testing.assert_array_equal(here.frf.frequency, there.frf.frequency)
        np.testing.assert_array_equal(here.frf.receptance, there.frf.receptance)


@pytest.mark.slow
def test_at_given_speeds_lines_are_refined_wherever_these_chatter(lathe: Machine) -> None:
    """The lobe of a speed need not be near the lowest depth of all, so that no line may be left coarse."""
    speed = 3613.0 * np.linspace(0.98, 1.02, 5)
    cutting = chattering_tool.Cutting(**dict(lathe.cutting or {}))
    chart = stability_lobes(kept_tool(lathe), cutting, speed)
    chart = replace(chart, minimum_depth=1.0)
    whole = frozen_lobes(lathe, speed, 4e-6, "turning")[0]
    depth, known = least_depth_at(lathe, chart, np.array([4e-6]))
    assert (depth, known) == (pytest.approx(float(np.min(whole.depth)), rel=1e-12), 4e-6)
