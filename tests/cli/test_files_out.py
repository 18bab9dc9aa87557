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


@pytest.mark.thorough
def test_receptances_go_out_one_file_per_force(here: Path) -> None:
    done = jointlib(f"frf {TWO_MASS} --force 10 50N --frequency 1kHz:2kHz -o out/x.csv --json")
    assert done.status == 0
    assert [Path(f).name for f in done.json["files"]] == ["x_10N.csv", "x_50N.csv"]
    result = response(read_machine(TWO_MASS), [10.0, 50.0], [1000.0, 2000.0], harmonics="auto", stability="auto")
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


@pytest.mark.slow
@pytest.mark.parametrize("amplitudes", ["", "--amplitude 0 1um"])
def test_lobes_as_a_picture_name_the_recommended_pocket(here: Path, amplitudes: str) -> None:
    data = jointlib(f"lobes {TOOL} {amplitudes} -o out/l.svg --json").json
    assert ET.parse("out/l.svg").getroot().tag.endswith("svg")
    assert data["pocket"]["depth"] < max(np.ravel(data["depth"]))
    assert data["pocket"]["margin"] > 0


def table(path: str) -> dict[str, list[float]]:
    rows = list(csv.DictReader(line for line in Path(path).read_text().splitlines() if line[0] != "#"))
    return {key: [float(row[key]) for row in rows] for key in rows[0] if key != "kind"}


@pytest.mark.slow
def test_the_table_has_safe_depth_and_band_where_they_are_computed(lathe: str) -> None:
    data = jointlib(f"lobes {lathe} --speed 2100 2350 --samples 60 -o out/l.csv --json").json
    columns = table("out/l.csv")
    low, middle, high = data["band"]["depth"]
    for name, values in (("low", low), ("median", middle), ("high", high)):
        np.testing.assert_allclose(columns[name], values, rtol=1e-9)
    # Safe is below the lowest over amplitude and below the lower end of the band.
    safe = np.minimum(data["over_amplitude"]["safe_depth"], low)
    np.testing.assert_allclose(columns["safe_depth"], safe, rtol=1e-9)


@pytest.mark.slow
def test_a_picture_of_a_machine_with_nonlinear_joints_draws_its_zones(lathe: str) -> None:
    plain = jointlib(f"lobes {lathe} --amplitude 0 -o out/plain.svg --json").json
    drawn = jointlib(f"lobes {lathe} --samples 40 -o out/zones.svg --json").json
    assert drawn["pocket"]["depth"] < plain["pocket"]["depth"]
    assert len(Path("out/zones.svg").read_text()) > len(Path("out/plain.svg").read_text())


@pytest.mark.slow
def test_the_receptance_goes_out_with_its_band(lathe: str) -> None:
    done = jointlib(f"frf {lathe} --force 5 --frequency 80Hz:140Hz:21 --samples 40 -o out/x.csv --json")
    assert [Path(f).name for f in done.json["files"]] == ["x.csv", "x_band.csv"]
    band = done.json["band"]
    size = np.array(band["size"], dtype=float)[0, :, :, 0]
    assert np.all(np.diff(size, axis=0) > 0)
    columns = table("out/x_band.csv")
    np.testing.assert_allclose(columns["frequency"], np.linspace(80, 140, 21), rtol=1e-9)
    np.testing.assert_allclose([columns[k] for k in ("low", "median", "high")], size, rtol=1e-9)
    assert jointlib(f"frf {lathe} --force 5 --frequency 80Hz:140Hz:21 --samples 40 -o out/x.npz").status == 0
    with np.load("out/x.npz") as arrays:
        np.testing.assert_allclose(arrays["band"][0, :, :, 0], size, rtol=1e-9)


def test_a_band_that_cannot_be_is_refused_before_anything_is_computed(lathe: str) -> None:
    done = jointlib(f"frf {TWO_MASS} --samples 40 -o out/x.csv")
    assert done.status == 2
    assert "nothing to sample" in done.err
    assert "no room for a band" in jointlib(f"frf {lathe} --force 5 --samples 40 -o out/x.frf").err
    assert not list(Path().glob("out/*"))
