"""Closing the loop on a measured linear drive (Janot, Gautier, Brunot 2019, the EMPS benchmark)."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import butter, sosfiltfilt

from jointlib.arrays import Array
from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.viscous import Viscous
from jointlib.laws.viscous_by_direction import ViscousByDirection
from jointlib.loop.answer.report import Status, TraceReport, Verdict
from jointlib.loop.trace import trace
from jointlib.measurement import Measurement

FILE = """
schema = "jointlib/measurement/1"
kind = "path"
sample_rate = "1 kHz"
carriage = "unknown"
[[channel]]
name = "qm"
quantity = "position"
unit = "m"
[[channel]]
name = "vir"
quantity = "force"
unit = "N"
gain = 35.15
[[record]]
file = "{record}"
"""


@pytest.fixture(scope="module")
def record() -> Path:
    folder = os.environ.get("JOINTLIB_DATA")
    if not folder:
        pytest.skip("JOINTLIB_DATA is not set; it names the folder of the measured records")
    path = Path(folder) / "emps_linear_drive" / "DATA_EMPS.mat"
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    return path


@pytest.fixture(scope="module")
def signals(record: Path) -> dict[str, Array]:
    """Reference and measured position (m), controller output (V)."""
    data = loadmat(record)
    return {name: data[name].ravel() for name in ("qg", "qm", "vir")}


def measured(folder: Path, record: Path) -> Measurement:
    path = folder / "emps.measurement.toml"
    path.write_text(FILE.format(record=record.as_posix()))
    return read_measurement(path)


def drive(folder: Path, name: str, position: Array, voltage: Array) -> Measurement:
    """A record like the measured one, with something done to it."""
    np.savez(folder / f"{name}.npz", allow_pickle=False, qm=position, vir=voltage)
    return measured(folder, folder / f"{name}.npz")


@pytest.fixture(scope="module")
def report(record: Path, tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    return trace(measured(tmp_path_factory.mktemp("emps"), record), Joint((Viscous(100.0),), "drive"))


@pytest.mark.slow
def test_mass_viscous_friction_and_offset_leave_a_sixth_of_the_force(report: TraceReport) -> None:
    assert report.error_before["in_sample"] == pytest.approx(0.166, abs=0.001)
    assert report.error_before["heldout_condition"] == pytest.approx(0.253, abs=0.01)


@pytest.mark.slow
def test_dry_friction_is_named_first_with_the_values_of_the_benchmark(report: TraceReport) -> None:
    step = report.reduction["steps"][1]
    assert step["family"] == "coulomb"
    assert step["in_sample"] <= 0.045
    assert step["heldout_condition"] <= 0.0525
    assert step["heldout_block"] <= 0.043
    assert step["explained"] >= 0.95
    values = {name: e.value for name, e in step["parameters"].items()}
    assert values["mass"] == pytest.approx(95.0, rel=0.01)
    assert values["viscous.damping"] == pytest.approx(204.0, rel=0.02)
    assert values["coulomb.slip_force"] == pytest.approx(20.4, rel=0.03)
    assert report.chosen is not None
    assert report.chosen.family == "coulomb"
    assert report.verdict in (Verdict.IDENTIFIED, Verdict.AMBIGUOUS)


@pytest.mark.thorough
def test_the_only_rivals_are_elastic_contacts_of_a_few_micrometres(report: TraceReport) -> None:
    assert {r.family for r in report.rivals} == {"hysteresis"}
    assert "jenkins" in {r.member for r in report.rivals}
    row = next(c for c in report.candidates if c.member == "jenkins")
    slip = row.parameters["jenkins.slip_force"].value / row.parameters["jenkins.stiffness"].value
    assert slip < 20e-6


@pytest.mark.thorough
def test_direction_dependent_damping_comes_second_and_then_nothing(report: TraceReport) -> None:
    assert [term["family"] for term in report.secondary] == ["viscous-by-direction"]
    assert [law.kind for law in report.mended.laws] == ["coulomb", "viscous-by-direction"]
    assert report.mended.parameters["viscous_by_direction.damping_negative"] == pytest.approx(248, rel=0.05)
    assert report.mended.parameters["viscous_by_direction.damping_positive"] == pytest.approx(166, rel=0.05)
    assert report.error_after["in_sample"] <= 0.032
    assert report.error_after["heldout_condition"] <= 0.035


@pytest.mark.thorough
def test_three_speeds_are_found_and_their_cycles_repeat_within_a_percent(report: TraceReport) -> None:
    assert len(report.data["conditions"]["found"]) == 3
    assert report.noise_floor["source"] == "cycles"
    assert next(iter(report.noise_floor["force_rel_per_record"].values())) == pytest.approx(0.006, abs=0.001)


@pytest.mark.thorough
def test_the_filter_chosen_from_the_data_is_that_of_the_literature(report: TraceReport) -> None:
    assert report.data["preparation"]["cutoff"] == 50.0
    assert report.data["preparation"]["edge"] == 500


FRICTION = Joint((Coulomb(20.0, 1e-3), ViscousByDirection(170.0, 240.0)), "drive")


@pytest.fixture(scope="module")
def late(signals: dict[str, Array], tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    """The measured record with its force delayed by 4 ms, beside the full friction model."""
    voltage = np.concatenate([np.full(4, signals["vir"][0]), signals["vir"][:-4]])
    return trace(drive(tmp_path_factory.mktemp("late"), "late", signals["qm"], voltage), FRICTION)


@pytest.mark.slow
def test_a_force_that_comes_late_is_named_and_undone(late: TraceReport) -> None:
    assert late.chosen is not None
    assert (late.chosen.family, late.chosen.channel) == ("lag", "vir")
    assert min(late.chosen.per_fold) > 0
    assert late.verdict is Verdict.PARTIAL
    assert "the force comes late" in late.sentence
    correction = late.corrections[0]
    assert (correction.family, correction.channel) == ("lag", "vir")
    # The record itself leads by 0.6 ms: the controller holds its output for a sample.
    assert correction.parameters["lag"] == pytest.approx(3.4e-3, abs=0.1e-3)
    assert [law.kind for law in late.mended.laws] == ["coulomb", "viscous-by-direction"]


@pytest.mark.slow
def test_undoing_the_lag_leaves_what_the_friction_model_leaves(late: TraceReport, report: TraceReport) -> None:
    before, after = late.reduction["steps"]
    assert before["heldout_condition"] == pytest.approx(0.126, abs=0.01)
    assert after["heldout_condition"] <= 0.038
    assert after["heldout_condition"] <= report.error_after["heldout_condition"]


@pytest.mark.thorough
def test_a_bump_below_dry_friction_fits_and_is_refused(report: TraceReport, signals: dict[str, Array]) -> None:
    """A negative Stribeck bump and a free lag would cut the error by a third; a law must not have it."""
    z, F = (sosfiltfilt(butter(4, 0.1, output="sos"), x) for x in (signals["qm"], 35.15 * signals["vir"]))
    v = np.gradient(z) * 1000
    sign = np.tanh(v / 1e-3)
    plain = [np.gradient(v) * 1000, np.maximum(v, 0), np.minimum(v, 0), sign, np.ones_like(v)]
    more = [*plain, sign * np.exp(-((v / 0.02) ** 2)), np.gradient(F) * 1000]
    errors = []
    for columns in (plain, more):
        A = np.array([sosfiltfilt(butter(4, 0.1, output="sos"), c) for c in columns])[:, 500:-500:20].T
        A[:, :3] = np.array(columns[:3])[:, 500:-500:20].T
        size = np.linalg.norm(A, axis=0)
        b = F[500:-500:20]
        coefficients = np.linalg.lstsq(A / size, b, rcond=None)[0] / size
        errors.append(np.linalg.norm(b - A @ coefficients) / np.linalg.norm(b))
    assert errors[1] < 0.8 * errors[0]
    assert coefficients[5] < 0
    laws = [law.kind for law in report.mended.laws]
    assert "stribeck" not in laws
    assert report.corrections == ()
    for step in report.reduction["steps"][1:]:
        row = next(r for r in step["next"] if r["member"] == "stribeck")
        assert row["status"] in (Status.UNPHYSICAL, Status.REJECTED)


@pytest.mark.thorough
def test_a_drive_has_no_spring_to_run_freely_on(report: TraceReport) -> None:
    free = report.resimulation["displacement"]
    assert free["before"] is None
    assert free["after"] is None
    assert "drifts" in free["reason"]


@pytest.mark.slow
def test_the_controlled_drive_runs_closer_with_each_term(report: TraceReport, signals: dict[str, Array]) -> None:
    """Closed loop: u = kp·kv·(qg − qm) − kv·q̇ with q̇ from the two-sample mean of qm, ± 10 V, held for a millisecond."""
    force, position = [], []
    for step in report.reduction["steps"]:
        u, q = closed_loop({n: e.value for n, e in step["parameters"].items()}, signals["qg"], signals["qm"][0])
        force.append(np.linalg.norm(u - signals["vir"]) / np.linalg.norm(signals["vir"]))
        position.append(np.sqrt(np.mean((q - signals["qm"]) ** 2)))
    assert force[0] == pytest.approx(0.173, abs=0.01)
    assert force[1] <= 0.062
    assert force[2] <= 0.055
    assert position[0] == pytest.approx(6.7e-6, rel=0.05)
    assert position[1] <= 1.9e-6
    assert position[2] <= 1.5e-6


def closed_loop(p: dict[str, float], reference: Array, start: float) -> tuple[Array, Array]:
    """Voltage and position (m) at 1 kHz; semi-implicit steps of 50 µs between the samples of the controller."""
    kp, kv, gain, substeps = 160.18, 243.45, 35.15, 20
    forward = p.get("viscous_by_direction.damping_positive", p.get("viscous.damping", 0.0))
    backward = p.get("viscous_by_direction.damping_negative", p.get("viscous.damping", 0.0))
    dry, smooth = p.get("coulomb.slip_force", 0.0), p.get("coulomb.smoothing_velocity", 1.0)
    M, h = p["mass"], 1e-3 / substeps
    q, v = float(start), 0.0
    seen = [q, q, q]
    voltage, position = np.empty(len(reference)), np.empty(len(reference))
    for i, goal in enumerate(reference.tolist()):
        seen = [q, *seen[:2]]
        speed = ((seen[0] + seen[1]) - (seen[1] + seen[2])) / 2 * 1000
        u = min(max(kp * kv * (goal - q) - kv * speed, -10.0), 10.0)
        voltage[i], position[i] = u, q
        for _ in range(substeps):
            drag = (forward if v > 0 else backward) * v + dry * math.tanh(v / smooth) + p["offset"]
            v += h * (gain * u - drag) / M
            q += h * v
    return voltage, position


@pytest.mark.slow
def test_a_drive_that_lacks_nothing_is_given_nothing(
    report: TraceReport, signals: dict[str, Array], tmp_path: Path
) -> None:
    """Simulated: the fitted model along the measured path, with noise of the spectrum by which cycles differ."""
    p = {n: e.value for n, e in report.reduction["steps"][-1]["parameters"].items()}
    z = sosfiltfilt(butter(4, 0.1, output="sos"), signals["qm"])
    v = np.gradient(z) * 1000
    model = p["mass"] * np.gradient(v) * 1000 + p["offset"]
    model += p["viscous_by_direction.damping_positive"] * np.maximum(v, 0)
    model += p["viscous_by_direction.damping_negative"] * np.minimum(v, 0)
    model += p["coulomb.slip_force"] * np.tanh(v / p["coulomb.smoothing_velocity"])
    # Cycles of 6213 samples repeat to the millisecond; half the variance of their difference is noise.
    F = sosfiltfilt(butter(4, 0.1, output="sos"), 35.15 * signals["vir"])
    period = 6213
    spread = np.fft.rfft(F[500 : 500 + period] - F[500 + period : 500 + 2 * period]) / np.sqrt(2)
    named = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        pieces = -(-len(model) // period)
        phases = np.exp(2j * np.pi * rng.random((pieces, len(spread))))
        noise = np.fft.irfft(spread * phases, period).ravel()[: len(model)]
        found = trace(drive(tmp_path, f"null{seed}", signals["qm"], (model + noise) / 35.15), FRICTION)
        named.append(found.chosen is not None)
    assert sum(named) == 0
