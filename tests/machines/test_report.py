"""The report: one file, nothing fetched, no text taken for markup, same bytes for same data."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rig_samples import CHANNELS, measurement
from samples import KAPPA

from jointlib.joint import Joint
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import Candidate, Estimate, Rival, Status, TraceReport, Verdict, figures
from jointlib.loop.contest.fitted import Fitted
from jointlib.loop.periodic.pictures import pictures
from jointlib.loop.periodic.readings import readings
from jointlib.measurement import Correction, RecordSource
from jointlib.shown.pictures import literal
from machines import linear_check, read_machine, response
from machines.report import Page, Section
from machines.report.drawing import sheet
from machines.report.figures.joint_figures import gain, static_fit, surface
from machines.report.figures.trace_figures import largest_cycles
from machines.report.page import gathered
from machines.report.parameter_table import parameter_table
from machines.report.sections import check_section, response_section, trace_section

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
GUIDE = Joint((HertzGuide(630.0, KAPPA), Viscous(503.0)), validity={"amplitude": (0.0, 4e-6)})


def page(*sections: Section) -> Page:
    return Page(
        title="A <machine> & its guide",
        finding="Found nothing <b>new</b>.",
        numbers=[("error", "1 %")],
        sections=sections,
        inputs=[("r<1>.csv", "00ff")],
        assumptions=["none"],
        warnings=["mind the <gap>"],
        command="jointlib run x.toml -o out",
        version="0",
    )


def sections() -> list[Section]:
    machine = read_machine(LIBRARY / "two_mass.toml")
    return [response_section([response(machine, [10.0, 80.0])], {}), check_section(linear_check(machine))]


def test_a_report_needs_no_network_and_is_one_file() -> None:
    html = page(*sections()).html()
    links = re.findall(r"""(?:src|href)\s*=\s*["']([^"']+)""", html)
    assert links
    assert all(link.startswith("#") for link in links), [link for link in links if not link.startswith("#")]
    assert "@import" not in html
    assert "<script" not in html
    assert html.count("<svg") == 3


def test_many_sections_of_a_kind_stand_under_one_heading() -> None:
    """Where the first of them stood; two of another kind stay as they are."""
    gains = [Section(f"Describing function of {n}", kind="Describing functions of the joints") for n in "abcd"]
    files = [Section(f"{n} as an FMU", kind="Joints as FMUs") for n in "ab"]
    found = gathered([Section("Stability lobes"), *gains[:2], *files, *gains[2:]])
    assert [one.title for one in found] == [
        "Stability lobes",
        "Describing functions of the joints",
        "a as an FMU",
        "b as an FMU",
    ]
    assert list(found[1].parts) == gains


def test_text_is_never_markup() -> None:
    html = page().html()
    assert "A &lt;machine&gt; &amp; its guide" in html
    assert "mind the &lt;gap&gt;" in html
    assert "<b>new</b>" not in html


@pytest.mark.slow
def test_the_same_data_give_the_same_bytes() -> None:
    assert page(*sections()).html() == page(*sections()).html()


@pytest.mark.slow
def test_every_joint_picture_is_drawn() -> None:
    rng = np.random.default_rng(3)
    z = np.linspace(-6e-6, 6e-6, 80)
    load = GUIDE.force_along(z, 0 * z) + rng.normal(0, 10, 80)
    fit = static_fit(GUIDE, z, load, np.geomspace(200, 2000, 30), np.linspace(30, 10, 30), 630.0)
    v = rng.uniform(-0.1, 0.1, 80)
    drawn = [
        fit,
        surface(z, v, GUIDE.force_along(z, v), GUIDE, 6.5e8),
        gain({"a": GUIDE, "b": GUIDE}, abs(z[:20]), 500.0),
    ]
    assert all(f.svg.startswith("<svg") and f.svg.count("<path") > 10 for f in drawn)


def test_parameters_are_shown_in_the_units_people_read() -> None:
    rows = {row[0]: row for row in parameter_table(GUIDE, "").rows}
    assert rows["hertz_guide.contact_angle"][1:] == ("45", "not estimated", "°")


RATE, PERIOD, PERIODS = 102.4e3, 1024, 4
M1, M2, M3 = 0.942, 1.1, 1.1
LINEAR = Joint((Linear(6e8), Viscous(500.0)))
GAIN = 0.03


def shaken(folder: Path, gain: float) -> tuple[Fitted, list[dict[str, Any]]]:
    """Two records of the linear rig in closed form, a1 read too large by ``gain``, with a little noise; simulated."""
    rng, runs, sources = np.random.default_rng(3), [], []
    f = np.fft.rfftfreq(PERIOD, 1 / RATE)
    omega, inverse = 2 * np.pi * f, 1 / M1 + 1 / (M2 + M3)
    D = 6e8 + 1j * omega * 500.0
    for i, level in enumerate((40.0, 90.0)):
        P = np.where((f >= 2e3) & (f <= 8e3), level * PERIOD / 2 * np.exp(2j * np.pi * rng.random(len(f))), 0)
        F = D * P / M1 / (inverse * D - omega**2)
        truth = {"a1": (P - F) / M1, "a2": F / (M2 + M3), "a3": F / (M2 + M3), "P": P}
        run = {n: np.tile(np.fft.irfft(X, PERIOD), PERIODS) for n, X in truth.items()}
        run = {n: x + 1e-4 * x.std() * rng.standard_normal(len(x)) for n, x in run.items()}
        run["a1"] = run["a1"] * (1 + gain)
        np.savez(folder / f"r{i}.npz", allow_pickle=False, **run)
        sources.append(RecordSource(folder / f"r{i}.npz", "fit", condition=f"{level:g} N"))
        runs.append(run)
    test = measurement(records=tuple(sources), channels=CHANNELS)
    return Fitted(readings(test).training, LINEAR), runs


@pytest.fixture(scope="module")
def misread(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], dict[str, Any]]:
    """Pictures before (a1 reads 3 % too much) and after (it reads right), and the channels of the larger record."""
    wrong, runs = shaken(tmp_path_factory.mktemp("wrong"), GAIN)
    right, _ = shaken(tmp_path_factory.mktemp("right"), 0.0)
    return pictures(wrong, right), runs[1]


