"""The keys that programs rely on: there, of the promised type, and the numbers of the Python interface."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import jointlib

from fmu.members.build import PLATFORMS, Compiler, can_compile
from fmu.members.build import here as this_platform
from fmu.verify import verify_fmu
from jointlib import identify, read_joint, read_measurement
from jointlib.describing import DescribingFunction
from machines import linear_check, lobes_at_amplitude, read_machine, response

LIBRARY = Path("machines/library")
GUIDE = LIBRARY / "guide.joint.toml"
TWO_MASS = LIBRARY / "two_mass.toml"
TOOL = LIBRARY / "two_mode_tool.toml"
RIG = LIBRARY / "guide_mill" / "rig.measurement.toml"
STATIC = LIBRARY / "guide_mill" / "static.measurement.toml"


def test_df_gives_gains_by_amplitude_and_frequency(here: Path) -> None:
    done = jointlib(f"df {GUIDE} --amplitude 1um 3um 5um --frequency 500 1kHz --json")
    assert (done.status, done.complaints) == (0, [])
    data = done.json
    assert data["amplitude"] == [1e-6, 3e-6, 5e-6]
    assert data["frequency"] == [500.0, 1000.0]
    A, omega = np.array(data["amplitude"]), 2 * np.pi * np.array(data["frequency"])
    G = DescribingFunction(read_joint(GUIDE))(A[:, None], omega)
    np.testing.assert_array_equal(data["gain_real"], G.real)
    np.testing.assert_array_equal(data["gain_imag"], G.imag)
    np.testing.assert_allclose(data["gain_imag"], np.broadcast_to(503 * omega, (3, 2)), rtol=1e-12)


def test_df_takes_a_bias_and_warns_outside_the_range_of_identification(here: Path) -> None:
    Path("j.toml").write_text(GUIDE.read_text() + "\n[validity]\namplitude = [0, 4e-6]\n")
    data = jointlib("df j.toml --amplitude 1um 5um --frequency 500 --bias 2um --json").json
    G = DescribingFunction(read_joint(GUIDE), 2e-6)(np.array([1e-6, 5e-6]), 1000 * np.pi)
    np.testing.assert_array_equal(np.ravel(data["gain_real"]), G.real)
    assert ["5 um" in w and "1 um" not in w for w in data["warnings"]] == [True]


def test_check_tells_how_far_the_two_machines_differ(here: Path) -> None:
    for given, amplitude in (("", None), ("--amplitude 2um", 2e-6)):
        data = jointlib(f"check {TWO_MASS} {given} --json").json
        assert set(data) == {"max_relative_difference", "passed", "excluded", "warnings"}
        assert (
            data["max_relative_difference"] == linear_check(read_machine(TWO_MASS), amplitude).max_relative_difference
        )
        assert 0 < data["max_relative_difference"] < 1e-8
        assert (data["passed"], data["excluded"]) == (True, [])


def test_check_names_a_slider_at_rest_as_excluded(here: Path) -> None:
    slider = '{ law = [{ kind = "linear", stiffness = "100 N/um" }, { kind = "coulomb", slip_force = 5 }] }'
    Path("m.toml").write_text(TWO_MASS.read_text().replace('"two_mass.joint.toml"', slider))
    (left_out,) = jointlib("check m.toml --json").json["excluded"]
    assert (left_out["connection"], left_out["law"]) == ("guide", "coulomb")
    assert left_out["reason"]
    assert jointlib("check m.toml --amplitude 1um --json").json["excluded"] == []


def test_lobes_without_amplitude_are_lists_over_speed(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 6000 9000rpm 12000 --json").json
    assert "amplitude" not in data
    assert "multiplier" not in data
    chart = lobes_at_amplitude(read_machine(TOOL), [6000.0, 9000.0, 12000.0])
    assert data["speed"] == [6000.0, 9000.0, 12000.0]
    np.testing.assert_array_equal(data["depth"], chart.depth)
    np.testing.assert_array_equal(data["chatter_frequency"], chart.chatter_frequency)
    assert data["lobe"] == [int(k) for k in chart.lobe]
    assert set(data["kind"]) <= {"hopf", "flip"}
    assert data["minimum_depth"] == chart.minimum_depth
    assert data["minimum_depth"] <= min(data["depth"])


def test_lobes_with_amplitudes_are_lists_over_amplitude_then_speed(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 6000 9000 12000 --amplitude 1um 3um --json").json
    assert data["amplitude"] == [1e-6, 3e-6]
    assert all(np.shape(data[key]) == (2, 3) for key in ("depth", "chatter_frequency", "kind", "lobe"))
    assert np.shape(data["minimum_depth"]) == (2,)
    chart = lobes_at_amplitude(read_machine(TOOL), [6000.0, 9000.0, 12000.0], 3e-6)
    np.testing.assert_array_equal(data["depth"][1], chart.depth)


def test_depths_give_multipliers_over_speed_and_depth(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 6000 9000 --depth 1mm 1.5mm 3mm --json").json
    assert np.shape(data["multiplier"]) == (2, 3)
    critical = np.array(data["depth"])
    np.testing.assert_array_equal(np.array(data["multiplier"]) > 1, critical[:, None] < np.array([1e-3, 1.5e-3, 3e-3]))
    levels = jointlib(f"lobes {TOOL} --speed 6000 9000 --depth 1mm --amplitude 1um 2um --json").json
    assert np.shape(levels["multiplier"]) == (2, 2, 1)
    np.testing.assert_allclose(np.array(levels["multiplier"])[0, :, 0], np.array(data["multiplier"])[:, 0], rtol=1e-6)
    text = jointlib(f"lobes {TOOL} --speed 6000 --depth 1mm").out
    assert "|μ| at 1 mm" in text


@pytest.mark.parametrize("method", ["multi-frequency", "collocation", "zero-order"])
def test_the_method_that_is_asked_for_is_taken(method: str, here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 6000 --method {method} --json").json
    assert data["method"] == method
    expected = 1.945738e-3 if method == "zero-order" else 2.02847e-3
    assert data["depth"][0] == pytest.approx(expected, rel=1e-5)


def test_one_amplitude_and_one_speed_keep_their_axes(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 9000 --amplitude 1um --json").json
    assert np.shape(data["depth"]) == (1, 1)
    assert len(data["speed"]) == len(data["amplitude"]) == 1


@pytest.mark.slow
def test_without_speeds_the_lobes_span_the_range_of_the_file(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --json -o chart.npz").json
    assert (data["speed"][0], data["speed"][-1], len(data["depth"])) == (4000.0, 25000.0, len(data["speed"]))
    with np.load("chart.npz") as chart:
        np.testing.assert_array_equal(chart["depth"][0], data["depth"])


def test_an_unbounded_depth_is_null(here: Path) -> None:
    data = jointlib(f"lobes {TOOL} --speed 9000 1e7 --method zero-order --json").json
    for key in ("depth", "chatter_frequency", "kind", "lobe"):
        assert data[key][0] is not None
        assert data[key][1] is None
    done = jointlib(f"lobes {TOOL} --speed 1e7 --method zero-order")
    assert "unbounded" in done.out
    assert not {"inf", "nan", "-1"} & set(done.out.split())


@pytest.mark.parametrize("method", ["zero-order", "multi-frequency", "collocation"])
def test_a_band_that_cuts_off_the_modes_of_the_tool_hides_no_chatter(here: Path, method: str) -> None:
    whole = jointlib(f"lobes {TOOL} --speed 9000 --method {method} --json").json
    for band in ('frequency = ["100 Hz", "500 Hz"]', 'frequency = ["2 kHz", "3 kHz"]', ""):
        Path("other.toml").write_text(TOOL.read_text().replace('frequency = ["100 Hz", "3 kHz"]', band))
        found = jointlib(f"lobes other.toml --speed 9000 --method {method} --json").json
        assert found["depth"] == pytest.approx(whole["depth"], rel=1e-9)
        assert found["minimum_depth"] == pytest.approx(whole["minimum_depth"], rel=1e-9)
        assert any("of the tool" in sentence or "the tool feels" in sentence for sentence in found["warnings"])


@pytest.mark.thorough
def test_frf_gives_one_peak_for_each_force_connection_and_resonance(here: Path) -> None:
    data = jointlib(f"frf {TWO_MASS} --force 10 50N --frequency 1kHz:7kHz -o two_mass.npz --json").json
    assert data["file"] == "two_mass.npz"
    assert [(p["force"], p["connection"]) for p in data["peaks"]] == [(f, "guide") for f in (10, 10, 50, 50)]
    result = response(read_machine(TWO_MASS), (10.0, 50.0), (1000.0, 7000.0), harmonics="auto")
    assert [p["harmonics"] for p in data["peaks"]] == [1, 1, 3, 3]
    for found, ours in zip(data["peaks"], result.peaks, strict=True):
        assert (found["amplitude"], found["frequency"]) == (ours.amplitude, ours.frequency)
        assert (found["stability"], found["outcome"]) == ("stable", "converged")


def test_refined_peaks_lie_on_no_grid_and_above_every_line(here: Path) -> None:
    peaks = {}
    for lines in (90, 301):
        data = jointlib(f"frf {TWO_MASS} --force 10 --frequency 1kHz:7kHz:{lines} -o {lines}.npz --json").json
        peaks[lines] = [(p["amplitude"], p["frequency"]) for p in data["peaks"]]
        with np.load(f"{lines}.npz") as curves:
            names = curves.files
            largest = np.max(np.abs(curves["branch_0_0_joint"]))
            assert curves["receptance_0"].shape == (len(curves["frequency_0"]), len(curves["outputs"]))
        assert {"force", "drive", "outputs", "connections"} <= set(names)
        assert largest <= max(a for a, _ in peaks[lines]) * (1 + 1e-9)
    np.testing.assert_allclose(peaks[90], peaks[301], rtol=1e-6)


def test_frf_drives_the_named_degree_of_freedom(here: Path) -> None:
    given = f"frf {TWO_MASS} --force 10 --frequency 1kHz:7kHz:50 -o f.npz --json"
    tool, base = jointlib(given).json, jointlib(f"{given} --drive base.x").json
    ours = response(read_machine(TWO_MASS), (10.0,), (1000.0, 7000.0), "base.x", points=50)
    assert [p["amplitude"] for p in base["peaks"]] == [p.amplitude for p in ours.peaks]
    assert tool["peaks"] != base["peaks"]


def test_identify_gives_parameters_with_standard_errors_and_the_misfit(here: Path) -> None:
    done = jointlib(f"identify {STATIC} --law hertz-guide -o g.joint.toml --json")
    data = done.json
    found = identify([read_measurement(STATIC)], laws=["hertz-guide"])
    assert (data["rms"], data["rms_unit"], data["file"]) == (found.rms, "N", "g.joint.toml")
    assert set(data["parameters"]) == {f"hertz_guide.{key}" for key in ("preload", "kappa", "contact_angle")}
    for name, row in data["parameters"].items():
        assert row["value"] == found.parameters[name].value == read_joint(Path("g.joint.toml")).parameters[name]
        assert row["unit"]
    angle = data["parameters"]["hertz_guide.contact_angle"]
    assert (angle["status"], angle["standard_error"]) == ("assumed", None)
    assert all(data["parameters"][f"hertz_guide.{key}"]["standard_error"] > 0 for key in ("preload", "kappa"))
    assert min(data["sweep"]["rms"]) == pytest.approx(data["rms"], rel=0.01)


@pytest.mark.thorough
def test_fmu_gives_the_file_and_the_largest_step_of_co_simulation(here: Path) -> None:
    data = jointlib(f"fmu {GUIDE} -o guide.fmu --json").json
    again = jointlib("fmu --verify guide.fmu --json").json
    ours = verify_fmu("guide.fmu")
    for found in (data, again):
        assert found["file"] == "guide.fmu"
        assert found["platforms"] == list(ours.platforms) != []
        assert found["max_step"] == ours.max_step
        assert found["max_step"] > 0
        assert any("FMPy" in name for name in found["verified_with"])
    assert data["runtime"] == ("c" if can_compile() else "python")
    assert again["difference"] <= 1e-12


@pytest.mark.slow
def test_run_gives_steps_report_verdict_and_errors(here: Path) -> None:
    done = jointlib(f"run {LIBRARY / 'paper_sdof.toml'} -o out --json")
    data = done.json
    assert data == json.loads(Path("out/run.json").read_text())
    assert {step["step"] for step in data["steps"]} >= {"check", "frf"}
    assert data["report"] == str(Path("out/report.html"))
    assert (data["verdict"], data["error_before"], data["error_after"]) == (None, None, None)
    assert done.err == ""
    assert "checking the coupled machine" in jointlib(f"run {LIBRARY / 'paper_sdof.toml'} -o again").err


@pytest.mark.parametrize("words", ["laws", "doctor", f"inspect {RIG}", f"inspect {GUIDE}", f"inspect {TWO_MASS}"])
def test_verbs_without_promised_keys_print_json_too(words: str, here: Path) -> None:
    done = jointlib(f"{words} --json")
    assert (done.status, done.complaints) == (0, [])
    assert isinstance(done.json, dict)


def test_doctor_names_the_compiler_that_native_fmus_are_made_with(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own, other = sorted(PLATFORMS, key=lambda platform: platform.fmi3 != this_platform())[:2]
    reached = [Compiler(own, ("/opt/bin/cc", "-m64")), Compiler(other, ("cross-cc",))]
    monkeypatch.setattr("fmu.members.build.compilers", lambda: tuple(reached))
    data = jointlib("doctor --json").json
    assert (data["compiler"], data["fmu_runtimes"]) == ("/opt/bin/cc -m64", ["c", "python"])
    assert data["fmu_platforms"] == [own.fmi3, other.fmi3]
    line = f"native FMUs: FMI 2.0 and 3.0 for {own.fmi3}, {other.fmi3}, compiled by /opt/bin/cc -m64"
    assert line in jointlib("doctor").out.splitlines()


def test_doctor_tells_what_each_extra_brings_and_how_to_get_it(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from importlib import metadata

    releases = {"dash": "4.4.1"}

    def version(name: str) -> str:
        if name in releases:
            return releases[name]
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", version)
    data = jointlib("doctor --json").json
    assert (data["extras"]["explore"], data["extras"]["tables"]) == ("4.4.1", "missing")
    said = jointlib("doctor").out.splitlines()
    assert "  extra explore: dash 4.4.1" in said
    assert "  extra tables: pip install 'jointlib[tables]'" in said
    releases |= {"pandas": "3.1.1", "pyarrow": "26.0"}
    lacking = "  extra tables: pip install 'jointlib[tables]' (pandas 3.1.1, pyarrow 26.0, xarray missing)"
    assert lacking in jointlib("doctor").out.splitlines()
    releases["xarray"] = "2026.9"
    assert "  extra tables: pandas 3.1.1, pyarrow 26.0, xarray 2026.9" in jointlib("doctor").out.splitlines()
    assert jointlib("doctor --json").json["extra_packages"]["xarray"] == "2026.9"


def test_doctor_says_what_to_install_where_no_native_fmu_can_be_made(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = next(platform for platform in PLATFORMS if platform.fmi3 != this_platform())
    monkeypatch.setattr("fmu.members.build.compilers", lambda: (Compiler(other, ("cross-cc",)),))
    data = jointlib("doctor --json").json
    assert (data["compiler"], data["fmu_runtimes"], data["fmu_platforms"]) == (None, ["python"], [])
    said = jointlib("doctor").out
    assert "native FMUs: no C compiler found" in said
    assert "pip install 'jointlib[native]'" in said


@pytest.mark.thorough
def test_work_that_takes_longer_is_announced_on_standard_error(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("jointlib.cli.output._SHOW_AFTER", 0.0)
    done = jointlib(f"fmu {GUIDE} -o guide.fmu")
    assert done.err.splitlines() == [
        "reading, and identifying what is open …",
        "making the reference run from the Python laws …",
        "writing and compiling the sources …",
        "validating and repeating the reference run …",
    ]
    assert "wrote guide.fmu" in done.out
    quiet = jointlib(f"fmu {GUIDE} -o guide.fmu --json")
    assert quiet.err == ""
    assert quiet.json["file"] == "guide.fmu"
