"""Closing the loop on a measured linear drive (Janot, Gautier, Brunot 2019, the EMPS benchmark)."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.laws.viscous import Viscous
from jointlib.loop.report import TraceReport, Verdict
from jointlib.loop.trace import trace

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
def report(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    folder = os.environ.get("JOINTLIB_DATA")
    if not folder:
        pytest.skip("JOINTLIB_DATA is not set; it names the folder of the measured records")
    record = Path(folder) / "emps_linear_drive" / "DATA_EMPS.mat"
    if not record.is_file():
        pytest.skip(f"{record} is absent")
    path = tmp_path_factory.mktemp("emps") / "emps.measurement.toml"
    path.write_text(FILE.format(record=record.as_posix()))
    return trace(read_measurement(path), Joint((Viscous(100.0),), "drive"))


def test_mass_viscous_friction_and_offset_leave_a_sixth_of_the_force(report: TraceReport) -> None:
    assert report.error_before["in_sample"] == pytest.approx(0.166, abs=0.001)
    assert report.error_before["heldout_condition"] == pytest.approx(0.253, abs=0.01)


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


def test_the_only_rival_is_an_elastic_contact_of_a_few_micrometres(report: TraceReport) -> None:
    assert {r.family for r in report.rivals} <= {"hysteresis"}
    row = next(c for c in report.candidates if c.family == "hysteresis")
    slip = row.parameters["jenkins.slip_force"].value / row.parameters["jenkins.stiffness"].value
    assert slip < 20e-6


def test_direction_dependent_damping_comes_second_and_then_nothing(report: TraceReport) -> None:
    assert [term["family"] for term in report.secondary] == ["viscous-by-direction"]
    assert [law.kind for law in report.mended.laws] == ["coulomb", "viscous-by-direction"]
    assert report.mended.parameters["viscous_by_direction.damping_negative"] == pytest.approx(248, rel=0.05)
    assert report.mended.parameters["viscous_by_direction.damping_positive"] == pytest.approx(166, rel=0.05)
    assert report.error_after["in_sample"] <= 0.032
    assert report.error_after["heldout_condition"] <= 0.035


def test_three_speeds_are_found_and_their_cycles_repeat_within_a_percent(report: TraceReport) -> None:
    assert len(report.data["conditions"]["found"]) == 3
    assert report.noise_floor["source"] == "cycles"
    assert next(iter(report.noise_floor["force_rel_per_record"].values())) == pytest.approx(0.006, abs=0.001)


def test_the_filter_chosen_from_the_data_is_that_of_the_literature(report: TraceReport) -> None:
    assert report.data["preparation"]["cutoff"] == 50.0
    assert report.data["preparation"]["edge"] == 500
