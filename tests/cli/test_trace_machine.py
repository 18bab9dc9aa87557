"""``jointlib trace --machine`` as its help shows it: the joint that was altered, and files to go on with."""

from __future__ import annotations

import contextlib
import json

import numpy as np
import pytest
from command_line import LIBRARY, examples, jointlib, with_library
from conftest import Left

from jointlib.io.joint_file import joint_table, read_joint
from machines import read_machine

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def machine_trace(tmp_path_factory: pytest.TempPathFactory) -> Left:
    """The second example of ``jointlib trace``, of a machine."""
    _, command, _ = examples("trace")
    folder = with_library(tmp_path_factory.mktemp("machine_trace") / "here")
    with contextlib.chdir(folder):
        return Left(command, jointlib(command), folder / "traced")


@pytest.mark.slow
def test_it_names_the_guide_and_its_friction_and_the_error_falls_to_the_noise(machine_trace: Left) -> None:
    assert machine_trace.done.status == 0, machine_trace.done.err
    found = json.loads((machine_trace.folder / "trace.json").read_text())
    assert found["place"] == "guide"
    assert found["chosen"]["family"] == "coulomb"
    # What is hidden is v/hypot(v, corner), another shape than the law that is named: 2 N for large v.
    assert found["chosen"]["parameters"]["coulomb.slip_force"]["value"] == pytest.approx(2.0, rel=0.1)
    assert found["error_before"]["where"] == "sealed"
    assert found["error_after"]["relative"] < 1.2 * found["noise_floor"]["relative"]
    assert found["error_before"]["relative"] > 5 * found["error_after"]["relative"]
    assert machine_trace.done.out.startswith(f"{found['verdict']}: {found['sentence']}\n")


def test_it_writes_what_it_says(machine_trace: Left) -> None:
    names = {path.name for path in machine_trace.folder.iterdir()}
    assert names == {"trace.json", "trace.npz", "joint.toml", "machine.toml", "report.html"}
    assert all(f"wrote traced/{name}\n" in machine_trace.done.out for name in names)
    with np.load(machine_trace.folder / "trace.npz") as arrays:
        assert np.iscomplexobj(arrays["measured_0"])
        assert len(arrays["frequency_0"]) == len(arrays["after_0"]) == len(arrays["deviation_0"])


def test_the_mended_machine_is_the_old_one_but_for_the_guide(machine_trace: Left) -> None:
    old, new = read_machine(LIBRARY / "three_joints.toml"), read_machine(machine_trace.folder / "machine.toml")
    for a, b in zip(old.flexible, new.flexible, strict=True):
        assert (a.name, a.between) == (b.name, b.between)
        if a.name != "guide":
            assert a.joint == b.joint
    guide = dict(zip([c.name for c in new.flexible], new.joints(), strict=True))["guide"]
    assert joint_table(guide) == joint_table(read_joint(machine_trace.folder / "joint.toml"))
    assert [law.kind for law in guide.laws] == ["hertz-guide", "viscous", "coulomb"]


def test_the_page_shows_every_record_that_was_fitted(machine_trace: Left) -> None:
    page = (machine_trace.folder / "report.html").read_text()
    for said in ("Which joint, and what changes in it", "tip_15N.csv", "not measured"):
        assert said in page
    assert page.count("<svg") == 3


def test_going_on_from_the_mended_machine_finds_nothing_more(machine_trace: Left) -> None:
    with contextlib.chdir(machine_trace.folder.parent):
        tip = "machines/library/three_joints/tip.measurement.toml"
        again = jointlib(f"trace {tip} --machine traced/machine.toml -o again --json")
        assert again.status == 0, again.err
        assert again.json["verdict"] == "nothing_missing"
        assert again.json["place"] is None
        assert not (machine_trace.folder.parent / "again" / "joint.toml").exists()
        into = jointlib(f"trace {tip} --machine traced/machine.toml -o traced")
        assert into.status == 2
        assert "its machine.toml belongs to the machine to be traced" in into.err


def test_inspect_shows_forces_and_noise_and_leaves_the_sealed_record_closed() -> None:
    done = jointlib(f"inspect {LIBRARY / 'three_joints' / 'tip.measurement.toml'}")
    assert done.status == 0, done.err
    rows = {line.split()[0]: line for line in done.out.splitlines()}
    assert "not opened" in rows["tip_15N.csv"]
    for force in (1, 3, 8, 20):
        assert "from neighbours" in rows[f"tip_{force}N.csv"]
        share = float(rows[f"tip_{force}N.csv"].split(" %")[0].split()[-1])
        assert share == pytest.approx(1.0, abs=0.25)
