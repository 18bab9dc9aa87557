"""Lenses: every depth at which the stability boundary is crossed, against the multipliers of collocation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.shown.progress import Silent
from machines import Lumped, Machine, lobes, lobes_at_amplitude
from machines.answers.told.lobes_over_amplitude import lenses_to
from machines.cutting.amplitude import unstable_depths as module
from machines.cutting.amplitude.unstable_depths import (
    UnstableDepths,
    closer_at_lenses,
    unstable_depths,
    unstable_depths_of,
)
from machines.cutting.amplitude.words import told_lenses
from machines.cutting.loops.collocation import ArcMap, arc_map
from machines.cutting.loops.edges import Edge, outside
from machines.lobes import Cutting, ToolModel, stability_lobes
from machines.tool.tool_point import tool_point

TOOL = ToolModel.from_modes([922.0], [0.011], [0.03993], [[1.0]], axes=("x",))
DOWN = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.1)
EXACT = ("collocation", "multi-frequency")
HALF = replace(DOWN, immersion=0.5)


def looked(
    tool: ToolModel, cut: Cutting, speed: float, method: str = "collocation", deepest: float | None = None
) -> UnstableDepths:
    point = tool if method == "collocation" else tool_point(tool, tool.axes, tool.lines)
    (found,) = unstable_depths_of(point, cut, stability_lobes(tool, cut, [speed], method), deepest)
    return found


def largest(arc: ArcMap, depth: Array) -> Array:
    """The largest |μ| at depths in m."""
    return np.asarray(np.max(np.abs(np.linalg.eigvals(arc.maps(depth))), axis=1))


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize(
    ("cut", "speed", "edges"),
    [(DOWN, 18000.0, [0.8156572, 3.118, 3.831]), (HALF, 10000.0, [2.104690, 2.3114, 2.3525])],
)
def test_a_flip_lens_closes_before_the_cut_chatters_again(
    method: str, cut: Cutting, speed: float, edges: list[float]
) -> None:
    first, second = looked(TOOL, cut, speed, method).intervals
    np.testing.assert_allclose(np.array([first.low, first.high, second.low]) * 1e3, edges, rtol=2e-4)
    assert (first.kind, first.end, second.kind, second.high) == ("flip", "flip", "hopf", np.inf)


@pytest.mark.parametrize(("cut", "speed"), [(DOWN, 18000.0), (HALF, 10000.0)])
def test_the_largest_multiplier_passes_one_at_every_edge_of_a_lens(cut: Cutting, speed: float) -> None:
    first, second = looked(TOOL, cut, speed).intervals
    edges = np.array([first.low, first.high, second.low])
    arc = arc_map(TOOL, cut, speed, 20)
    below, above = (largest(arc, edges * by) for by in (1 - 1e-4, 1 + 1e-4))
    assert np.all(np.sign(above - 1) == [1, -1, 1])
    assert np.all(np.sign(below - 1) == [-1, 1, -1])


@pytest.mark.thorough
def test_of_random_tools_what_is_unstable_has_a_multiplier_outside_the_unit_circle() -> None:
    """Depths from a grid that knows nothing of the crossings; those within 10⁻³ of an edge are left out."""
    random = np.random.default_rng(2)
    lenses = 0
    for _ in range(12):
        count = int(random.integers(1, 3))
        frequency, damping = random.uniform(300, 900, count), random.uniform(0.005, 0.04, count)
        tool = ToolModel.from_modes(
            frequency, damping, random.uniform(0.05, 0.5, count), random.normal(size=(1, count)), axes=("x",)
        )
        cut = replace(DOWN, mode=str(random.choice(["up", "down"])), immersion=float(random.uniform(0.03, 0.2)))
        # Periods double where a natural frequency is an odd multiple of half the tooth frequency.
        speed = 60 * frequency[0] / (2 * int(random.integers(0, 3)) + 1) * float(random.uniform(0.965, 0.99))
        found = looked(tool, cut, speed)
        depth = np.linspace(0.02, 0.98, 41) * found.deepest
        edges = np.array([end for one in found.intervals for end in (one.low, one.high) if np.isfinite(end)])
        depth = depth[np.all(np.abs(depth[:, None] / edges - 1) > 1e-3, axis=1)]
        grows = largest(arc_map(tool, cut, speed, 20), depth) > 1
        assert [found.unstable(b) for b in depth.tolist()] == grows.tolist()
        lenses += len(found.lenses)
    assert lenses > 0


def test_in_turning_what_is_once_unstable_stays_so_for_one_mode() -> None:
    """With one mode a deeper cut only adds unstable frequencies."""
    mode = ToolModel.from_modes([150.0], [0.03], [20.0], [[1.0]], axes=("x",))
    cut, speeds = Cutting("turning", specific=1e9), np.array([1800.0, 2400.0, 5000.0])
    chart = stability_lobes(mode, cut, speeds, "turning")
    found = unstable_depths_of(tool_point(mode, mode.axes, mode.lines), cut, chart)
    assert [len(one.intervals) for one in found] == [1, 1, 1]
    np.testing.assert_allclose([one.intervals[0].low for one in found], chart.depth, rtol=1e-9)


def mill(immersion: float) -> Machine:
    """The 922 Hz tool as a machine."""
    tool = Lumped("tool", ("x",), np.array([[0.03993]]), np.array([[5.0889]]), np.array([[1.34005e6]]))
    cutting = {"process": "milling", "teeth": 2, "tangential": 6e8, "normal": 2e8, "mode": "down"}
    cutting["immersion"] = immersion
    return Machine((tool,), (), tool={"x": "tool.x"}, frequency=(100.0, 4000.0), cutting=cutting)


def test_a_machine_has_the_lenses_of_its_tool_by_every_exact_method() -> None:
    machine = mill(0.1)
    found = [unstable_depths(machine, lobes_at_amplitude(machine, [18000.0], 0.0, m))[0] for m in EXACT]
    expected = looked(TOOL, DOWN, 18000.0)
    for one in found:
        ends = [(zone.low, zone.high) for zone in one.intervals]
        np.testing.assert_allclose(ends, [(zone.low, zone.high) for zone in expected.intervals], rtol=1e-3)


def test_a_picture_of_lenses_has_speeds_between_those_of_the_chart() -> None:
    machine = mill(0.1)
    chart = lobes_at_amplitude(machine, np.linspace(17600.0, 18600.0, 6))
    found = closer_at_lenses(machine, chart, 5e-3)
    speeds = [one.speed for one in found]
    assert speeds == sorted(set(speeds))
    assert set(chart.speed.tolist()) < set(speeds)
    beside = [one.lenses for one in found if abs(one.speed - 18000.0) < 30]
    assert len(beside) > 1
    assert all(beside)


@pytest.mark.thorough
def test_a_picture_of_lenses_ends_with_its_time_and_says_what_is_missing() -> None:
    machine = mill(0.1)
    chart = lobes_at_amplitude(machine, np.linspace(17600.0, 18600.0, 6))
    found, said = lenses_to(machine, chart, 5e-3, 0.0, Silent())
    assert found == ()
    assert said == [
        "Time was up: stable cuts above the limits were looked for at 0 of 6 speeds; the picture draws all depths "
        "above the others as unstable."
    ]
    whole, nothing = lenses_to(machine, chart, 5e-3, 100.0, Silent())
    assert nothing == []
    assert len(whole) > 6


@pytest.mark.parametrize("method", EXACT)
def test_a_march_finds_the_lenses_of_even_teeth(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = mill(0.1)
    chart = lobes_at_amplitude(machine, [18000.0], 0.0, method)
    (plain,) = unstable_depths(machine, chart)
    monkeypatch.setattr(module, "_SLOW", 0)
    (marched,) = unstable_depths(machine, chart)
    assert len(marched.intervals) == len(plain.intervals) == 2
    for one, other in zip(plain.intervals, marched.intervals, strict=True):
        assert (one.kind, one.end) == (other.kind, other.end)
        np.testing.assert_allclose((other.low, other.high), (one.low, one.high), rtol=1e-4)


def test_the_words_name_the_stretch_that_is_stable_again() -> None:
    (said,) = told_lenses(looked(TOOL, DOWN, 18000.0))
    assert "chatters from 0.8157 to 3.118 mm (flip) and above 3.831 mm (hopf)" in said
    assert "stable again between 3.118 and 3.831 mm" in said
    assert told_lenses(looked(TOOL, DOWN, 5000.0)) == ()


def test_no_crossing_is_looked_for_below_the_limiting_depth() -> None:
    found = looked(TOOL, DOWN, 18000.0, deepest=0.5e-3)
    assert found.intervals == ()
    assert not found.unstable(0.4e-3)


def test_without_a_cut_there_is_nothing_unstable_to_look_for() -> None:
    machine = mill(0.1)
    chart = lobes_at_amplitude(machine, [18000.0])
    with pytest.raises(InputError, match="need"):
        unstable_depths(replace(machine, cutting=None), chart)


@pytest.mark.parametrize("method", EXACT)
def test_a_limit_just_inside_the_reach_is_kept(method: str) -> None:
    limit = float(stability_lobes(TOOL, DOWN, [18000.0], method).depth[0])
    for reach in (1.0005 * limit, 1.01 * limit, 1.03 * limit):
        (zone,) = looked(TOOL, DOWN, 18000.0, method, reach).intervals
        assert (zone.low, zone.high) == (pytest.approx(limit, rel=1e-4), np.inf)


def test_a_lost_crossing_is_an_error() -> None:
    """Where a pair would come back that never left, something was missed."""
    with pytest.raises(CheckFailed, match="missed"):
        outside([Edge(1e-3, 0.3, "hopf", outwards=False)])


def test_speeds_that_ask_for_too_many_harmonics_are_told_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machines.cutting.amplitude.unstable_depths.MOST_SEARCHED", 1)
    mill = Path("machines/library/two_mode_tool.toml")
    for speeds, at in (([9000.0], "9000"), ([8000.0, 9000.0, 10000.0], "8000, 9000 and 10000")):
        told = [
            said for said in lobes(mill, speed=speeds, method="multi-frequency").lines if "above the limits" in said
        ]
        assert told == [
            f"Stable cuts above the limits at {at} rpm are not known: multi-frequency: more than 1 harmonics would be "
            "needed to find the crossings"
        ]