def test_a_gain_error_leaves_a_balance_residual_in_proportion_to_its_acceleration(
    misread: tuple[dict[str, Any], dict[str, Any]],
) -> None:
    """B = P − m1 (1 + g) a1 − … = −g m1 a1: over |a1| as measured the residual is a line of slope m1 g/(1 + g)."""
    plots, _ = misread
    a, size = plots["motion_balance"], plots["motion_balance_before"]
    width = a[1] - a[0]
    # The mean of a1² over a bin lies between the squares of its edges.
    slope = M1 * GAIN / (1 + GAIN)
    assert np.all(size > 0.98 * slope * (a - width / 2))
    assert np.all(size < 1.02 * slope * (a + width / 2) + 2 * plots["motion_balance_floor"])
    assert np.all(plots["motion_balance_after"] < 2 * plots["motion_balance_floor"])


def test_the_pictured_amplitude_is_that_of_the_channels(misread: tuple[dict[str, Any], dict[str, Any]]) -> None:
    """Two routes to the residual of a line, in N: the picture, and the transform of the channels themselves."""
    plots, run = misread
    B = run["P"] - M1 * run["a1"] - M2 * run["a2"] - M3 * run["a3"]
    lines = 2 * np.abs(np.fft.rfft(B)) / len(B)
    np.testing.assert_allclose(plots["balance_before"], lines[: len(plots["balance_before"])], rtol=1e-9, atol=1e-12)
    mean_period = B.reshape(PERIODS, PERIOD).mean(axis=0)
    inside = np.fft.rfft(mean_period)
    inside[np.fft.rfftfreq(PERIOD, 1 / RATE) > plots["residual_frequency"][-1]] = 0
    inside[0] = 0
    np.testing.assert_allclose(
        plots["time_balance_before"], np.fft.irfft(inside, PERIOD), atol=1e-9 * np.abs(mean_period).max()
    )


