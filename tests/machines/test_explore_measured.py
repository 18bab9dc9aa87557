"""Measured frequency responses over the receptance of a setting: the differences that ``frf --measured`` has."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from jointlib.cli.main import cli
from jointlib.errors import InputError
from machines import read_machine
from machines.compare.comparison import Comparison, compared
from machines.explore import Explorer

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
TIP = LIBRARY / "three_joints" / "tip.measurement.toml"
STIFFNESS = "connection.bearing.joint.linear.stiffness"


@pytest.fixture(scope="module")
def explorer() -> Explorer:
    return Explorer(LIBRARY / "three_joints.toml", measured=(TIP,))


def off(comparison: Comparison) -> np.ndarray:
    """Frequencies (Hz), damping and compliance (m/N) of what is predicted, of the resonances in both."""
    both = [p.predicted for p in comparison.pairs if p.measured is not None and p.predicted is not None]
    return np.array([[one.frequency, one.damping_ratio, one.compliance] for one in both])


def test_the_differences_are_those_of_the_response_at_the_same_force(explorer: Explorer) -> None:
    """At rest, against the smallest force, at which the guide of the machine moves by a tenth of a micrometre."""
    laid = explorer.laid_over(explorer.curves({}))
    assert [c.record.force for c in laid] == [1.0, 3.0, 8.0, 15.0, 20.0]
    ours, theirs = laid[0], compared(read_machine(LIBRARY / "three_joints.toml"), TIP)[0]
    assert [p.measured for p in ours.pairs] == [p.measured for p in theirs.pairs]
    assert off(ours)[:, 0] == pytest.approx(off(theirs)[:, 0], rel=1e-3)
    assert off(ours)[:, 1:] == pytest.approx(off(theirs)[:, 1:], rel=0.03)
    assert ours.frac == pytest.approx(theirs.frac, abs=2e-3)


def test_they_follow_the_sliders(explorer: Explorer) -> None:
    before = explorer.laid_over(explorer.curves({}))[-1]
    after = explorer.laid_over(explorer.curves({STIFFNESS: 70.0}))[-1]
    assert off(after)[-1, 0] < 0.97 * off(before)[-1, 0]
    assert after.frac < before.frac


def test_the_amplitude_of_the_tool_brings_the_prediction_to_the_record_of_its_force(explorer: Explorer) -> None:
    (record,) = [one for one in explorer.records[0] if one.record.force == 20.0]
    assert record.moved == pytest.approx(8.3e-6, rel=0.02)
    rest, moving = (explorer.laid_over(explorer.curves({"amplitude": A}))[-1] for A in (0.0, 3.0))
    assert moving.frac > rest.frac


@pytest.mark.slow
def test_a_comparison_of_the_machine_file_is_shown_without_being_asked_for(tmp_path: Path) -> None:
    shutil.copytree(LIBRARY / "three_joints", tmp_path / "three_joints")
    text = (LIBRARY / "three_joints.toml").read_text("utf-8")
    text += '\n[[compare]]\nmeasurement = "three_joints/tip.measurement.toml"\n'
    (tmp_path / "m.toml").write_text(text, "utf-8")
    explorer = Explorer(tmp_path / "m.toml")
    assert len(explorer.records[0]) == 5
    page = explorer.report({}, tmp_path / "kept", "seen").read_text("utf-8")
    assert "Measured over predicted" in page
    assert explorer.laid_over(explorer.curves({}))[0].sentence() in page


def test_records_of_other_places_are_named_and_foreign_ones_refused(tmp_path: Path) -> None:
    for name in ("tip_1N.csv", "tip_20N.csv"):
        shutil.copy(TIP.parent / name, tmp_path)
    record = '[[record]]\nfile = "{}"\ndrive = "{}"\nresponse = "spindle.x"\nquantity = "receptance"\nforce = "1 N"\n'
    head = 'schema = "jointlib/measurement/1"\nkind = "frf"\n'
    own, cross = record.format("tip_1N.csv", "spindle.x"), record.format("tip_20N.csv", "slide.x")
    (tmp_path / "two.measurement.toml").write_text(head + own + cross)
    found, said = Explorer(LIBRARY / "three_joints.toml", measured=(tmp_path / "two.measurement.toml",)).records
    assert [one.record.name for one in found] == ["tip_1N.csv"]
    assert "not drawn: tip_20N.csv (spindle.x for a force on slide.x)" in said[0]
    for words, told in ((record.format("tip_1N.csv", "spindel.x"), "did you mean"), ("", "record")):
        (tmp_path / "bad.measurement.toml").write_text(head + words)
        with pytest.raises(InputError, match=told):
            Explorer(LIBRARY / "three_joints.toml", measured=(tmp_path / "bad.measurement.toml",))
    asked = ["explore", str(LIBRARY / "three_joints.toml"), "--measured", str(tmp_path / "none.toml")]
    assert "no such file" in str(CliRunner().invoke(cli, asked).exception)
