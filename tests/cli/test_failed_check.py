"""A check that fails ends with exit status 1: not done, and not bad input either."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import pytest
from command_line import Done, files, jointlib


def failed(done: Done) -> None:
    assert done.status == 1
    # A slow computer hears of the progress first.
    assert done.err.splitlines()[-1].startswith("jointlib: ")
    assert "Traceback" not in done.err


def test_machines_that_differ_fail_the_check_and_still_print_their_numbers(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("machines.harmonic_balance.linear_check.TOLERANCE", 1e-300)
    done = jointlib("check machines/library/two_mass.toml --json")
    failed(done)
    assert done.json["passed"] is False
    assert done.json["max_relative_difference"] > 0
    assert "FAILED" in jointlib("check machines/library/two_mass.toml").out


@pytest.mark.slow
def test_a_run_with_a_failed_check_finishes_its_report_and_fails(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machines.harmonic_balance.linear_check.TOLERANCE", 1e-300)
    done = jointlib("run machines/library/paper_sdof.toml -o out")
    assert done.status == 1
    assert done.err.splitlines()[-1].startswith("jointlib: receptance coupling and python-control differ")
    assert Path("out/report.html").is_file()


@pytest.mark.parametrize("part", ["reference", "description"])
def test_an_fmu_that_was_changed_after_its_export_fails(part: str, here: Path) -> None:
    assert jointlib("fmu machines/library/guide.joint.toml -o guide.fmu").status == 0
    with zipfile.ZipFile("guide.fmu") as archive, zipfile.ZipFile("bent.fmu", "w") as bent:
        for name in archive.namelist():
            data = archive.read(name)
            if part == "reference" and name.endswith(".csv"):
                lines = data.decode().splitlines()
                lines[-1] = ",".join([*lines[-1].split(",")[:-1], "12345.0"])
                data = "\n".join(lines).encode()
            if part == "description" and name == "modelDescription.xml":
                data = data.replace(b'maxStep="', b'maxStep="9')
            bent.writestr(name, data)
    done = jointlib("fmu --verify bent.fmu --json")
    failed(done)
    assert done.out == ""
    assert len(done.err.splitlines()) == 1


def test_an_fmu_that_does_not_replay_its_reference_is_not_written(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy("machines/library/guide.joint.toml", "guide.joint.toml")
    monkeypatch.setattr("fmu.verify.TOLERANCE", -1.0)
    before = files(here)
    failed(jointlib("fmu guide.joint.toml -o out/guide.fmu"))
    assert files(here) == before