def test_every_line_has_the_class_of_its_place(misread: tuple[dict[str, Any], dict[str, Any]]) -> None:
    plots, _ = misread
    f, place = plots["residual_frequency"], plots["residual_class"]
    assert np.all(place[f < 500] == 0)
    on_period = np.isclose(np.round(f * PERIOD / RATE), f * PERIOD / RATE)
    assert np.all(place[on_period & (f >= 500) & (f <= 8000)] == 1)
    assert np.all(place[on_period & (f > 8001)] == 2)
    assert np.all(place[~on_period & (f >= 500)] == 3)
    quiet = plots["balance_before"][place == 3] / plots["balance_floor"][place == 3]
    assert np.sqrt(np.mean(quiet**2)) == pytest.approx(1.0, abs=0.1)


def test_the_loop_shown_is_round_the_largest_motion_and_between_samples_band_limited() -> None:
    n, peak = 2000, 0.3
    t = np.arange(n) / n
    z = (1 + 0.8 * np.cos(2 * np.pi * (t - peak))) * np.sin(2 * np.pi * 40 * t)
    shown, slope = largest_cycles(z, np.cos(2 * np.pi * 40 * t))
    assert np.max(np.abs(shown)) >= np.max(np.abs(z))
    assert np.count_nonzero(np.diff(np.signbit(shown))) == pytest.approx(8, abs=1)
    # The second signal has size 1 at every zero of the first's carrier: on the circle wherever the envelope is known.
    fine = np.hypot(shown / 1.8, slope)
    assert np.all((fine > 0.9) & (fine < 1.01))


def estimate(value: float, unit: str, error: float, **more: Any) -> Estimate:
    return Estimate(value, unit, error, (value - 1.96 * error, value + 1.96 * error), **more)


def candidate(family: str, member: str, share: float, rank: int, status: Status, **more: Any) -> Candidate:
    parts = {"per_fold": (60.0 * share, 40.0 * share), "significance": {"z": 40.0 * share}, "reason": "", **more}
    parameters = parts.pop("parameters", {})
    return Candidate(family, member, parameters, 100 * share, share_of_current=share, explained=share, rank=rank,
                     status=status, **parts)  # fmt: skip


def rig_report(plots: dict[str, Any] | None = None) -> TraceReport:
    """A report with invented figures: a gain error of a1, one rival, one hypothesis, one family out of reach."""
    gain = {"gain": estimate(0.019982, "1", 2.7e-5)}
    cells = {"excited_band": {"excess": 900.0, "threshold": 100.0, "lines": 300}}
    quiet = {"excited_band": {"excess": -3.0, "threshold": 100.0, "lines": 300}}
    size = {"joint_N": 9.0, "joint_floor_N": 0.5, "joint_force_N": 500.0, "balance_N": 7.0, "balance_floor_N": 0.6}
    classes = {"joint": {"excited_band": 324.0}, "balance": {"excited_band": 1.0}}
    before = {"relative": 0.018, "where": "sealed", "chi2": 81.0, "in_sample": 0.017, "per_class": classes, **size}
    after = {**before, "relative": 0.001, "chi2": 1.01, "joint_N": 0.51}
    chosen = candidate("gain", "gain", 0.99, 1, Status.ACCEPTED, parameters=gain, channel="a1")
    return TraceReport(
        route="periodic",
        verdict=Verdict.AMBIGUOUS,
        sentence="The records show that a1 reads too much.",
        baseline=LINEAR,
        mended=LINEAR,
        chosen=chosen,
        candidates=(
            chosen,
            candidate("missing-mass", "missing-mass", 0.97, 2, Status.TIED, body="runner", reason="fits as well"),
            candidate("coulomb", "coulomb", 0.2, 3, Status.UNPHYSICAL, reason="negative friction"),
            *(candidate("gap", f"member {i}", -0.1, 4 + i, Status.REJECTED, reason="no gain") for i in range(20)),
        ),
        rivals=(Rival("missing-mass", 0.97, True, "Weigh the runner.", "missing-mass", body="runner"),),
        chain=({"family": "delay", "share": 0.08, "channel": "P", "status": "hypothesis"},),
        secondary=({"family": "hum", "share": 2e-6, "channel": "a2"},),
        error_before=before,
        error_after=after,
        data={},
        noise_floor={"joint_N": 0.5},
        localisation={"joint": cells, "balance": quiet},
        reduction={},
        resimulation={"a1": {"before": 0.12, "after": 0.001}, "a2": {"before": 0.1, "after": None}},
        unexplained={"fraction": 0.02, "equation": "joint", "line_class": "above_band", "largest_lines": []},
        not_decidable=({"family": "rocking-mode", "why": "no a3", "needs": "a third accelerometer"},),
        next_experiment="Weigh the runner.",
        warnings=(),
        repro={},
        corrections=(Correction("gain", "a1", None, {"gain": 0.019982}),),
        plots=plots or {},
    )


