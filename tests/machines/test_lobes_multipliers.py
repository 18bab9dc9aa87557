"""Charts of multipliers: depths interpolated against depths computed one by one with more nodes."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from jointlib.arrays import Array
from machines.cutting.loops import multipliers
from machines.cutting.loops.characteristic import coefficients, largest_multiplier
from machines.cutting.loops.collocation import arc_map
from machines.cutting.loops.multipliers import largest_multipliers
from machines.lobes import Cutting, stability_lobes
from machines.tool.tool_model import ToolModel

TOOL = ToolModel.from_modes([922.0], [0.011], [0.03993], [[1.0]], ("x",))
SLOT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="slot")


def every_point(tool: ToolModel, cutting: Cutting, speed: Array, depth: Array) -> Array:
    """All eigenvalues of every map, with thirty nodes more than the rule asks for."""
    maps = [arc_map(tool, cutting, rpm, 40).maps(depth) for rpm in speed.tolist()]
    return np.array([np.max(np.abs(np.linalg.eigvals(one)), axis=1) for one in maps])


def refuse(*_: object) -> Array:
    raise AssertionError("computed depth by depth")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9))
def test_an_interpolated_chart_is_that_of_every_point_by_itself(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random tools, one and two directions, one to six teeth, up to ten times the limit of the slowest speed."""
    rng = np.random.default_rng(300 + seed)
    directions, modes = 1 + seed % 2, int(rng.integers(1, 5))
    natural = rng.uniform(300, 1200, modes)
    mass = 10 ** rng.uniform(6, 7, modes) / (2 * np.pi * natural) ** 2
    shapes, zeta = rng.normal(size=(directions, modes)), rng.uniform(0.005, 0.06, modes)
    tool = ToolModel.from_modes(natural, zeta, mass, shapes, ("x", "y")[:directions])
    mode = ("up", "down", "slot")[seed % 3]
    immersion = None if mode == "slot" else float(rng.uniform(0.05, 1))
    cutting = Cutting("milling", teeth=1 + seed % 6, tangential=6e8, normal=2e8, mode=mode, immersion=immersion)
    speed = np.sort(rng.uniform(8000, 24000, 4))
    depth = np.linspace(0, (3.0, 10.0)[seed % 2], 101)[1:] * np.min(stability_lobes(tool, cutting, speed[:1]).depth)
    monkeypatch.setattr(multipliers, "_one_by_one", refuse)
    chart, exact = largest_multipliers(tool, cutting, speed, depth), every_point(tool, cutting, speed, depth)
    assert np.max(np.abs(chart - exact) / np.maximum(exact, 1)) < 2e-7
    assert np.any(exact < 1)
    assert np.any(exact > 1)


def test_many_modes_that_last_alike_leave_rounding_in_the_terms_and_not_in_the_chart() -> None:
    rng = np.random.default_rng(11)
    natural = rng.uniform(50, 900, 20)
    mass = 10 ** rng.uniform(6.3, 8, 20) / (2 * np.pi * natural) ** 2
    tool = ToolModel.from_modes(natural, rng.uniform(0.01, 0.05, 20), mass, rng.normal(size=(2, 20)))
    cutting = Cutting("milling", teeth=4, tangential=6e8, normal=2e8, mode="down", immersion=0.5)
    speed, depth = np.array([6000.0, 9000.0, 16000.0]), np.linspace(0, 1e-3, 61)[1:]
    chart, exact = largest_multipliers(tool, cutting, speed, depth), every_point(tool, cutting, speed, depth)
    assert chart == pytest.approx(exact, rel=5e-7)
    assert np.any(exact > 1)


