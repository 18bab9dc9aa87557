"""Charts go on: where two crossings meet, where a speed settles nowhere, and where zones would take too long."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from jointlib import CheckFailed, read_joint
from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.shown.progress import Silent
from machines import lobes_at_amplitude, read_machine
from machines.answers.told.lobes_over_amplitude import zones_of
from machines.cutting.amplitude import lobes_over_range as ranged
from machines.cutting.loops import critical_depth
from machines.cutting.loops.critical_depth import near
from machines.cutting.loops.loop_branches import NONE, Bracket, Crossing, Loop, closed, regeneration

ROOT = Path(__file__).parents[2]
TOOL = """
schema = "jointlib/machine/1"
name = "long-cutter"

[[component]]
name = "tool"
kind = "modal"
dofs = ["x", "y"]
frequency = {frequency}
damping_ratio = {damping}
modal_mass = {mass}
shapes = {shapes}

[tool]
x = "tool.x"
y = "tool.y"

[cutting]
process = "milling"
teeth = 2
mode = "down"
immersion = 0.6
tangential = "750 N/mm^2"
normal = "200 N/mm^2"
feed = "0.06 mm"
speed = [6000, 24000]
"""
FREQUENCIES, DAMPING, MASSES = (880.0, 2887.0, 4047.0), (0.0087, 0.0082, 0.0059), (0.9, 0.42, 0.0068)


def round_tool(folder: Path) -> Path:
    """A tool with the same three modes in both directions: every eigenvalue of its loop has a twin."""
    twice = [[value for value in values for _ in "xy"] for values in (FREQUENCIES, DAMPING, MASSES)]
    shapes = [[1, 0] * 3, [0, 1] * 3]
    file = folder / "tool.toml"
    file.write_text(TOOL.format(frequency=twice[0], damping=twice[1], mass=twice[2], shapes=shapes), encoding="utf-8")
    return file


@pytest.mark.parametrize("lost", ["first", "every"])
def test_where_two_crossings_meet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lost: str) -> None:
    """At the edge of a lobe Newton's method may not find on more harmonics what fewer had: those are searched."""
    machine = read_machine(round_tool(tmp_path))
    found = lobes_at_amplitude(machine, [7375.5], method="multi-frequency")
    calls: list[Crossing] = []

    def loses(loop: Loop, crossing: Crossing) -> Crossing:
        calls.append(crossing)
        return NONE if lost == "every" or len(calls) == 1 else near(loop, crossing)

    monkeypatch.setattr(critical_depth, "near", loses)
    again = lobes_at_amplitude(machine, [7375.5], method="multi-frequency")
    assert calls
    assert float(again.depth[0]) == pytest.approx(float(found.depth[0]), rel=1e-6)
    assert again.chatter_frequency[0] == pytest.approx(found.chatter_frequency[0], rel=1e-6)


@pytest.mark.thorough
def test_a_speed_that_does_not_settle_takes_no_other_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = read_machine(round_tool(tmp_path))
    speeds = np.linspace(9000, 9040, 5)
    whole = ranged.lobes_over_range(machine, speeds)

    def refuses(machine: object, speed: ArrayLike, *further: object) -> object:
        if np.any(np.asarray(speed) == speeds[2]):
            raise CheckFailed("at 9020 rpm the depth still changes")
        return lobes_at_amplitude(machine, speed, *further)  # type: ignore[arg-type]

    monkeypatch.setattr(ranged, "lobes_at_amplitude", refuses)
    for budget in (np.inf, 60.0):
        chart = ranged.lobes_over_range(machine, speeds, budget=budget)
        assert speeds[2] not in chart.speed
        assert np.all(np.isin(np.delete(speeds, 2), chart.speed))
        assert chart.minimum_depth == pytest.approx(whole.minimum_depth, rel=1e-4)
        assert any("9020 rpm" in said and "still changes" in said for said in chart.warnings)
    short = ranged.lobes_over_range(machine, speeds[1:4])
    assert short.speed.tolist() == speeds[[1, 3]].tolist()
    assert any("9020 rpm" in said for said in short.warnings)


def test_zones_that_take_longer_than_the_budget_are_left_out() -> None:
    library = ROOT / "machines" / "library"
    machine = read_machine(library / "guide_mill.toml").with_joint(
        "guide", read_joint(library / "guide_mill" / "start.joint.toml")
    )
    chart = lobes_at_amplitude(machine, [10460.0])
    zones, said = zones_of(machine, [chart], (), 100.0, 150.0, Silent())
    assert zones is None
    (left_out,) = said
    assert left_out.startswith(
        "Zones over amplitude were left out: 3 charts that take 100 s each are more than the 150 s"
    )


def test_limits_whose_largest_amplitude_takes_all_the_time_are_left_out_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Joints that slip make a large amplitude hundreds of times dearer than the median."""
    from machines.answers.told.lobes_over_amplitude import over_amplitude

    asked = list[float]()

    def needed(machine: object, cutting: object, size: float, enough: float) -> float:
        asked.append(size)
        return 2000.0 if size > 1e-5 else 10.0

    monkeypatch.setattr("machines.cutting.amplitude.chattering_tool.seconds_of_chart", needed)
    monkeypatch.setattr("machines.cutting.forced.forced_vibration.too_many", lambda machine: 50)
    library = ROOT / "machines" / "library"
    machine = read_machine(library / "guide_mill.toml").with_joint(
        "guide", read_joint(library / "guide_mill" / "start.joint.toml")
    )
    data, (said,) = over_amplitude(machine, [10460.0], [], None, [], None, 300.0, Silent())
    assert "over_amplitude" not in data
    assert said.startswith("Limits over amplitude were left out: with 50 joints that depend on it ")
    assert "takes 33 minutes or more, so that fewer than 3 of 16 amplitudes are known after the 300 s" in said
    assert len(asked) == 1


def test_a_loop_that_jumps_past_the_circle_has_no_crossing_there() -> None:
    """As a receptance that is taken for zero past its band: a line leaves it between two ν."""

    def loop(fraction: Array) -> ComplexArray:
        turned = np.where(fraction < 0.137, complex(-20.0, 4.0), complex(-3.0, -9.0))
        return np.asarray((turned / regeneration(fraction))[:, None, None])

    start, end = (complex(loop(np.array([nu]))[0, 0, 0]) for nu in (0.1, 0.2))
    assert closed(loop, Bracket(0.0, 0.1, 0.2, start, end)) is None
