"""Every verb has the same depth of a machine: lobes, study and explorer, whatever band its file asks for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_machines import random_machine

from machines import Machine, lobes_at_amplitude, read_machine
from machines.cutting.rest.solve import stability_lobes
from machines.cutting.rest.together import Limits, limits, preview
from machines.explore.built import Built
from machines.lobes import Cutting
from machines.study.variants import Variant
from machines.tool.at_rest import tool_at_rest

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
SEEDS = [1, 2, 3, 5, 8]


def agreed(machine: Machine) -> None:
    """The preview of `lobes`, of a study and of the explorer, and their limits at three speeds."""
    cutting = Cutting(**dict(machine.cutting or {}))
    low, high = cutting.speed or (2000.0, 8000.0)
    speeds, method = np.array([low, (low * high) ** 0.5, high]), preview(cutting.process)
    chart = lobes_at_amplitude(machine, speeds, method=method)
    model = Variant(machine).modes
    if model is None:  # no sum of modes is the machine, so a study goes by lines
        by_lines = stability_lobes(tool_at_rest(machine), cutting, speeds, method)
        of_study = Limits(np.array([by_lines.minimum_depth]), by_lines.depth[None])
    else:
        of_study = limits([model], [cutting], method, speeds[None])
    built = Built(machine, True)
    of_explorer = built.quick_lobes(speeds, 0.0, cutting, built.rest)
    for other in (of_study.minimum_depth[0], of_explorer.minimum_depth):
        assert other == pytest.approx(chart.minimum_depth, rel=1e-9)
    for depth in (of_study.depth[0], of_explorer.depth):
        np.testing.assert_allclose(depth, chart.depth, rtol=1e-8)


@pytest.mark.parametrize("name", ["two_mode_tool", "lathe"])
@pytest.mark.parametrize("band", ["as it is", "too narrow", "none"])
def test_library_machines_have_one_depth(name: str, band: str) -> None:
    machine = read_machine(LIBRARY / f"{name}.toml")
    bands = {"as it is": machine.frequency, "too narrow": (20.0, 150.0), "none": None}
    agreed(replace(machine, frequency=bands[band]))


@pytest.mark.parametrize("seed", SEEDS)
def test_random_machines_have_one_depth(seed: int) -> None:
    agreed(random_machine(seed))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20, 60))
def test_many_random_machines_have_one_depth(seed: int) -> None:
    agreed(random_machine(seed))
