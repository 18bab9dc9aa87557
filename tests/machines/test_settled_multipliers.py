"""Growth at a depth of tools with modes so fast that no map of a tooth period could follow them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from jointlib.errors import CheckFailed
from machines.cutting.cutters.pattern_map import pattern_map
from machines.cutting.cutters.pattern_multipliers import largest_multipliers
from machines.cutting.cutters.settled_multipliers import settled_multipliers
from machines.cutting.loops.characteristic import decided
from machines.cutting.process.cutter import Cutter
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


@pytest.mark.thorough
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


def test_slow_modes_that_hardly_die_out_in_a_tooth_period_are_the_growth_of_a_stable_cut() -> None:
    """A machine on its mounts has dozens of modes whose multipliers lie close together, far above those of chatter."""
    slow = np.geomspace(20.0, 300.0, 40)
    many = ToolModel.from_modes(
        [*slow, 900.0],
        [*np.full(40, 0.02), 0.03],
        [*np.full(40, 4e3), 0.5],
        np.array([[*np.cos(np.arange(40.0)), 1.0], [*np.sin(np.arange(40.0)), 0.8]]),
    )
    helix = replace(MILL, helix=38.0, diameter=0.016)
    rpm, depth = np.array([4000.0]), np.array([0.1e-3, 0.4e-3])
    found = settled_multipliers(many, helix, rpm, depth)[0]
    for mu, b in zip(found, depth.tolist(), strict=True):
        whole = np.abs(np.linalg.eigvals(pattern_map(many, Cutter.of(helix), rpm, b, 20).maps()))
        assert mu == pytest.approx(np.max(whole), rel=1e-6)
    # Nothing moves a slow mode at a depth far below the limit: it dies out as it does without a cut.
    assert found[0] == pytest.approx(np.exp(-0.02 * 2 * np.pi * slow[0] / (4000 / 60 * 2)), rel=1e-3)


def test_a_multiplier_that_still_changes_is_told_where_its_side_of_one_is_sure() -> None:
    sizes = [np.array([0.801, 2.31]), np.array([0.8013, 2.304]), np.array([0.8011, 2.3062])]
    np.testing.assert_allclose(decided(sizes), [0.801, 2.31], rtol=1e-12)
    assert decided([np.array([1.02]), np.array([1.01])]) is None
    assert decided([np.array([0.95]), np.array([1.5]), np.array([1.5001])]) is None


def test_a_depth_that_is_refused_takes_no_other_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    from machines.answers.told import lobes_growth
    from machines.cutting.amplitude import frozen_modes

    def refused(machine: object, speed: object, depth: object, amplitude: float) -> np.ndarray:
        if np.any(np.asarray(depth) == 1e-3):
            raise CheckFailed("still changes")
        return np.full((1, np.size(depth)), 0.9)

    monkeypatch.setattr(frozen_modes, "multipliers", refused)
    growth, said = lobes_growth.grown(None, [4000.0], [0.5e-3, 1e-3], (), witness=False)
    np.testing.assert_array_equal(growth, [[[0.9, np.nan]]])
    assert said == ["No multiplier at 4000 rpm and 1 mm: still changes"]
    assert lobes_growth.growth_tables(growth, [4000.0], [0.5e-3, 1e-3], ())[1].split() == ["4000", "0.9", "–"]