def words_of(report: TraceReport) -> str:
    """Text of the page as a reader sees it, pictures left out."""
    html = re.sub(r"<(svg|style).*?</\1>", "", page(trace_section(report)).html(), flags=re.S)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html)).replace("\u202f", " ")


@pytest.mark.slow
def test_a_trace_tells_a_reader_all_that_he_must_know(misread: tuple[dict[str, Any], dict[str, Any]]) -> None:
    text = words_of(rig_report(misread[0]))
    for said in (
        "cannot tell it from its rivals",
        "1.9982 1.9929 to 2.0035 %",  # 0.019982 ± 1.96 · 0.000027, as a gain error is read
        "Weigh the runner.",
        "delay",
        "hypothesis",
        "passed, but small: not added",
        "Joint law excited band 900 100 300 more than noise",
        "Force balance excited band -3 100 300 noise",
        "Left unexplained: 2 % of the excess, most of it in the joint law, above the band.",
        "negative friction",
        "missing-mass at runner",
        "joint law, rms [N] 9 0.51 0.5",
        "chi-square 81 1.01 1",
        "a1 12 % 0.1 %",
        "rocking-mode no a3 a third accelerometer",
        "gain a1 all gain 0.019982",
        "Next experiment: Weigh the runner.",
    ):
        assert said in text, said
    assert "13 more, all refused" in text
    assert not re.search(r"\b(nan|None|inf)\b", text)


@pytest.mark.slow
def test_each_question_has_its_picture(misread: tuple[dict[str, Any], dict[str, Any]]) -> None:
    parts = {p.title: p for p in trace_section(rig_report(misread[0])).parts}
    captions = [f.caption.split("?")[0] for p in parts.values() for f in p.figures]
    assert captions == [
        "Does the model follow the loop",
        "In which equation, on which lines",
        "At which frequencies",
        "When, and at which size of motion",
        "Which effect explains it",
    ]
    bare = trace_section(rig_report())
    assert [f.caption.split("?")[0] for p in bare.parts for f in p.figures] == [captions[1], captions[4]]


def test_a_doubtful_interval_says_so_in_words() -> None:
    slip = {"jenkins.slip_force": estimate(35.7, "N", 0.01, ci_kind="model_form")}
    k2 = {"quadratic.stiffness2": estimate(1e13, "N/m^2", 1e10, biased=True)}
    for parameters, said in ((slip, "shape of the law is the larger doubt"), (k2, "off by more than the interval")):
        chosen = candidate("hysteresis", "jenkins", 0.9, 1, Status.ACCEPTED, parameters=parameters)
        assert said in words_of(replace(rig_report(), chosen=chosen))


