"""Curves and charts as files that other programs read: CSV, CutPro receptances, a picture."""

from __future__ import annotations

import csv
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

from jointlib.io.frf_files import read_frfs
from machines import read_machine, response

TWO_MASS, TOOL = Path("machines/library/two_mass.toml"), Path("machines/library/two_mode_tool.toml")


def test_receptances_go_out_one_file_per_force(here: Path) -> None:
    done = jointlib(f"frf {TWO_MASS} --force 10 50N --frequency 1kHz:2kHz -o out/x.csv --json")
    assert done.status == 0
    assert [Path(f).name for f in done.json["files"]] == ["x_10N.csv", "x_50N.csv"]
    result = response(read_machine(TWO_MASS), [10.0, 50.0], [1000.0, 2000.0], stability="auto")
    for file, frf in zip(done.json["files"], result.frfs, strict=True):
        (found,) = read_frfs(Path(file))
        np.testing.assert_allclose(found.frequency, frf.frequency, rtol=1e-11)
        np.testing.assert_allclose(found.value, frf.receptance[:, 0, 0], rtol=1e-11)


def test_a_cutpro_file_has_even_lines_of_the_same_curve(here: Path) -> None:
    done = jointlib(f"frf {TWO_MASS} --force 10 --frequency 1kHz:2kHz:1001 -o out/x.frf --json")
    assert done.json["file"] == "out/x.frf"
    (found,) = read_frfs(Path("out/x.frf"))
    np.testing.assert_allclose(found.frequency, np.linspace(1000, 2000, 1001), rtol=1e-9)
    lines = np.linspace(1000.0, 2000.0, 1001)
    direct = response(read_machine(TWO_MASS), 10.0, lines).frfs[0].receptance[:, 0, 0]
    assert np.max(np.abs(found.value - direct)) < 1e-4 * np.max(np.abs(direct))


def test_a_range_without_solutions_leaves_no_half_written_cutpro_file(here: Path) -> None:
    done = jointlib(f"frf {TWO_MASS} --force 3000 --frequency 1kHz:2kHz:101 -o out/x.frf")
    assert done.status == 2
    assert "no solution inside the valid range" in done.err
    assert not list(Path().glob("out/*"))


def test_lobes_as_a_table_hold_what_the_command_prints(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 6000 9000 -o out/l.csv --json").json
    rows = list(csv.DictReader(line for line in Path("out/l.csv").read_text().splitlines() if line[0] != "#"))
    assert [float(r["speed"]) for r in rows] == [6000.0, 9000.0]
    np.testing.assert_allclose([float(r["depth"]) for r in rows], data["depth"], rtol=1e-9)
    assert [r["kind"] for r in rows] == data["kind"]
    assert "pocket" not in data


@pytest.mark.parametrize("amplitudes", ["", "--amplitude 0 1um"])
def test_lobes_as_a_picture_name_the_recommended_pocket(here: Path, amplitudes: str) -> None:
    data = jointlib(f"lobes {TOOL} {amplitudes} -o out/l.svg --json").json
    assert ET.parse("out/l.svg").getroot().tag.endswith("svg")
    assert data["pocket"]["depth"] < max(np.ravel(data["depth"]))
    assert data["pocket"]["margin"] > 0
