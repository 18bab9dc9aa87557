"""The recommended depth holds at every speed for which it is said to hold, not at the speeds of the chart alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from groover_file import groover_file

from machines import lobes_at_amplitude, read_machine
from machines.answers.lobes import lobes
from machines.cutting.amplitude.lobes_over_range import lobes_over_range
from machines.cutting.amplitude.pocket import RESERVE, WANDER, Pocket, best_pocket, limit_of, pocket, told_depth
from machines.cutting.rest.chart_file import default_speeds
from machines.lobes import Cutting
from machines.model.machine import Machine
from machines.road.open_joints import with_joints
from machines.study.evaluation import Evaluation
from machines.study.study_file import read_study

LIBRARY = Path(__file__).parents[2] / "machines" / "library"


@pytest.fixture
def groover(tmp_path: Path) -> Path:
    return groover_file(tmp_path)


def recommended(machine: Machine, count: int, amplitudes: Sequence[float] = (0.0,)) -> Pocket:
    rest = lobes_over_range(machine, default_speeds(machine, count))
    charts = [lobes_at_amplitude(machine, rest.speed, A) if A else rest for A in amplitudes]
    best = pocket(charts, Cutting(**(machine.cutting or {})), limit_of(machine, amplitudes, rest.method))
    assert best is not None
    return best


def lowest(machine: Machine, speed: float, count: int, amplitudes: Sequence[float] = (0.0,)) -> float:
    """The lowest limit in the whole band, by very many speeds."""
    band = speed * np.linspace(1 - WANDER, 1 + WANDER, count)
    return min(float(np.min(lobes_at_amplitude(machine, band, A).depth)) for A in amplitudes)


@pytest.mark.parametrize(("count", "amplitudes"), [(100, (0.0,)), (200, (0.0,)), (100, (0.0, 2e-6, 5e-6, 1e-5))])
def test_in_turning_the_depth_holds_at_the_edges_and_between_the_lines(
    groover: Path, count: int, amplitudes: tuple[float, ...]
) -> None:
    machine = read_machine(groover)
    best = recommended(machine, count, amplitudes)
    least = lowest(machine, best.speed, 2001, amplitudes)
    assert best.depth <= (1 - RESERVE) * least * (1 + 1e-5)
    assert best.depth >= (1 - RESERVE) * least * (1 - 1e-5)
    assert float(told_depth(best.depth).split()[0]) * 1e-3 <= best.depth


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two_mode_tool", "guide_mill"])
def test_in_milling_the_depth_holds_at_the_edges_and_between_the_lines(name: str) -> None:
    machine = with_joints(read_machine(LIBRARY / f"{name}.toml"))[0]
    best = recommended(machine, 100)
    assert best.depth <= (1 - RESERVE) * lowest(machine, best.speed, 401) * (1 + 1e-4)


def test_of_the_chart_alone_no_edge_is_taken_for_the_last_line_before_it() -> None:
    """The limit falls from 4 mm at 9374 rpm to 1 mm at 9475, past the edge of the band of 9273 rpm at 9458."""
    speeds = np.array([8970.0, 9071.0, 9172.0, 9273.0, 9374.0, 9475.0, 9576.0])
    cut = Cutting(process="turning", specific=1e9)
    depth = np.interp(speeds, [8970.0, 9374.0, 9475.0, 9576.0], [3e-3, 4e-3, 1e-3, 1e-3])
    near = best_pocket(speeds, depth, cut, at=3)
    assert near is not None
    assert near.depth == pytest.approx(0.9e-3)
    known = best_pocket(speeds, depth, cut, lambda n: np.interp(n, speeds, depth), at=3)
    assert known is not None
    assert known.depth == pytest.approx(0.9 * np.interp(9273 * 1.02, speeds, depth))


def test_the_best_speed_is_the_best_of_all_though_few_are_looked_at(groover: Path) -> None:
    machine, looked = read_machine(groover), []
    limit, cut = limit_of(machine, (0.0,), "turning"), Cutting(**(machine.cutting or {}))
    chart = lobes_at_amplitude(machine, np.linspace(2000, 12000, 100))

    def counted(speeds: np.ndarray) -> np.ndarray:
        looked.append(speeds.size)
        return limit(speeds)

    best = best_pocket(chart.speed, chart.sure, cut, counted)
    assert best is not None
    assert sum(looked) < 60
    for speed in chart.speed[(chart.speed > 5100) & (chart.speed < 11760)]:
        assert lowest(machine, speed, 41) * speed * 0.9 <= best.depth * best.speed * (1 + 1e-9)


def test_verb_and_study_recommend_depths_that_hold(groover: Path, tmp_path: Path) -> None:
    machine = read_machine(groover)
    verb = lobes(groover).data["pocket"]
    assert verb["depth"] <= 0.9 * lowest(machine, verb["speed"], 1001) * (1 + 1e-5)
    (tmp_path / "s.study.toml").write_text(
        'schema = "jointlib/study/1"\nbase = "groover.toml"\n'
        '[[factor]]\nname = "block"\npath = "component.block.mass[0][0]"\nvalues = ["2.4 kg", "3 kg"]\n'
        '[conditions]\nspeed = ["2000 rpm", "12000 rpm"]\nspeeds = 80\namplitude = [0, "5 um"]\n'
        '[[objective]]\nquantity = "pocket-depth"\ngoal = "max"\n'
    )
    found = Evaluation(read_study(tmp_path / "s.study.toml").source)(0, 2)
    least = lowest(machine, float(found["pocket-speed"][0]), 1001, (0.0, 5e-6))
    assert found["pocket-depth"][0] == pytest.approx(0.9 * least, rel=1e-4)
