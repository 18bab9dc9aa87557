"""Closing the loop on a measured electronic oscillator with a cubic spring (Wigren and Schoukens 2013).

A circuit: force and displacement are voltages, and it tests the engine, not joints.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from jointlib.io.measurement_file import read_measurement
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.loop.answer.report import TraceReport, Verdict
from jointlib.loop.trace import trace

HEAD = """
schema = "jointlib/measurement/1"
kind = "path"
sample_rate = 610.3515625
carriage = "unknown"
[[channel]]
name = "V1"
quantity = "force"
unit = "V"
remove_mean = true
[[channel]]
name = "V2"
quantity = "displacement"
unit = "V"
remove_mean = true
"""
START = Joint((Linear(1.0), Viscous(1e-3)), "circuit")


def measurement_file(folder: Path, arrow: str) -> Path:
    """Ten realisations of the multisine, and four pieces of the growing arrow in the given role."""
    data = os.environ.get("JOINTLIB_DATA")
    if not data:
        pytest.skip("JOINTLIB_DATA is not set; it names the folder of the measured records")
    record = Path(data) / "silverbox" / "SNLS80mV.csv"
    if not record.is_file():
        pytest.skip(f"{record} is absent")
    pieces = [(f"multisine {i}", "fit", 40586 + 8692 * i, 8690) for i in range(10)]
    pieces += [(f"arrow {i}", arrow, 8400 + 8000 * i, 8000) for i in range(4)]
    text = HEAD
    for condition, role, first, count in pieces:
        text += f'[[record]]\nfile = "{record.as_posix()}"\nrole = "{role}"\n'
        text += f'condition = "{condition}"\nrows = [{first}, {first + count}]\n'
    path = folder / "silverbox.measurement.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    """All fourteen pieces take part, each left out in turn."""
    return trace(read_measurement(measurement_file(tmp_path_factory.mktemp("box"), "fit")), START)


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> TraceReport:
    """The arrow is sealed: it reaches larger amplitudes than the multisine that teaches."""
    return trace(read_measurement(measurement_file(tmp_path_factory.mktemp("sealed"), "sealed")), START)


@pytest.mark.slow
def test_the_cubic_spring_is_found_with_the_preload_shape_as_rival(report: TraceReport) -> None:
    assert report.verdict is Verdict.AMBIGUOUS
    assert report.chosen is not None
    assert report.chosen.family == "cubic"
    assert report.chosen.explained is not None
    assert report.chosen.explained >= 0.96
    assert [(r.family, r.declared_pair) for r in report.rivals] == [("preload", True)]
    assert any("volts" in w for w in report.warnings)


@pytest.mark.slow
def test_errors_on_left_out_pieces(report: TraceReport) -> None:
    before, after = report.reduction["steps"]
    assert before["heldout_condition"] == pytest.approx(0.0764, rel=0.05)
    assert after["heldout_condition"] <= 0.0144 * 1.05


@pytest.mark.slow
def test_frequency_damping_and_cubic_coefficient_are_those_of_the_circuit(report: TraceReport) -> None:
    found = {name: e.value for name, e in report.reduction["steps"][1]["parameters"].items()}
    M, k, c = found["mass"], found["linear.stiffness"], found["viscous.damping"]
    assert np.sqrt(k / M) / (2 * np.pi) == pytest.approx(68.3, rel=0.01)
    assert c / (2 * np.sqrt(k * M)) == pytest.approx(0.049, rel=0.05)
    assert found["cubic.stiffness3"] / k == pytest.approx(3.92, rel=0.01)


@pytest.mark.slow
def test_no_further_term_is_worth_it(report: TraceReport) -> None:
    last = report.reduction["steps"][1]["next"]
    assert max(row["share"] for row in last) < 0.15
    assert report.secondary == ()
    rows = {c.member: c for c in report.candidates}
    for member in ("gap", "contact-loss", "quadratic"):
        assert rows[member].share_of_current < 0.9
    assert report.noise_floor["source"] == "band"
    assert max(report.noise_floor["force_rel_per_record"].values()) < 0.006


@pytest.mark.slow
def test_the_circuit_runs_freely_within_a_per_cent_once_the_cubic_is_added(sealed: TraceReport) -> None:
    """Runge–Kutta under the measured input alone; the arrow took no part in the fit."""
    taught, arrow = sealed.resimulation["displacement"], sealed.resimulation["displacement_sealed"]
    assert taught["before"] == pytest.approx(0.1245, rel=0.05)
    assert taught["after"] <= 0.0067 * 1.05
    assert arrow["before"] == pytest.approx(0.270, rel=0.05)
    assert arrow["after"] <= 0.0083 * 1.05
    assert sealed.error_after["where"] == "sealed"