def test_depths_in_any_order_and_one_speed_give_the_same() -> None:
    depth = np.linspace(0, 2e-3, 61)[1:]
    mixed = np.random.default_rng(4).permutation(60)
    speed = np.array([18000.0, 9000.0, 12000.0])
    chart = largest_multipliers(TOOL, SLOT, speed, depth)
    assert largest_multipliers(TOOL, SLOT, speed, depth[mixed]) == pytest.approx(chart[:, mixed], rel=1e-7)
    assert largest_multipliers(TOOL, SLOT, speed[1:2], depth)[0] == pytest.approx(chart[1], rel=1e-7)
    assert largest_multipliers(TOOL, SLOT, speed, depth[::20]) == pytest.approx(chart[:, ::20], rel=2e-7)


def test_a_tool_that_forgets_everything_is_computed_too() -> None:
    """Real modes with which nothing lasts from one tooth to the next, at shallow cuts."""
    tool = ToolModel.from_modes([922.0], [1.0001], [0.03993], [[1.0]], ("x",))
    depth = np.linspace(0, 1e-6, 61)[1:]
    assert np.max(largest_multipliers(tool, SLOT, np.array([3000.0]), depth)) < 1e-2


@pytest.mark.parametrize("zeta", [0.3, 1.1])
def test_a_tool_that_forgets_within_a_tooth_period_is_computed_too(zeta: float) -> None:
    """Multipliers far below 1, or so far apart that depths are computed one by one."""
    tool = ToolModel.from_modes([922.0], [zeta], [0.03993], [[1.0]], ("x",))
    speed, depth = np.array([5000.0, 9000.0]), np.linspace(0, 4e-3, 61)[1:]
    chart, exact = largest_multipliers(tool, SLOT, speed, depth), every_point(tool, SLOT, speed, depth)
    assert np.min(exact) < 0.2
    assert chart == pytest.approx(exact, abs=2e-7)


def test_too_few_chebyshev_depths_are_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A few depths are told to be enough for sixty: every one is then computed by itself."""
    speed, depth = np.array([6000.0, 9000.0]), np.linspace(0, 4e-3, 61)[1:]
    alone = []
    single = multipliers._one_by_one
    monkeypatch.setattr(multipliers, "_FIRST", 4)
    monkeypatch.setattr(multipliers, "_LEFT", 0.5)
    monkeypatch.setattr(multipliers, "_one_by_one", lambda *at: (alone.append(at[2]), single(*at))[1])
    chart = largest_multipliers(TOOL, SLOT, speed, depth)
    assert sorted(alone) == [6000.0, 9000.0]
    assert chart == pytest.approx(every_point(TOOL, SLOT, speed, depth), abs=1e-5)


@pytest.mark.thorough
def test_memory_beside_the_chart_does_not_grow_with_the_chart() -> None:
    beside = []
    for speeds, depths in ((3, 100), (3, 1500), (60, 100)):
        grid = np.linspace(12000, 20000, speeds), np.linspace(0, 2e-3, depths + 1)[1:]
        tracemalloc.start()
        chart = largest_multipliers(TOOL, SLOT, *grid)
        beside.append(tracemalloc.get_traced_memory()[1] - chart.nbytes)
        tracemalloc.stop()
    limit = 8 * multipliers._HELD * multipliers._BLOCK
    assert max(beside) < limit
    assert limit < 1e7


@pytest.mark.parametrize("scale", [1e-3, 1.0, 40.0])
@pytest.mark.parametrize("seed", range(4))
def test_squaring_finds_the_largest_multiplier(seed: int, scale: float) -> None:
    """Pairs and single ones, alone at the edge or four pairs on one circle, and zeros."""
    rng = np.random.default_rng(seed)
    size = np.ones((50, 4)) if seed == 3 else rng.uniform(0.1, 1, (50, 4))
    pairs = scale * size * np.exp(1j * rng.uniform(0, np.pi, (50, 4)))
    single = scale * rng.uniform(-0.95, 0.95, (50, 3))
    mu = np.concatenate([pairs, pairs.conj(), single, np.zeros((50, 2))], axis=1)
    assert largest_multiplier(coefficients(mu)) == pytest.approx(np.max(np.abs(mu), axis=1), rel=1e-8)
