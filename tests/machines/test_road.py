"""The whole road for a machine as a function: what it returns, what is left out of it, what others add to it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from groover_file import groover_file
from lathe_file import lathe_file

from jointlib.errors import InputError
from jointlib.shown.progress import Silent
from machines import Machine, Piece, Run, Step, lobes_at_amplitude, read_machine, response, run, steps
from machines.forced_response.tool_peaks import tool_peaks
from machines.report import Section

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
BESIDE = """
from machines import Piece, Step
from machines.report import Section

def weigh(road):
    road.steps.append({"step": "weigh", "parts": len(road.machine.components)})
    road.sections.append(Section("Weighed", ["It has parts."]))

def pieces(machine, amplitudes):
    return [Piece("weigh", "Weighing", weigh, "Take it off the scales.")]

STEP = Step("weigh", pieces, after=("joints",))
"""


VERB = '''"""Mass of a machine."""

import click

@click.command("weigh")
@click.argument("machine")
def command(machine):
    from machines import read_machine

    click.echo(f"{len(read_machine(machine).components)} parts")
'''


class Told:
    """Progress that is kept."""

    def __init__(self) -> None:
        self.said: list[str] = []

    @contextmanager
    def step(self, what: str) -> Iterator[None]:
        """Keep it."""
        self.said.append(what)
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Told]:
    """A run of the two-mass machine without its FMU."""
    told = Told()
    folder = tmp_path_factory.mktemp("road") / "out"
    return run(LIBRARY / "two_mass.toml", folder, told, steps()[:-1]), told


@pytest.mark.thorough
def test_a_run_returns_what_every_step_found(done: tuple[Run, Told]) -> None:
    made, told = done
    assert made.failed == []
    assert made.check is not None
    assert made.check.passed
    assert made.responses[0].frfs
    assert made.exports == {}
    assert json.loads((made.folder / "run.json").read_text())["steps"] == json.loads(json.dumps(made.data["steps"]))
    assert (made.folder / "report.html").is_file()
    assert "checking the coupled machine against python-control" in told.said


@pytest.mark.thorough
def test_steps_are_listed_in_their_order_and_each_can_be_left_out(done: tuple[Run, Told], tmp_path: Path) -> None:
    assert [step.name for step in steps()] == ["joints", "mistakes", "picture", "coupling", "cutting", "fmu"]
    with pytest.raises(InputError, match="no step 'fnu', did you mean 'fmu'"):
        run(LIBRARY / "two_mass.toml", tmp_path / "never", steps=["fnu"])
    assert not (tmp_path / "never").exists()
    only = run(read_machine(LIBRARY / "two_mass.toml"), tmp_path, steps=["joints"])
    assert [step["step"] for step in only.steps] == ["df"]
    whole = {step["step"] for step in done[0].steps}
    assert {"df", "check", "frf"} <= whole


@pytest.mark.thorough
def test_a_step_of_ones_own_is_taken_and_stands_in_the_report(tmp_path: Path) -> None:
    def weigh(made: Run) -> None:
        made.sections.append(Section("Weighed", [f"It has {len(made.machine.components)} parts."]))

    def pieces(machine: Machine, amplitudes: Sequence[float]) -> list[Piece]:
        return [Piece("weigh", "Weighing", weigh, "Take it off the scales.")]

    run(LIBRARY / "two_mass.toml", tmp_path, steps=["joints", Step("weigh", pieces)])
    assert "It has 2 parts." in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.slow
def test_another_package_brings_a_step_by_entry_point(tmp_path: Path) -> None:
    about = tmp_path / "site" / "scales-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: scales\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[jointlib.steps]\nweigh = scales:STEP\n")
    (tmp_path / "site" / "scales.py").write_text(BESIDE)
    code = (
        f"import sys; sys.path.append({str(tmp_path / 'site')!r})\n"
        "from machines import run, steps\n"
        "print([step.name for step in steps()])\n"
        "few = [step for step in steps() if step.name not in ('fmu', 'coupling')]\n"
        f"made = run({str(LIBRARY / 'two_mass.toml')!r}, {str(tmp_path / 'out')!r}, steps=few)\n"
        "print([step for step in made.steps if step['step'] == 'weigh'])\n"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    names, weighed = printed.splitlines()
    assert "'joints', " in names
    assert "'weigh'" in names
    assert weighed == "[{'step': 'weigh', 'parts': 2}]"


@pytest.mark.thorough
def test_another_package_brings_a_verb_by_entry_point(tmp_path: Path) -> None:
    site = tmp_path / "site"
    about = site / "scales-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: scales\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[jointlib.verbs]\nweigh = scales:command\n")
    (site / "scales.py").write_text(VERB)
    call = f"import sys; sys.path.append({str(site)!r}); from jointlib.cli.main import main; main()"

    def said(*words: str) -> str:
        command = [sys.executable, "-c", call, *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    assert re.search(r"doctor .*\n  weigh +Mass of a machine\.\n", said("--help"))
    assert said("weigh", str(LIBRARY / "two_mass.toml")) == "2 parts\n"


@pytest.mark.slow
def test_four_lines_run_a_mill_and_draw_its_lobes(tmp_path: Path) -> None:
    made = run(
        LIBRARY / "guide_mill.toml",
        tmp_path / "out",
        steps=["joints", "mistakes", "coupling", "cutting"],
        amplitudes=[0.0],
    )
    (chart,) = made.charts.values()
    assert made.failed == []
    assert np.all(chart.depth > 0)
    assert made.identifications["guide"].joint.parameters
    assert made.traces["guide"].verdict.value
    assert any("Recommended" in said for said in made.advice)


@pytest.mark.slow
def test_the_machine_is_exported_whole_and_in_parts_with_the_joints_of_the_run(tmp_path: Path) -> None:
    made = run(LIBRARY / "two_mass.toml", tmp_path, steps=["fmu"])
    assert made.failed == []
    assert [step["step"] for step in made.steps] == ["fmu", "machine fmu", "ssp"]
    assert {"machine.fmu", "machine.ssp"} <= {path.name for path in made.written}
    loaded = LIBRARY / "two_mass.toml"
    text = loaded.read_text().replace("two_mass.joint.toml", str(LIBRARY / "two_mass.joint.toml"))
    (tmp_path / "loaded.toml").write_text(text + "\n[static]\ngravity = true\n")
    again = run(tmp_path / "loaded.toml", tmp_path / "loaded", steps=["fmu"])
    assert again.failed == []
    assert (tmp_path / "loaded" / "machine.fmu").is_file()
    assert not (tmp_path / "loaded" / "machine.ssp").exists()
    assert any("is not exported" in said and "[static]" in said for said in again.said)


def test_a_depth_is_called_safe_at_every_speed_only_where_it_was_looked_for_between_them() -> None:
    from machines.cutting.amplitude.pocket import told_depth
    from machines.road.cutting import _figures

    machine = read_machine(LIBRARY / "two_mode_tool.toml")
    few = lobes_at_amplitude(machine, np.array([9000.0, 15000.0]), 0.0, "multi-frequency")
    told = dict(_figures([(0.0, few)], None, machine))
    assert told["lowest depth at the speeds computed"] == told_depth(few.minimum_depth)
    every = replace(few, minimum_at=12000.0)
    assert "safe depth at every speed" in dict(_figures([(0.0, every)], None, machine))
    zero = lobes_at_amplitude(machine, few.speed, 0.0, "zero-order")
    assert "safe depth at every speed" in dict(_figures([(0.0, zero)], None, machine))


def test_the_safe_depth_of_a_run_is_the_one_that_knocks_leave(tmp_path: Path) -> None:
    """A joint that softens lets a knock chatter below what small vibrations bear: the tile tells that, or says so."""
    from machines.road.cutting import _figures
    from machines.road.knocks import safe_from_knocks

    machine = read_machine(lathe_file(tmp_path))
    chart = lobes_at_amplitude(machine, np.linspace(2000.0, 9000.0, 50))
    knocks = safe_from_knocks(machine, chart, 60.0, Silent())[0]["safe_at_every_speed"]
    assert knocks["depth"] < chart.minimum_depth
    told = dict(_figures([(0.0, chart)], None, machine, knocks))
    (label,) = told
    assert label.startswith("safe depth at every speed, knocks of up to ")
    assert float(told[label].split()[0]) <= knocks["depth"] * 1e3
    assert "safe depth at every speed, larger vibrations left out" in dict(_figures([(0.0, chart)], None, machine))


def test_what_a_knock_does_at_the_best_speed_is_told(tmp_path: Path) -> None:
    from machines.cutting.amplitude.pocket import Pocket
    from machines.road.knocks import knocks_in_pocket

    machine = read_machine(groover_file(tmp_path))
    chart = lobes_at_amplitude(machine, np.linspace(2000.0, 12000.0, 50))
    best = Pocket(9172.0, 3e-3, 4e-3, None)
    data, said = knocks_in_pocket(machine, chart, best, 60.0, Silent())
    knocks, speeds = data["knocks"], best.speed * np.linspace(0.98, 1.02, 5)
    for size in knocks["amplitude"] * np.array([0.2, 0.5, 1.0]):
        assert np.min(lobes_at_amplitude(machine, speeds, size).depth) >= 0.98 * knocks["depth"]
    assert knocks["depth"] < best.depth
    assert said[0].startswith("A knock at the recommended speed may start chatter that lasts: below ")
    shallow = replace(best, depth=0.5 * knocks["depth"])
    assert knocks_in_pocket(machine, chart, shallow, 60.0, Silent()) == ({}, [])


@pytest.mark.parametrize("seconds", [60.0, 0.0])
def test_joints_that_remember_have_further_harmonics_where_time_allows(
    seconds: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 20 N the neck slips and one harmonic is 1.4 % off at the first peak; where time is up that is what is told."""
    monkeypatch.setattr("machines.road.coupling._OVERTONES", seconds)
    file = groover_file(tmp_path)
    road = run(file, tmp_path / "out", None, [step for step in steps() if step.name == "coupling"])
    told = json.loads((tmp_path / "out" / "frf.json").read_text())["tool_peaks"]
    peak = next(one for one in told if one["force"] == 20)
    best = tool_peaks(response(read_machine(file), 20.0, harmonics="auto" if seconds else 1))[0]
    assert peak["compliance"] == pytest.approx(best.compliance, rel=1e-9)
    assert any("one harmonic alone is off" in warning for warning in road.warnings) is not bool(seconds)
