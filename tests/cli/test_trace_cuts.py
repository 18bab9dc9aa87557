"""Forces and test cuts through the command line: what is promised in JSON, what is written, what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import examples, jointlib, wrote

from machines import Step, read_machine, run
from machines.road.cutting import cutting_pieces

LIBRARY = Path("machines/library")
FORCES = LIBRARY / "end_mill_forces" / "forces.measurement.toml"
CUTS = LIBRARY / "end_mill_cuts" / "cuts.measurement.toml"
MILL = LIBRARY / "end_mill_cuts" / "mill.toml"


def test_identify_gives_coefficients_with_their_errors(here: Path) -> None:
    data = jointlib(f"identify {FORCES} -o x.cutting.toml --json").json
    assert {"parameters", "rms", "rms_unit", "method", "covariance", "file"} <= set(data)
    assert (data["method"], data["rms_unit"]) == ("instantaneous", "N")
    for name, true in (("tangential", 796e6), ("edge_normal", 31e3)):
        p = data["parameters"][name]
        assert abs(p["value"] - true) < 4 * p["standard_error"]
    told = jointlib("inspect x.cutting.toml").out
    assert "simulated coefficients of milling" in told
    assert "N/mm²" in told


def test_a_band_is_drawn_from_the_coefficients(here: Path) -> None:
    jointlib(f"identify {FORCES} -o x.cutting.toml")
    text = MILL.read_text().replace('tangential = "700 N/mm^2"\nnormal = "210 N/mm^2"', 'file = "x.cutting.toml"')
    Path("mill.toml").write_text(text)
    done = jointlib("lobes mill.toml --speed 9000 --samples 60 --method zero-order --json")
    assert done.status == 0, done.err
    low, _, high = (row[0] for row in done.json["band"]["depth"])
    assert low < high


def test_forces_with_laws_of_a_joint_are_refused(here: Path) -> None:
    for words in (f"identify {FORCES} --law linear -o j.toml", f"trace {FORCES} --machine {MILL} -o out"):
        done = jointlib(words)
        assert (done.status, len(done.complaints)) == (2, 1), done.err
        assert "cutting-force" in done.err
    assert not Path("out").exists()
    assert not Path("j.toml").exists()


def test_inspect_tells_the_cuts(here: Path) -> None:
    told = jointlib(f"inspect {CUTS}").out
    assert "simulated cuts measurement, 20 cuts" in told
    assert "chatter" in told


@pytest.mark.slow
def test_the_example_of_a_trace_of_cuts_works_and_says_what_to_cut(here: Path) -> None:
    (command,) = (one for one in examples("trace") if "end_mill_cuts" in one)
    done = jointlib(f"{command} --json")
    assert done.status == 0, done.err
    data = done.json
    assert data["chosen"]["family"] == "coefficient"
    page = Path(command.split("-o ")[1].split()[0], "report.html").read_text()
    assert data["sentence"] in page
    assert all(cut["name"] in page for cut in data["cuts"])
    assert data["chosen"]["parameters"]["factor"]["value"] == pytest.approx(1.5, rel=0.15)
    assert data["error_after"]["right"] > data["error_before"]["right"]
    assert data["error_after"]["log_score"] > data["error_before"]["log_score"]
    assert set(data["next_cut"]) >= {"speed", "depth", "probability"}
    again = jointlib(command)
    assert sorted(path.name for path in wrote(again)) == ["chart.svg", "machine.toml", "report.html", "trace.json"]
    assert "held-out cuts classified rightly" in again.out


@pytest.mark.slow
def test_a_run_holds_the_cuts_of_its_machine_against_the_lobes(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machines.cut_loop.trace_cuts.DRAWS", 40)
    Path("mill.toml").write_text(f'{MILL.read_text()}\n[[cuts]]\nmeasurement = "{CUTS}"\n')
    machine = read_machine("mill.toml")
    made = run(machine, "out", steps=[Step("cuts", lambda m, _: cutting_pieces(m, ())[-1:])])
    assert made.failed == []
    (step,) = made.data["steps"]
    trace = json.loads(Path("out/cuts.trace.json").read_text())
    assert (step["step"], step["verdict"]) == ("cuts", trace["verdict"])
    assert step["next_cut"]["speed"] == trace["next_cut"]["speed"]
    page = Path("out/report.html").read_text()
    assert trace["sentence"] in page
    assert "Cut next at" in page
    contradicted = any("contradict the machine file" in said for said in made.doubts)
    assert contradicted == (trace["verdict"] != "nothing_missing")
    assert made.advice[0] == trace["sentence"]


def test_cuts_of_a_machine_that_are_not_there_are_refused_before_work_begins(here: Path) -> None:
    Path("mill.toml").write_text(f'{MILL.read_text()}\n[[cuts]]\nmeasurement = "none.toml"\n')
    done = jointlib("run mill.toml -o out")
    assert (done.status, len(done.complaints)) == (2, 1), done.err
    assert "none.toml" in done.err
    assert not Path("out").exists()