def test_two_elements_of_an_effect_are_told_apart_and_added_in_the_sentence() -> None:
    two = {"coulomb.slip_force": estimate(71.7, "N", 1.6), "coulomb_2.slip_force": estimate(29.0, "N", 1.4)}
    chosen = candidate("coulomb", "coulomb", 0.99, 1, Status.ACCEPTED, parameters=two)
    text = words_of(replace(rig_report(), chosen=chosen))
    assert "slip force, second element" in text
    assert figures(two) == "slip force 71.7 ± 3.1 N + 29.0 ± 2.7 N"


def test_without_a_name_the_nearest_is_called_the_nearest() -> None:
    text = words_of(replace(rig_report(), verdict=Verdict.UNEXPLAINED, rivals=(), corrections=()))
    assert "no effect of the catalogue explains it" in text
    assert "Nearest: " in text
    assert "Chosen: " not in text


@pytest.mark.slow
def test_a_path_shows_the_shape_of_the_missing_force_and_the_strokes() -> None:
    rng, t = np.random.default_rng(1), np.linspace(0, 4, 5000)
    z, v = 0.02 * np.sin(5 * t), 0.1 * np.cos(5 * t)
    left = 12 * np.tanh(v / 1e-3) + 0.1 * rng.standard_normal(len(t))
    force = 150 * v + left
    plots = {"time": t, "displacement": z, "velocity": v, "force": force, "model_before": 150 * v}
    plots |= {"model_after": 150 * v + 12 * np.tanh(v / 1e-3), "residual_before": left, "residual_after": 0 * left}
    blocks = [
        {"record": "r.csv", "condition": f"speed {c}", "start_s": float(i), "end_s": i + 1.0, "error_before": 0.5}
        | {"error_after": 0.02, "floor": None}
        for i, c in enumerate("abab")
    ]
    error = {"relative": 0.5, "in_sample": 0.4, "heldout_condition": 0.5, "heldout_block": 0.4}
    error["where"] = "condition folds"  # type: ignore[assignment]
    coulomb = candidate(
        "coulomb", "coulomb", 0.99, 1, Status.ACCEPTED, significance={"p_signflip": 1e-4, "share_error": 0.01}
    )
    report = replace(
        rig_report(plots),
        route="path",
        chosen=coulomb,
        candidates=(coulomb,),
        corrections=(),
        error_before=error,
        error_after={**error, "relative": 0.02},
        noise_floor={"force_rel_per_record": {"r.csv": 0.004, "s.csv": None}},
        localisation={"blocks": blocks},
        resimulation={"displacement": {"before": None, "after": None, "reason": "no restoring force"}},
        unexplained={"fraction": 0.01, "blocks": blocks[:2]},
    )
    captions = [f.caption.split("?")[0] for p in trace_section(report).parts for f in p.figures]
    assert captions == [
        "Does the model follow the loop",
        "What shape has the missing force",
        "At which speed or level",
        "Which effect explains it",
    ]
    text = words_of(report)
    assert "error relative to the force 50 % 2 % 0.4 %" in text
    assert "no restoring force" in text
    assert "p = 0.0001" in text
    assert re.search(r"99\s% ± 2\s%", text)
    assert not re.search(r"\b(nan|None|inf)\b", text)


@pytest.mark.thorough
def test_powers_of_ten_on_an_axis_are_drawn_as_such_and_words_of_a_user_as_they_are() -> None:
    """A label such as 10² is narrower than five letters; its formula written out would be wider than a panel."""
    with sheet() as paper:
        paper.axes.plot([1.0, 1e4], [1.0, 1e4])
        paper.axes.set_yscale("log")
        paper.axes.set_title(literal("between $5 and $9: {x_"))  # no formula, and no error of one
        figure = paper.axes.figure
        figure.canvas.draw()
        letters = paper.axes.text(0.5, 0.5, "mmmmm", fontsize=paper.axes.yaxis.get_ticklabels()[0].get_fontsize())
        widest = letters.get_window_extent().width
        shown = [label for label in paper.axes.yaxis.get_ticklabels() if label.get_text()]
        assert len(shown) > 2
        assert all(0 < label.get_window_extent().width < widest for label in shown)
    assert "between $5 and $9" in paper.svg
