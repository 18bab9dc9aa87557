"""``jointlib trace`` of a joint as its help shows it: what it leaves, and the keys that programs rely on."""

from __future__ import annotations

import contextlib
import json

import pytest
from command_line import examples, jointlib, with_library
from conftest import Left

pytestmark = pytest.mark.thorough
VERDICTS = {"identified", "ambiguous", "partial", "unexplained", "nothing_missing"}


@pytest.fixture(scope="module")
def guide_trace(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """The first example of ``jointlib trace``, of a joint, with ``--json``."""
    command, _, _ = examples("trace")
    folder = with_library(tmp_path_factory.mktemp("trace") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(f"{command} --json"), folder / "traced")


@pytest.mark.slow
def test_the_example_of_trace_works(guide_trace: Left) -> None:
    assert guide_trace.done.status == 0, guide_trace.done.err
    assert {path.name for path in guide_trace.folder.iterdir()} == {
        "trace.json",
        "trace.npz",
        "joint.toml",
        "report.html",
    }


def test_trace_prints_the_report_it_wrote(guide_trace: Left) -> None:
    data = guide_trace.done.json
    assert data == json.loads((guide_trace.folder / "trace.json").read_text())
    promised = (
        "route baseline data noise_floor error_before localisation candidates verdict chosen rivals chain secondary "
        "error_after reduction resimulation unexplained not_decidable next_experiment warnings repro"
    )
    assert set(promised.split()) <= set(data)
    assert data["verdict"] in VERDICTS
    assert data["route"] == "periodic"


def test_errors_of_a_trace_are_fractions_of_the_joint_force(guide_trace: Left) -> None:
    data = guide_trace.done.json
    before, after = data["error_before"], data["error_after"]
    assert 0 < after["relative"] < before["relative"] < 1
    assert 0 < after["in_sample"] < before["in_sample"] < 1
    assert before["where"] == after["where"] == "sealed"
    assert before["relative"] / after["relative"] == pytest.approx(before["joint_N"] / after["joint_N"], rel=1e-6)


def test_candidates_of_a_trace_carry_parameters_and_one_status(guide_trace: Left) -> None:
    data = guide_trace.done.json
    wanted = "family member params gain_heldout per_fold share_of_current explained rank status reason"
    for row in data["candidates"]:
        assert set(wanted.split()) <= set(row)
        assert row["status"] in {"accepted", "tied", "rejected", "unphysical"}
    if data["chosen"] is not None:
        assert data["chosen"]["family"] in [row["family"] for row in data["candidates"]]
