"""What a study takes: no machine that falls over, none that another beats in every way, by a command that runs."""

from __future__ import annotations

import html
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from groover_file import groover_file

from jointlib.errors import InputError
from machines import lobes_at_amplitude, read_machine
from machines.answers.lobes import lobes
from machines.answers.study import StudyResults, study
from machines.cutting.amplitude.pocket import told_depth

LIBRARY = Path(__file__).parents[2] / "machines" / "library"

PLAN = """schema = "jointlib/study/1"
base = "groover.toml"
[[factor]]
name = "neck"
path = "connection.neck.joint.linear.stiffness"
values = [{neck}]
[[factor]]
name = "slip"
path = "connection.neck.joint.jenkins.slip_force"
values = ["10 N", "25 N", "60 N"]
[conditions]
speed = ["2000 rpm", "12000 rpm"]
speeds = 80
amplitude = [0, "8 um"]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[[objective]]
quantity = "removal-rate"
goal = "max"
"""


def done(folder: Path, neck: str) -> StudyResults:
    groover_file(folder)
    (folder / "s.study.toml").write_text(PLAN.format(neck=neck))
    return study(folder / "s.study.toml", folder / "out", workers=1)


def test_a_machine_that_gives_way_is_ruled_out_and_counted(tmp_path: Path) -> None:
    """k of slide and neck in a row is below zero from −57 N/µm of the neck up to 0 with its slider of 12 N/µm."""
    found = done(tmp_path, '"30 N/um", "-60 N/um"')
    assert found.verdict is not None
    assert found.verdict.feasible == 3
    assert found.verdict.best is not None
    assert found.verdict.best.factors["neck"] == "30 N/um"
    assert found.remarks[0].startswith("3 of them have no results; the first: the machine does not stand by itself")


def test_lobes_say_of_it_that_it_does_not_stand(tmp_path: Path) -> None:
    file = groover_file(tmp_path)
    file.write_text(file.read_text().replace('"30 N/um"', '"-60 N/um"'))
    with pytest.raises(InputError, match="does not stand by itself: it gives way without any force"):
        lobes(read_machine(file))


@pytest.mark.slow
def test_no_design_beats_the_best_in_every_way_and_ends_without_a_say_are_not_told(tmp_path: Path) -> None:
    """The slip force does nothing to the lowest depth; of designs alike in it the one that removes most is taken."""
    found = done(tmp_path, '"30 N/um", "45 N/um"')
    verdict = found.verdict
    assert verdict is not None
    assert verdict.best is not None
    assert verdict.best.number in {design.number for design in verdict.front}
    depths = verdict.ranking.worst["minimum-depth"][:, 0]
    rates = verdict.ranking.worst["removal-rate"][:, 0]
    alike = np.isclose(depths, depths[verdict.best.number], rtol=1e-9)
    assert np.count_nonzero(alike) == 3
    assert rates[verdict.best.number] == np.max(rates[alike])
    assert np.ptp(rates[alike]) > 1e-9


def test_the_command_of_the_report_runs_where_the_study_was_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = done(Path(), '"30 N/um", "45 N/um"')
    page = (tmp_path / "out" / "report.html").read_text()
    command = shlex.split(page.split("Its lobes: ")[1].split("<")[0])
    assert command[:3] == ["jointlib", "lobes", "out/best.toml"]
    assert Path(command[2]).is_file()
    assert found.verdict is not None


TEETH = """schema = "jointlib/study/1"
base = "{base}"
[[factor]]
path = "cutting.immersion"
values = [{immersion}]
[[objective]]
quantity = "removal-rate"
goal = "max"
[conditions]
speeds = 70
"""


def two_teeth(folder: Path, quantity: str, immersion: float, mode: str = "up") -> StudyResults:
    """A study of the two-mode tool with two teeth, which wants the most of a quantity."""
    base = (LIBRARY / "two_mode_tool.toml").read_text("utf-8").replace("teeth = 3", "teeth = 2")
    (folder / "two.toml").write_text(base.replace('mode = "up"', f'mode = "{mode}"'), "utf-8")
    plan = TEETH.format(base="two.toml", immersion=immersion).replace("removal-rate", quantity)
    (folder / "s.study.toml").write_text(plan, "utf-8")
    return study(folder / "s.study.toml", folder / "out", workers=1)


@pytest.mark.parametrize(("immersion", "denied"), [(0.5, True), (0.15, False)])
def test_a_pocket_by_zero_order_is_held_against_the_exact_method(
    immersion: float, denied: bool, tmp_path: Path
) -> None:
    """With two teeth at half immersion zero order allows more than collocation, at less immersion it allows less."""
    found = two_teeth(tmp_path, "removal-rate", immersion)
    assert found.verdict is not None
    assert found.verdict.best is not None
    speed = found.verdict.best.results["pocket-speed"] * np.linspace(0.98, 1.02, 5)
    best = read_machine(tmp_path / "out" / "best.toml")
    said, exact = (np.min(lobes_at_amplitude(best, speed, 0.0, method).depth) for method in ("zero-order", None))
    assert (exact < 0.9 * said) is np.bool_(denied)
    assert found.exact.startswith("Do not cut as deep" if denied else "By the exact method")
    assert {told_depth(exact), told_depth(0.9 * said)} <= set(re.findall(r"[\d.]+ mm", found.exact))
    lines = found.words()
    assert lines[lines.index(found.exact) - 1].startswith("Take ")
    assert found.exact in html.unescape((tmp_path / "out" / "report.html").read_text("utf-8"))


EVERYWHERE = [(0.5, "down", True), (1.0, "up", False)]


@pytest.mark.parametrize(("immersion", "mode", "denied"), EVERYWHERE)
def test_a_depth_at_every_speed_by_zero_order_is_held_against_the_exact_method(
    immersion: float, mode: str, denied: bool, tmp_path: Path
) -> None:
    """What the exact method says at the lowest point of its chart stands below the answer."""
    found = two_teeth(tmp_path, "minimum-depth", immersion, mode)
    assert found.verdict is not None
    assert found.verdict.best is not None
    said = found.verdict.best.results["minimum-depth"]
    speeds = np.union1d(np.linspace(4000, 25000, 211), np.linspace(12700, 12900, 11))
    exact = lobes_at_amplitude(read_machine(tmp_path / "out" / "best.toml"), speeds).minimum_depth
    assert (exact < 0.99 * said) is denied
    assert found.exact.startswith("Do not cut" if denied else "By the exact method")
    told = float(re.findall(r"(?:chatters above|is stable below) ([\d.]+) mm", found.exact)[0]) * 1e-3
    assert told == pytest.approx(exact, rel=0.01)


def test_a_study_by_an_exact_method_is_not_checked_by_it_again(tmp_path: Path) -> None:
    plan = TEETH.format(base=LIBRARY / "two_mode_tool.toml", immersion=0.5).replace(
        "= 70", '= 5\nspeed = [15000, 15900]\nlobes = "collocation"'
    )
    (tmp_path / "s.study.toml").write_text(plan, "utf-8")
    assert study(tmp_path / "s.study.toml", tmp_path / "out", workers=1).exact == ""
