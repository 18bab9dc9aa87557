"""What a study takes: no machine that falls over, none that another beats in every way, by a command that runs."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from groover_file import groover_file

from jointlib.errors import InputError
from machines import read_machine
from machines.answers.lobes import lobes
from machines.answers.study import StudyResults, study

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
