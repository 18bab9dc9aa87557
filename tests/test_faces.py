"""Results show themselves: a sentence, a table with units, a picture with labelled axes, HTML that is escaped."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from samples import LAWS
from test_machine_trace_files import traced
from test_report import rig_report
from test_study_report import study

from jointlib import read_measurement, read_records
from jointlib.describing import DescribingFunction
from jointlib.errors import InputError, Outcome
from jointlib.frf import FRF
from jointlib.identification import Identification, fit_hertz
from jointlib.identification.force_samples import RestoringForce
from jointlib.identification.result import FitError, Found
from jointlib.joint import Covariance, Joint
from jointlib.law import JointLaw
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.viscous import Viscous
from jointlib.shown.result import Shown
from machines import (
    Connection,
    Identify,
    Machine,
    Response,
    StabilityLobes,
    constant_amplitude,
    linear_check,
    natural_modes,
    operating_point,
    read_machine,
    response,
    stability_lobes,
)
from machines.compare.comparison import compared
from machines.cutting.process.cutting import Cutting
from machines.harmonic_balance.linear_check import Excluded
from machines.lobes import ToolModel
from machines.road.run import Run, Silent
from machines.study.findings.answer import answer
from machines.study.findings.verdict import judge

LIBRARY = Path(__file__).parents[1] / "machines" / "library"
TOOL = ToolModel.from_modes([922.0], [0.011], [0.03993], [[1.0]], axes=("x",))
CUT = Cutting("milling", teeth=2, tangential=6e8, normal=2e8, mode="down", immersion=0.1, feed=1e-4, diameter=0.02)


def framed(result: Shown) -> Any:
    """The frame of a result, whose columns with a unit are all there."""
    pytest.importorskip("pandas", reason="pandas is not installed (extra tables)")
    frame = result.to_dataframe()
    assert set(frame.attrs["units"]) <= set(frame.columns)
    return frame


def said(result: Shown) -> str:
    """What is printed of a result: a line or two that name it and no array."""
    text = repr(result)
    assert text == f"{type(result).__name__}: {result.finding()}"
    assert text.count("\n") < 2
    assert "array(" not in text
    assert len(text) < 400
    return text


def labels(axes: Any) -> tuple[str, str]:
    axes.figure.canvas.draw()
    return axes.get_xlabel(), axes.get_ylabel()


@pytest.fixture(scope="module")
def chart() -> StabilityLobes:
    return stability_lobes(TOOL, CUT, np.linspace(17000.0, 19000.0, 21), "collocation")


@pytest.fixture(scope="module")
def machine() -> Machine:
    return read_machine(LIBRARY / "two_mass.toml")


@pytest.fixture(scope="module")
def moved(machine: Machine) -> Response:
    return response(machine, [10.0, 80.0])


def frf() -> FRF:
    f = np.linspace(100.0, 300.0, 201)
    H = 1e-6 / (1 - (f / 200.0) ** 2 + 0.02j * f / 200.0)
    return FRF(f, np.stack([H, H / 2], axis=1)[:, :, None], ("tip.x", "b<i>ar.x"), ("tip.x",))


def test_lobes_say_the_depth_that_is_stable(chart: StabilityLobes) -> None:
    text = said(chart)
    assert f"below {chart.minimum_depth * 1e3:.4g} mm" in text
    assert "these speeds" in text
    frame = framed(chart)
    assert frame.attrs["units"] == {"speed": "rpm", "depth": "m", "chatter_frequency": "Hz"}
    np.testing.assert_array_equal(frame["depth"], chart.depth)
    assert labels(chart.plot()) == ("spindle speed [rpm]", "depth of cut [mm]")
    drawn = chart.plot().get_lines()[0].get_ydata()
    np.testing.assert_allclose(drawn, np.where(np.isfinite(chart.depth), 1e3 * chart.depth, np.nan))
    stable = replace(chart, depth=np.full(chart.depth.shape, np.inf), minimum_depth=np.inf)
    assert "no chatter at any depth" in said(stable)
    assert "no chatter at any depth up to 5000 Hz" in said(replace(stable, known_to=5000.0))


def test_a_picture_is_drawn_on_the_axes_that_are_given(chart: StabilityLobes) -> None:
    axes = chart.plot()
    assert replace(chart, method="zero-order").plot(axes) is axes
    assert len(axes.get_lines()) == 2


def test_a_receptance_says_where_it_is_largest() -> None:
    assert "largest 50 µm/N at 200 Hz (tip.x per force on tip.x)" in said(frf())
    frame = framed(frf())
    assert frame.attrs["units"]["tip.x per force on tip.x"] == "m/N"
    np.testing.assert_array_equal(frame["tip.x per force on tip.x"], frf().between("tip.x", "tip.x"))
    assert labels(frf().plot()) == ("frequency [Hz]", "|x/F| [µm/N]")
    unknown = replace(frf(), receptance=np.full((201, 2, 1), np.nan + 0j))
    assert "no line has a value" in said(unknown)


def test_a_receptance_is_a_labelled_array() -> None:
    pytest.importorskip("xarray", reason="xarray is not installed (extra tables)")
    labelled = frf().to_xarray()
    assert labelled.attrs == {"units": "m/N", "kind": "linear"}
    assert labelled.frequency.attrs == {"units": "Hz"}
    one = labelled.sel(output="tip.x", input="tip.x", frequency=200.0)
    assert complex(one) == complex(frf().between("tip.x", "tip.x")[100])


def test_a_notebook_gets_a_small_table_in_which_names_are_no_markup() -> None:
    html = frf()._repr_html_()
    assert "b&lt;i&gt;ar.x" in html
    assert "<i>" not in html
    assert "frequency [Hz]" in html
    assert "189 more rows" in html
    assert len(html) < 5000
    assert not {"src=", "href=", "<script"} & set(html.split())


def test_what_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch, chart: StabilityLobes) -> None:
    for name in ("pandas", "xarray"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(InputError, match=r"pandas is not installed, expected pip install 'jointlib\[tables\]'"):
        chart.to_dataframe()
    with pytest.raises(InputError, match="xarray is not installed"):
        frf().to_xarray()
    assert "189 more rows" in frf()._repr_html_()


def test_pictures_and_frames_are_imported_when_they_are_asked_for() -> None:
    late = {"matplotlib.pyplot", "pandas", "xarray"}
    code = f"import sys, jointlib.frf, machines; print(sorted({late} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_response_says_which_joint_moves_most(moved: Response) -> None:
    top = max(moved.peaks, key=lambda p: p.amplitude)
    assert f"10, 80 N on slide.x; guide moves most, {top.amplitude * 1e6:.4g} µm at" in said(moved)
    stalled = replace(moved, outcomes=(Outcome.CONVERGED, Outcome.STALLED))
    assert Outcome.STALLED.value in said(stalled)
    frame = framed(moved)
    assert frame.attrs["units"] == {"force": "N", "frequency": "Hz", "amplitude": "m", "width": "Hz"}
    assert frame["amplitude"].max() == top.amplitude
    axes = moved.plot()
    assert labels(axes) == ("frequency [Hz]", "|x/F| [µm/N]")
    assert axes.get_title() == "slide.x per force on slide.x"
    with pytest.raises(InputError, match=r"did you mean 'slide\.x'"):
        moved.plot(output="slide.y")


def test_receptances_of_a_response_stand_on_the_lines_of_all_forces(moved: Response) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed (extra tables)")
    labelled = moved.to_xarray()
    assert labelled.attrs == {"units": "m/N", "drive": "slide.x"}
    for force, frf in zip(moved.force, moved.frfs, strict=True):
        own = labelled.sel(force=force, output="slide.x", frequency=frf.frequency)
        np.testing.assert_array_equal(own, frf.between("slide.x", "slide.x"))


def test_a_joint_says_its_laws_and_their_parameters() -> None:
    covariance = Covariance(("viscous.damping",), np.array([[25.0]]))
    joint = Joint((HertzGuide(630.0, 3.93e-8), Viscous(503.0)), "g<u>", covariance=covariance)
    text = said(joint)
    assert "'g<u>' is hertz-guide + viscous" in text
    assert "preload 630 N" in text
    assert "damping 503.0 ± 5.0 N s/m" in text
    assert "g&lt;u&gt;" in joint._repr_html_()
    frame = framed(joint).set_index("parameter")
    assert frame["value"].to_dict() == joint.parameters
    assert frame["unit"].to_dict() == joint.units
    assert frame.loc["viscous.damping", "standard_error"] == 5.0
    A = np.array([1e-6, 2e-6])
    axes = joint.plot(amplitude=A, frequency=200.0)
    assert labels(axes) == ("amplitude [µm]", "Re G [N/µm]")
    drawn = axes.get_lines()[0].get_ydata()
    np.testing.assert_allclose(drawn, DescribingFunction(joint)(A, 400 * np.pi).real / 1e6)
    assert "is no law" in said(Joint())
    assert labels(joint.plot())[0] == "amplitude [µm]"


def test_modes_say_which_one_the_tool_feels_most() -> None:
    modes = natural_modes(read_machine(LIBRARY / "lathe.toml"))
    most = int(np.argmax(modes.tool_peak))
    text = said(modes)
    assert f"{len(modes.pole)} modes from" in text
    assert f"the tool feels most that at {modes.frequency[most]:.4g} Hz" in text
    frame = framed(modes)
    assert frame.attrs["units"] == {"frequency": "Hz", "tool_peak": "m/N"}
    np.testing.assert_array_equal(frame["damping_ratio"], modes.damping_ratio)
    assert labels(modes.plot()) == ("frequency [Hz]", "compliance at resonance [µm/N]")
    bare = replace(modes, machine=replace(modes.machine, tool={}))
    assert "the tool" not in said(bare).replace("at the tool", "")
    assert labels(bare.plot()) == ("frequency [Hz]", "damping ratio [%]")
    assert "grows by itself" in said(replace(modes, pole=-modes.pole.conj()))


def test_a_machine_says_what_it_is_made_of_and_is_drawn_where_it_has_places(machine: Machine) -> None:
    lathe = read_machine(LIBRARY / "lathe.toml")
    assert f"of {len(lathe.components)} components and {len(lathe.connections)} connections" in said(lathe)
    frame = framed(lathe)
    assert frame.attrs["units"] == {"x": "m", "y": "m", "z": "m"}
    assert list(frame["connection"]) == [c.name for c in lathe.connections]
    placed = [c for c in lathe.connections if c.at is not None]
    np.testing.assert_array_equal(frame.dropna()[["x", "y", "z"]], [c.at for c in placed])
    assert labels(lathe.plot()) == ("x [mm]", "z [mm]")
    assert labels(lathe.plot(seen="yz")) == ("y [mm]", "z [mm]")
    with pytest.raises(InputError, match="expected two axes"):
        lathe.plot(seen="xx")
    assert labels(machine.plot()) == ("connection", "component")
    open_ = Connection("bolt", ("slide.x", "ground"), identify=Identify((Path("bolt.toml"),)))
    assert "still to be identified: bolt" in said(replace(machine, connections=(*machine.connections, open_)))


def test_an_identification_says_what_it_found_and_what_it_leaves() -> None:
    law = HertzGuide(630.0, 3.93e-8)
    z = np.linspace(-8e-6, 8e-6, 81)
    fit = fit_hertz(z, law.force(z, 0 * z) + np.sin(np.arange(81)), contact_angle=np.pi / 4)
    parameters = {
        "hertz_guide.preload": Found(fit.law.preload, "N", 4.0, "fitted"),
        "carriage": Found(95.0, "kg", None, "assumed"),
    }
    error = FitError("static.csv", "static", 0.7, "N", 0.012)
    found = Identification(Joint((fit.law,), "guide"), parameters, (error,), fit)
    text = said(found)
    assert "'guide' is hertz-guide; it leaves 0.7 N rms of static.csv, 1.2 % of the largest" in text
    assert "± 4.0 N, carriage 95 kg" in text
    frame = framed(found).set_index("parameter")
    assert frame.loc["carriage"].to_dict()["status"] == "assumed"
    assert np.isnan(frame.loc["carriage", "standard_error"])
    assert labels(found.plot()) == ("deflection [µm]", "load [N]")
    v = np.gradient(z) * 1e3
    surface = RestoringForce("r1", z, v, law.force(z, v), 1e3, True, np.ones(41))
    measured, identified = replace(found, static=None, surfaces=(surface,)).plot().get_lines()
    np.testing.assert_allclose(measured.get_ydata(), surface.f)
    np.testing.assert_allclose(identified.get_ydata(), found.joint.force_along(z, v), rtol=1e-9, atol=1e-9)
    assert labels(replace(found, static=None).plot()) == ("amplitude [µm]", "Re G [N/µm]")


def test_a_trace_says_its_verdict_and_draws_how_the_candidates_fared() -> None:
    report = rig_report()
    assert said(report) == ("TraceReport: ambiguous. The records show that a1 reads too much.\nerror 1.8 % → 0.1 %")
    frame = framed(report)
    assert list(frame["rank"]) == sorted(c.rank for c in report.candidates)
    assert frame["share"][0] == report.candidates[0].share_of_current
    axes = report.plot()
    assert labels(axes)[0] == "share of the excess removed on data left out of the fit [%]"
    assert axes.get_yticklabels()[-1].get_text() == "gain at a1"
    assert "&lt;b&gt;" in replace(report, sentence="<b>")._repr_html_()


def test_a_study_says_its_best_design_and_lists_all(tmp_path: Path) -> None:
    asked = study(tmp_path)
    rng = np.random.default_rng(1)
    results = {q: rng.uniform(1e-6, 3e-6, asked.total) for q in asked.quantities}
    verdict = judge(asked, results)
    text = said(verdict)
    assert text == f"Verdict: {answer(asked, verdict)}"
    assert verdict.best is not None
    frame = framed(verdict)
    assert frame.attrs["units"] == {"static-compliance": "m/N", "peak-receptance": "m/N"}
    assert frame.loc[frame["rank"] == 1, "design"].tolist() == [verdict.best.number]
    first = frame.loc[verdict.best.number]
    assert first["guide"] == verdict.best.factors["guide"]
    assert first["static-compliance"] == verdict.best.results["static-compliance"]
    assert labels(verdict.plot()) == ("peak receptance [µm/N]", "static compliance [µm/N]")
    alone = study(tmp_path, ('[[objective]]\nquantity = "peak-receptance"\ngoal = "min"\n', ""))
    only = judge(alone, {q: results[q] for q in alone.quantities})
    assert labels(only.plot()) == ("rank of the design", "static compliance [µm/N]")


def test_a_run_says_what_to_set_and_what_is_missing(
    tmp_path: Path, machine: Machine, moved: Response, chart: StabilityLobes
) -> None:
    bare = Run(machine, tmp_path, Silent(), "jointlib run")
    assert said(bare) == "Run: Every joint was given; nothing was identified."
    assert labels(bare.plot()) == ("connection", "component")
    assert labels(replace(bare, responses=[moved]).plot()) == ("frequency [Hz]", "|x/F| [µm/N]")
    steps: list[dict[str, Any]] = [{"step": "identify", "joint": "guide"}, {"step": "lobes", "failed": "no <time>"}]
    made = replace(bare, advice=["Set 9000 rpm."], failed=["Lobes: no <time>"], steps=steps, charts={0.0: chart})
    assert said(made) == "Run: Set 9000 rpm.\nnot computed: Lobes: no <time>"
    assert framed(made)["of"].tolist() == ["guide", ""]
    assert "no &lt;time&gt;" in made._repr_html_()
    axes = replace(made, charts={0.0: chart, 2e-6: chart}).plot()
    assert labels(axes) == ("spindle speed [rpm]", "depth of cut [mm]")
    assert [line.get_label() for line in axes.get_lines()] == ["onset of chatter", "limit at 2 µm"]


def test_a_measurement_says_its_records_and_draws_one_that_is_not_sealed(tmp_path: Path) -> None:
    rig = read_measurement(LIBRARY / "guide_mill" / "rig.measurement.toml")
    text = said(rig)
    assert "rig.measurement.toml (simulated rig): 7 records (5 fit, 1 sealed, 1 quiet), channels a1, a2" in text
    frame = framed(rig)
    assert frame.attrs["units"] == {"start": "s", "sample_rate": "Hz"}
    assert frame["record"].tolist() == [r.name for r in rig.records]
    axes = rig.plot()
    assert labels(axes) == ("time [ms]", "acceleration [m/s²]")
    (first,) = read_records(rig, rig.with_role("fit")[:1])
    drawn = axes.get_lines()[0]
    np.testing.assert_array_equal(drawn.get_ydata(), first.channels[drawn.get_label()][: len(drawn.get_ydata())])
    sealed = rig.with_role("sealed")[0].name
    with pytest.raises(InputError, match="that is not sealed"):
        rig.plot(record=sealed)
    static = read_measurement(LIBRARY / "guide_mill" / "static.measurement.toml").plot()
    assert labels(static)[0].endswith("[µm]")
    assert labels(static)[1].endswith("[N]")


def test_a_measurement_of_frequency_responses_draws_them_as_receptances() -> None:
    tip = read_measurement(LIBRARY / "three_joints" / "tip.measurement.toml")
    frame = framed(tip)
    assert frame.attrs["units"] == {"force": "N"}
    assert frame["force"].tolist() == [r.sweep.force for r in tip.records if r.sweep is not None]
    axes = tip.plot()
    assert labels(axes) == ("frequency [Hz]", "|x/F| [µm/N]")
    assert len(axes.get_lines()) == sum(r.role != "sealed" for r in tip.records)
    assert len(tip.plot(record=tip.with_role("fit")[0].name).get_lines()) == 1


def test_a_trace_of_a_machine_says_its_verdict_and_draws_to_which_joint_it_points(machine: Machine) -> None:
    found = traced(machine, machine, "guide")
    assert said(found) == "MachineTrace: ambiguous. The FRFs point to <something>.\nerror 5 % → 1 %"
    assert framed(found)["place"].tolist() == [c.place for c in found.candidates]
    axes = found.plot()
    assert labels(axes) == ("share of the excess removed [%]", "connection")
    assert [text.get_text() for text in axes.get_yticklabels()] == ["guide, chosen", "foot"]


def test_the_check_says_how_far_the_machines_differ_and_draws_both(machine: Machine) -> None:
    found = linear_check(machine)
    text = said(found)
    assert "passed" in text
    assert f"{found.max_relative_difference:.2g}" in text
    assert "joints at rest" in text
    assert "FAILED" in said(replace(found, passed=False, amplitude=2e-6))
    assert "excluded: coulomb in guide" in said(replace(found, excluded=(Excluded("guide", "coulomb", "no tangent"),)))
    frame = framed(found)
    assert frame.attrs["units"] == {"frequency": "Hz", "coupled": "m/N", "control": "m/N", "difference": "m/N"}
    np.testing.assert_allclose(frame["coupled"], frame["control"], rtol=1e-8)
    axes = found.plot()
    assert labels(axes) == ("frequency [Hz]", "|x/F| [µm/N]")
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), 1e6 * frame["coupled"])


def test_an_operating_point_tells_force_gains_and_lines_that_ended_at_a_limit(machine: Machine) -> None:
    lines = np.linspace(1100.0, 1300.0, 21)
    found = operating_point(machine, lines, 1e-6)
    assert "frozen receptance, 1100 to 1300 Hz in 21 lines" in said(found)
    assert "all of 21 lines converged" in said(found)
    frame = framed(found)
    assert frame.attrs["units"] == {"frequency": "Hz", "force": "N", "guide amplitude": "m", "guide gain": "N/m"}
    np.testing.assert_array_equal(frame["guide gain"], found.gain[:, 0])
    moved = np.abs(found.frf.between("slide.x", "slide.x")) * frame["force"]
    np.testing.assert_allclose(moved, 1e-6, rtol=1e-9)
    assert labels(found.plot()) == ("frequency [Hz]", "|x/F| [µm/N]")
    assert "vanishing vibration" in said(operating_point(machine, lines, 0.0))
    ended = replace(found, outcomes=(Outcome.OUT_OF_RANGE,) * 3 + found.outcomes[3:], connections=())
    assert "of 21 lines 3 out_of_range" in said(ended)
    assert "joint 1 amplitude" in framed(ended).columns
    pytest.importorskip("xarray", reason="xarray is not installed (extra tables)")
    assert found.to_xarray().attrs["units"] == "m/N"


def test_a_held_motion_tells_where_the_least_force_holds_it(machine: Machine) -> None:
    lines = np.linspace(1100.0, 1400.0, 61)
    found = constant_amplitude(machine, lines, 1e-6, "slide.x")
    least = int(np.argmin(found.force))
    text = said(found)
    assert f"the least is {found.force[least]:.4g} N at {lines[least]:.5g} Hz" in text
    assert "slide.x held at 1 µm by a force on slide.x" in text
    frame = framed(found)
    assert frame.attrs["units"] == {"frequency": "Hz", "force": "N", "guide amplitude": "m"}
    assert set(frame["outcome"]) == {"converged"}
    axes = found.plot()
    assert labels(axes) == ("frequency [Hz]", "force [N]")
    np.testing.assert_array_equal(axes.get_lines()[0].get_ydata(), found.force)
    lost = replace(found, force=np.full(61, np.nan), outcomes=(Outcome.STALLED,) * 61)
    assert "of 61 lines 61 stalled" in said(lost)


def test_a_comparison_lays_the_prediction_over_the_record() -> None:
    machine = read_machine(LIBRARY / "three_joints.toml")
    found = compared(machine, LIBRARY / "three_joints" / "tip.measurement.toml")[0]
    assert "FRAC" in repr(found)
    assert repr(found) == f"Comparison: {found.sentence()}"
    frame = framed(found)
    assert frame.attrs["units"]["measured compliance"] == "m/N"
    assert len(frame) == len(found.pairs)
    axes = found.plot()
    assert labels(axes) == ("frequency [Hz]", "|x/F| [µm/N]")
    assert [line.get_label().partition(",")[0] for line in axes.get_lines()] == ["measured", "predicted"]
    np.testing.assert_allclose(axes.get_lines()[1].get_ydata(), 1e6 * np.abs(found.predicted))
    pytest.importorskip("xarray", reason="xarray is not installed (extra tables)")
    np.testing.assert_array_equal(found.to_xarray()[:, 0, 0], found.predicted)


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.kind)
def test_every_law_has_a_sentence_and_a_picture(law: JointLaw) -> None:
    joint = Joint((law,))
    assert law.kind in said(joint)
    assert labels(joint.plot())[0] == "amplitude [µm]"
    assert list(framed(joint)["value"]) == list(joint.parameters.values())


@pytest.mark.thorough
def test_every_machine_of_the_library_is_told_and_drawn() -> None:
    for path in sorted(LIBRARY.glob("*.toml")):
        if 'schema = "jointlib/machine/1"' in path.read_text("utf-8"):
            machine = read_machine(path)
            assert said(machine)
            assert all(labels(machine.plot()))
            assert len(framed(machine)) == len(machine.connections)
