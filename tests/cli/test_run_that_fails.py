"""A run whose steps fail still ends with a report: why, what to do, and everything that does not stand on them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from command_line import jointlib
from test_run import read

import machines
from jointlib.errors import InputError

TWO_JOINTS = """
schema = "jointlib/machine/1"
name = "two joints"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[25.33]]
[[connection]]
name = "guide"
between = ["slide.x", "ground"]
joint = "guide.joint.toml"
[[connection]]
name = "screw"
between = ["slide.x", "ground"]
identify = { from = ["screw.measurement.toml"], start = "guide.joint.toml" }
[tool]
x = "slide.x"
[response]
force = [10]
frequency = ["60 Hz", "200 Hz"]
"""
STATIC = """
schema = "jointlib/measurement/1"
kind = "static"
[[channel]]
name = "z"
quantity = "displacement"
unit = "um"
[[channel]]
name = "F"
quantity = "force"
unit = "N"
[[record]]
file = "screw.csv"
role = "fit"
"""


@pytest.fixture
def forced(lathe: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """The lathe, with a force on its slide; its joint is not compiled."""
    monkeypatch.setattr("fmu.members.build.compilers", lambda: ())
    path = Path(lathe)
    path.write_text(path.read_text().replace("[response]", "[response]\nforce = [10]"))
    return lathe


def failures(folder: Path) -> dict[str, str]:
    """Failed steps and their reasons."""
    steps = json.loads((folder / "run.json").read_text())["steps"]
    return {f"{s['step']} {s.get('joint', s.get('of', ''))}".strip(): s["failed"] for s in steps if "failed" in s}


@pytest.mark.slow
def test_a_joint_that_cannot_be_identified_leaves_the_others(lathe: str) -> None:
    Path("two.toml").write_text(TWO_JOINTS)
    Path("screw.measurement.toml").write_text(STATIC)
    Path("screw.csv").write_text("z,F\n0,0\n1,abc\n2,20\n")
    done = jointlib("run two.toml -o out")
    assert done.status == 1
    assert "Traceback" not in done.err
    assert "Identification of screw: " in done.err.splitlines()[-1]
    assert done.out.count("Identification of screw: ") == 0  # a failure is told once, in the end
    found = failures(Path("out"))
    assert set(found) == {
        "identify screw",
        "trace screw",
        "df screw",
        "check",
        "frf",
        "fmu screw",
        "machine fmu",
        "ssp",
        "mistakes",
    }
    assert "screw.csv" in found["identify screw"]
    assert found["frf"] == "it needs what is missing: identification of screw"
    left = {path.name for path in Path("out").iterdir()}
    assert left == {"guide.df.json", "guide.fmu", "report.html", "run.json"}
    text = read(Path("out"))
    for said in (
        "Not all of it stands.",
        "Identification of screw: not computed",
        found["identify screw"],
        "name a joint file in the machine file",
        "Forced response: not computed",
        "guide as an FMU",
    ):
        assert said in text, said


@pytest.mark.slow
def test_a_chart_that_fails_leaves_the_others_and_is_told_beside_the_recommendation(
    forced: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = machines.lobes_at_amplitude

    def guarded(machine: Any, speeds: Any, amplitude: float, *more: Any) -> Any:
        if amplitude == 5e-6:
            raise InputError("collocation: 9880 nodes for modes of up to 288562 Hz, expected fewer")
        return whole(machine, speeds, amplitude, *more)

    monkeypatch.setattr("machines.cutting.amplitude.frozen_lobes.lobes_at_amplitude", guarded)
    done = jointlib("run lathe.toml -o out --amplitude 0 5um 10um")
    assert done.status == 1
    assert list(failures(Path("out"))) == ["lobes a tool-point amplitude of 5 um"]
    assert "9880 nodes" in done.err.splitlines()[-1]
    assert "9880 nodes" in read(Path("out"))
    first, second = done.out.splitlines()[0], "The limits at a tool-point amplitude of 5 um are not known."
    assert first.startswith("Recommended: ")
    assert second in done.out
    assert json.loads(Path("out/lobes.json").read_text())["amplitude"] == [0.0, 1e-5]
    assert Path("out/guide.fmu").is_file()


@pytest.mark.slow
def test_without_the_first_chart_nothing_is_recommended(forced: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def guarded(*_: Any) -> Any:
        raise InputError("refused")

    monkeypatch.setattr("machines.cutting.amplitude.lobes_over_range.lobes_over_range", guarded)
    done = jointlib("run lathe.toml -o out --amplitude 0 5um")
    assert done.status == 1
    assert "Recommended" not in done.out + read(Path("out"))
    assert done.out.startswith("No speed and depth are recommended: the limits at vanishing vibration are not known.")


@pytest.mark.slow
def test_what_nobody_expected_ends_no_run_and_says_where_it_arose(forced: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("machines.forced_response.each_drive.response", broken)
    done = jointlib("run lathe.toml -o out --amplitude 0 --json")
    assert done.status == 1
    assert "Traceback" not in done.err
    (step,) = [s for s in done.json["steps"] if "failed" in s]
    assert step["step"] == "frf"
    assert step["failed"].startswith(
        "unexpected: ZeroDivisionError: division by zero, in machines/forced_response/each_drive.py line "
    )
    assert "please report it" in step["remedy"]
    assert {s["step"] for s in done.json["steps"] if "failed" not in s} == {"df", "check", "lobes", "fmu"}
    assert "Stability lobes" in read(Path("out"))
