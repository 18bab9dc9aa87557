"""``jointlib new``: what it writes is read without remark and runs as it is; nothing is overwritten."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import LIBRARY, files, jointlib

from machines import read_machine
from machines.explore.scene import Explorer
from machines.mistakes import mistakes
from machines.study.study_file import read_study

CALLS = {
    "machine": ("m.toml", []),
    "joint": ("j.joint.toml", []),
    "measurement": ("v.measurement.toml", ["v.csv"]),
    "study": ("s.study.toml", ["s.toml"]),
}


@pytest.mark.parametrize("kind", CALLS)
def test_a_new_file_is_commented_named_and_never_overwritten(kind: str, here: Path) -> None:
    name, beside = CALLS[kind]
    before = files(here)
    done = jointlib(f"new {kind} -o {name} --json")
    assert (done.status, done.complaints) == (0, [])
    assert done.json == {"file": name, "beside": beside}
    assert files(here) - before == {Path(name), *map(Path, beside)}
    text = Path(name).read_text("utf-8")
    assert text.startswith("# ")
    assert f'schema = "jointlib/{kind}/1"' in text
    for path in (name, *beside):
        held = {p: Path(p).read_bytes() for p in (name, *beside)}
        for other in held.keys() - {path}:
            Path(other).unlink()
        again = jointlib(f"new {kind} -o {name}")
        assert (again.status, again.out) == (2, "")
        assert again.err.strip() == f"jointlib: {path}: exists already, expected the name of a new file"
        assert [p for p in held if Path(p).exists()] == [path]
        for p, content in held.items():
            Path(p).write_bytes(content)


@pytest.mark.thorough
def test_a_new_machine_runs(here: Path) -> None:
    assert jointlib("new machine -o m.toml").status == 0
    assert not mistakes(read_machine("m.toml"))
    inspected = jointlib("inspect m.toml --json").json
    assert inspected["warnings"] == []
    assert "connection guide (linear-guide): table – ground, hertz-contact + viscous, 16 contacts" in inspected["lines"]
    assert not [line for line in inspected["lines"] if "assumed" in line]
    modes = jointlib("modes m.toml")
    assert modes.status == 0, modes.err
    assert jointlib("check m.toml --json").json["passed"]
    frf = jointlib("frf m.toml --frequency 600:900:40 --harmonics 1 --drive spindle.x -o f.npz --json")
    assert frf.status == 0, frf.err
    assert 700 < frf.json["tool_peaks"][0]["frequency"] < 740
    lobes = jointlib("lobes m.toml --method zero-order --amplitude 1um --speed 4000 8000 --json")
    assert lobes.status == 0, lobes.err
    assert np.all(np.asarray(lobes.json["depth"]) > 1e-3)


def test_a_new_joint_has_a_describing_function_and_an_fmu(here: Path) -> None:
    assert jointlib("new joint -o sub/j.joint.toml").status == 0
    gain = jointlib("df sub/j.joint.toml --amplitude 0.1um 5um --frequency 500 --json").json
    stuck, slipping = (row[0] for row in gain["gain_real"])
    assert slipping < 0.95 * stuck
    assert gain["warnings"] == []
    fmu = jointlib("fmu sub/j.joint.toml --runtime python -o j.fmu --json")
    assert fmu.status == 0, fmu.err


def test_a_new_measurement_is_said_to_be_simulated_and_is_identified(here: Path) -> None:
    assert jointlib("new measurement -o v.measurement.toml").status == 0
    assert jointlib("inspect v.measurement.toml").out.startswith("simulated static measurement")
    done = jointlib("identify v.measurement.toml --law hertz-guide -o g.joint.toml --json")
    assert done.status == 0, done.err
    assert done.json["errors"][0]["relative"] < 0.01
    assert "the records are simulated" in json.dumps(done.json["messages"])


def test_a_new_study_names_its_machine_wherever_it_lies(here: Path) -> None:
    assert jointlib("new study -o a/m.toml --json").json["beside"] == ["a/m.machine.toml"]
    assert jointlib("new study --machine a/m.machine.toml -o b/s.study.toml --json").json["beside"] == []
    assert 'base = "../a/m.machine.toml"' in Path("b/s.study.toml").read_text()
    for file in ("a/m.toml", "b/s.study.toml"):
        assert len(read_study(file).factors) == 2


def test_what_cannot_be_made_is_said_and_leaves_nothing(here: Path) -> None:
    before = files(here)
    for words, said in {
        f"study --machine {LIBRARY}/lathe.toml -o s.toml": "no immersion and no teeth",
        "study --machine none.toml -o s.toml": "none.toml",
        "joint --machine none.toml -o s.toml": "--machine: given with a joint",
        "machine -o s.txt": ".toml",
    }.items():
        done = jointlib(f"new {words}")
        assert (done.status, done.out) == (2, "")
        assert said in done.err
        assert len(done.err.splitlines()) == 1
    assert files(here) == before


@pytest.mark.slow
def test_a_new_machine_takes_the_whole_road(here: Path) -> None:
    assert jointlib("new machine -o m.toml").status == 0
    done = jointlib("run m.toml -o out")
    assert done.status == 0, done.err
    report = Path("out/report.html").read_text("utf-8")
    assert "guide_1.upper_left_1 as an FMU" in report
    fmu = jointlib("fmu m.toml -o m.fmu --json")
    assert fmu.status == 0, fmu.err
    assert {c.group for c in Explorer(Path("m.toml")).controls} >= {"guide", "screw", "cutting"}


@pytest.mark.slow
def test_a_new_study_ends_with_a_best_machine(here: Path) -> None:
    assert jointlib("new study -o s.study.toml").status == 0
    data = jointlib("study run s.study.toml -o out --workers 1 --json").json
    assert data["done"] == data["total"] == 4
    assert read_machine(data["machine"]).cutting is not None
