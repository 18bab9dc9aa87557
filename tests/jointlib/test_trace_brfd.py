"""Closing the loop on a measured friction damper with backlash (Coble et al. 2022), ten full-stroke records."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, decimate, sosfiltfilt

from jointlib.arrays import Array
from jointlib.io.measurement_file import read_measurement, read_records
from jointlib.joint import Joint
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.path import judgement, route
from jointlib.loop.path.columns import law_forces
from jointlib.loop.path.evidence import Evidence, Model
from jointlib.loop.path.fitted import fit
from jointlib.loop.path.preparation import choose_preparation, prepare
from jointlib.loop.path.repeats import PathFloor, repeat_floor
from jointlib.loop.path.strokes import Division, divide
from jointlib.loop.trace import trace
from jointlib.measurement import Measurement

HEAD = """
schema = "jointlib/measurement/1"
kind = "path"
sample_rate = "1024 Hz"
[[channel]]
name = "disp_in"
quantity = "displacement"
unit = "inch"
[[channel]]
name = "friction_force_kip"
quantity = "force"
unit = "kip"
"""
START = Joint((Linear(1e5), Viscous(1e3)), "damper")
TAUGHT = "0.5Hz30lbtension1amplitude"


@pytest.fixture(scope="module")
def records() -> list[Path]:
    folder = os.environ.get("JOINTLIB_DATA")
    if not folder:
        pytest.skip("JOINTLIB_DATA is not set; it names the folder of the measured records")
    found = sorted((Path(folder) / "brfd_friction_backlash").glob("*.npz"))
    if len(found) != 10:
        pytest.skip(f"{folder}: {len(found)} records of the friction damper, expected 10")
    return found


def name_of(record: Path) -> str:
    return record.stem.removeprefix("dataset-2_char_")


@pytest.fixture(scope="module")
def measured(records: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Measurement:
    path = tmp_path_factory.mktemp("brfd") / "brfd.measurement.toml"
    listed = [f'[[record]]\nfile = "{r.as_posix()}"\ncondition = "{name_of(r)}"\n' for r in records]
    path.write_text(HEAD + "".join(listed))
    return read_measurement(path)


@pytest.fixture(scope="module")
def report(measured: Measurement) -> TraceReport:
    return trace(measured, START)


def shares(report: TraceReport, step: int) -> dict[str, float]:
    """Share of what is left that each candidate removes beside a step of the search; the best of each member."""
    out: dict[str, float] = {}
    for row in report.reduction["steps"][step]["next"]:
        out[row["member"]] = max(row["share"], out.get(row["member"], -1.0))
    return out


@pytest.mark.slow
def test_slip_behind_play_is_the_nearest_effect_and_not_the_whole_truth(report: TraceReport) -> None:
    assert report.verdict is Verdict.PARTIAL
    assert report.chosen is not None
    assert (report.chosen.family, report.chosen.member) == ("hysteresis", "jenkins")
    assert report.chosen.explained == pytest.approx(0.922, abs=0.01)
    assert [law.kind for law in report.mended.laws] == ["linear", "viscous", "jenkins"]
    slip = report.mended.parameters
    # Leaving records out in turn moves the three along a valley: slip distance 1.4–1.7 mm, play ± 2.2–2.5 mm.
    assert slip["jenkins.clearance"] == pytest.approx(2.4e-3, rel=0.1)
    assert slip["jenkins.slip_force"] == pytest.approx(9.9e3, rel=0.05)
    assert slip["jenkins.slip_force"] / slip["jenkins.stiffness"] == pytest.approx(1.6e-3, rel=0.15)


@pytest.mark.slow
def test_errors_on_left_out_records_are_those_of_the_literature_or_smaller(report: TraceReport) -> None:
    before, slip, after = report.reduction["steps"]
    assert before["heldout_condition"] == pytest.approx(0.669, abs=0.01)
    assert slip["heldout_condition"] <= 0.207 * 1.05
    assert after["heldout_condition"] < 0.19
    assert report.error_before["where"] == "condition folds"
    assert report.error_after["relative"] == pytest.approx(after["heldout_condition"])


@pytest.mark.slow
def test_dry_friction_alone_is_far_behind_and_gradual_slip_is_the_rival(report: TraceReport) -> None:
    found = shares(report, 0)
    assert found["coulomb"] < 0.35
    assert found["jenkins"] > found["dahl"] > found["coulomb"]
    assert found["iwan"] == pytest.approx(0.914, abs=0.01)
    assert [(r.family, r.member) for r in report.rivals] == [("hysteresis", "iwan")]


@pytest.mark.slow
def test_inertia_that_no_file_declares_comes_second_and_then_nothing(report: TraceReport) -> None:
    """It helps every record that is left out, the fast ones most."""
    assert [link["family"] for link in report.chain] == ["missing-mass"]
    assert min(report.composition[1]["per_fold"]) > 0
    assert max(share for member, share in shares(report, 1).items() if member != "missing-mass") < 0.20
    (correction,) = report.corrections
    assert correction.parameters["mass"] == pytest.approx(830, abs=160)


def scatter_of_strokes(record: Path) -> tuple[float, float]:
    """Standard deviation of the force over the three full strokes by the clock, over its rms: as it is, and beyond what
    displacement, velocity and acceleration explain of it; written for these tests alone."""
    data, rate = np.load(record), float(name_of(record).split("Hz")[0])
    low = butter(4, 100.0, fs=1024.0, output="sos")
    x, F = (sosfiltfilt(low, data[name]) for name in ("disp_in", "friction_force_kip"))
    v = np.gradient(x)
    period = 1024.0 / rate
    # The full strokes down run from 0.26–0.33 to 0.76–0.83 of the third, fourth and fifth period.
    at = np.linspace(2.33, 2.75, int(0.42 * period)) + np.arange(3)[:, None]
    force, *motion = (np.interp(at * period, np.arange(len(x)), s) for s in (F, x, v, np.gradient(v)))
    when = np.array([-1.0, 0.0, 1.0])
    force = force - (when @ force.mean(axis=1) / 2 * when)[:, None]
    off = (force - force.mean(axis=0)).ravel()
    A = np.array([(m - m.mean(axis=0)).ravel() for m in motion]).T
    A = A / np.linalg.norm(A, axis=0)
    left = off - A @ np.linalg.lstsq(A, off, rcond=None)[0]
    size = np.sqrt(2 * force.shape[1] * np.mean(F[int(period / 4) :] ** 2))
    return float(np.linalg.norm(off) / size), float(np.linalg.norm(left) / size)


@pytest.mark.slow
def test_full_strokes_repeat_within_a_few_per_cent_but_for_the_fast_ones(
    report: TraceReport, records: list[Path]
) -> None:
    """On the two fast ones the first stroke is another motion; at 1 Hz it begins 0.5 mm further out, as the actuator
    reaches its limit, and 870 kg times the acceleration is 61 % of the scatter. The floor is what the motion leaves."""
    floor = {name_of(Path(k)): v for k, v in report.noise_floor["force_rel_per_record"].items()}
    own = {name_of(r): scatter_of_strokes(r) for r in records}
    assert report.noise_floor["source"] == "cycles"
    fast = ("1Hz30lbtension1.5amplitude", "2Hz30lbtension0.5amplitude")
    for name, found in floor.items():
        as_it_is, beyond = own[name]
        assert (as_it_is > 0.10) == (name in fast)
        # By another low pass, over another part: at 30 Hz the figures of the fast ones are 8 to 16 % lower.
        assert found == pytest.approx(beyond if name in fast else as_it_is, rel=0.2)
        assert 0.02 < found < 0.10
    overall = np.sqrt(np.mean(np.square(list(floor.values()))))
    assert overall == pytest.approx(0.061, abs=0.01)


@pytest.mark.slow
def test_without_a_hysteretic_law_nothing_is_named(measured: Measurement, monkeypatch: pytest.MonkeyPatch) -> None:
    have = route.catalogue()
    rest = tuple(e for e in have.joint if e.family != "hysteresis")
    monkeypatch.setattr(route, "catalogue", lambda: dataclasses.replace(have, joint=rest))
    report = trace(measured, START)
    assert report.verdict is Verdict.UNEXPLAINED
    assert max(shares(report, 0).values()) < 0.35
    assert report.mended.parameters == START.parameters


def evidence_of(measured: Measurement, names: tuple[str, ...], preparation: route.Preparation | None) -> Evidence:
    sources = [r for r in measured.records if r.condition in names]
    read = read_records(measured, sources)
    prepared = preparation or choose_preparation(measured, read)
    runs = tuple(prepare(measured, r, prepared) for r in read)
    if preparation is not None:
        nothing = PathFloor(np.zeros(0), "unknown", np.zeros(0, dtype=int))
        return Evidence(runs, None, Division((), "sealed"), nothing, law_forces(runs))
    division = divide(runs)
    return Evidence(runs, None, division, repeat_floor(runs, division), law_forces(runs))


OTHERS = (
    "0.5Hz30lbtension0.5amplitude",
    "0.5Hz30lbtension1.5amplitude",
    "0.25Hz30lbtension1amplitude",
    "1Hz30lbtension1amplitude",
    "2Hz30lbtension0.5amplitude",
)


def taught_on_one(measured: Measurement, joint: Joint) -> tuple[float, list[float]]:
    """In-sample error on one record and the errors on five others, fractions."""
    taught = evidence_of(measured, (TAUGHT,), None)
    fitted = fit(taught, Model(joint))
    by_name = {}
    for name in OTHERS:
        other = evidence_of(measured, (name,), taught.recorded[0].preparation)
        residual = judgement.unexplained(other, fitted)
        by_name[name] = float(np.sqrt(np.mean(residual**2) / np.mean(other.force**2)))
    return fitted.in_sample, [by_name[name] for name in OTHERS]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("joint", "taught", "others"),
    [
        (START, 0.426, (0.584, 0.574, 0.585, 0.897, 1.345)),
        (Joint((Jenkins(5e6, 8e3, 2e-3),)), 0.125, (0.133, 0.181, 0.142, 0.199, 0.405)),
    ],
    ids=["spring and damper", "slip behind play"],
)
def test_what_one_record_teaches_holds_on_others_as_published(
    measured: Measurement, joint: Joint, taught: float, others: tuple[float, ...]
) -> None:
    own, found = taught_on_one(measured, joint)
    assert own == pytest.approx(taught, abs=0.01)
    for error, known in zip(found, others, strict=True):
        assert error <= max(known + 0.01, 1.05 * known)


def stop_behind_play(x: Array, slip: float, play: float) -> Array:
    """Elongation of a spring behind play, in series with a slider; written for this test alone."""
    anchor, out = x[0], []
    for position in x:
        anchor = min(max(anchor, position - slip - play), position + slip + play)
        stretch = position - anchor
        out.append(max(stretch - play, 0.0) - max(-stretch - play, 0.0))
    return np.array(out)


def test_another_filter_and_another_slider_find_the_same_gap_between_models(records: list[Path]) -> None:
    """Decimated by a finite impulse response to 128 Hz, play ± 2.5 mm, slip 1.4 mm, each record left out in turn."""
    systems = []
    for record in records:
        data = np.load(record)
        x = decimate(data["disp_in"] * 25.4e-3, 8, ftype="fir")
        F = decimate(data["friction_force_kip"] * 4448.2216, 8, ftype="fir")
        v = np.gradient(x) * 128.0
        first = int(128 * 0.25 / float(name_of(record).split("Hz")[0]))
        A = np.column_stack([x, v, np.ones_like(x), stop_behind_play(x, 1.4e-3, 2.5e-3)])[first:]
        systems.append((A, F[first:], len(x) * np.mean(F[first:] ** 2)))
    for columns, known in ((3, 0.669), (4, 0.207)):
        losses = []
        for left_out, target, _ in systems:
            others = [s for s in systems if s[0] is not left_out]
            A = np.concatenate([a[:, :columns] / np.sqrt(w) for a, _, w in others])
            b = np.concatenate([f / np.sqrt(w) for _, f, w in others])
            size = np.linalg.norm(A, axis=0)
            coefficients = np.linalg.lstsq(A / size, b, rcond=None)[0] / size
            losses.append(np.mean((target - left_out[:, :columns] @ coefficients) ** 2) / np.mean(target**2))
        assert np.sqrt(np.mean(losses)) == pytest.approx(known, abs=0.01)
