"""Campaigns that follow a plan end as it said, on records of the independent generator."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from generator import Rig
from planned_machine import ended_as_said as machine_ended_as_said
from planned_machine import measured
from planned_rig import campaign, ended_as_said

from jointlib import read_joint, read_measurement, trace
from jointlib.planning.plan import plan_rig
from jointlib.planning.setup import setup_of
from jointlib.planning.written import write_plan
from jointlib.shown.progress import Silent
from machines import plan as plan_files
from machines import read_machine, trace_machine

JOINT = """schema = "jointlib/joint/1"
name = "guide"
[[law]]
kind = "linear"
stiffness = 6.54e8
[[law]]
kind = "viscous"
damping = 500.0
[validity]
amplitude = [0, 3.2e-6]
"""
RIG = """schema = "jointlib/measurement/1"
kind = "rig"
sample_rate = "102400 Hz"
driven = "runner_block"
[bodies]
runner_block = 0.942
rail = 1.1
block = 1.1
[[channel]]
name = "a1"
quantity = "acceleration"
body = "runner_block"
[[channel]]
name = "a2"
quantity = "acceleration"
body = "rail"
[[channel]]
name = "a3"
quantity = "acceleration"
body = "block"
[[channel]]
name = "P"
quantity = "force"
[[record]]
file = "none.csv"
"""


def planned(folder: Path, effects: tuple[str, ...], decibel: float) -> dict[str, Any]:
    """A plan written into a folder, as its numbers."""
    (folder / "guide.joint.toml").write_text(JOINT)
    (folder / "like.measurement.toml").write_text(RIG)
    joint = read_joint(folder / "guide.joint.toml")
    setup = setup_of(joint, read_measurement(folder / "like.measurement.toml"), {}, None, None, decibel)
    write_plan(plan_rig(setup, joint, effects, 0.02, 0, Silent()), folder / "plan", "guide.joint.toml")
    found: dict[str, Any] = json.loads((folder / "plan" / "plan.json").read_text())
    return found


def counted(folder: Path, plan: dict[str, Any], campaigns: int) -> tuple[int, int, list[str]]:
    """Campaigns that ended as said, all of them, and how the others ended; every effect in turn, nothing among them."""
    names = [e["hidden"] or "" for e in plan["ends"]]
    right = done = number = 0
    others = []
    while done < campaigns:
        name = names[number % len(names)]
        number += 1
        if not campaign(folder / "plan", plan, Rig(), name, number):
            continue
        report = trace(read_measurement(folder / "plan" / "measurement.toml"), read_joint(folder / "guide.joint.toml"))
        done += 1
        if ended_as_said(plan, name, report):
            right += 1
        else:
            others.append(f"{name or 'nothing'}: {report.sentence}")
    return right, done, others


THREE_JOINTS = Path(__file__).parents[2] / "machines" / "library" / "three_joints.toml"


def counted_on_machine(folder: Path, plan: dict[str, Any], campaigns: int) -> tuple[int, int, list[str]]:
    """The same on the machine of three joints, integrated in time."""
    names = [e["hidden"] or "" for e in plan["ends"]]
    machine = read_machine(THREE_JOINTS)
    right = done = number = 0
    others = []
    while done < campaigns:
        name = names[number % len(names)]
        number += 1
        if not measured(folder, plan, name, number):
            continue
        report = trace_machine(read_measurement(folder / "measurement.toml"), machine)
        done += 1
        if machine_ended_as_said(plan, name, report):
            right += 1
        else:
            others.append(f"{name or 'nothing'}: {report.sentence}")
    return right, done, others


@pytest.mark.slow
def test_a_campaign_that_follows_a_plan_ends_as_it_said(tmp_path: Path) -> None:
    plan = planned(tmp_path, ("quadratic-damping",), 50.0)
    assert [(d["effect"], d["alone"]) for d in plan["decides"]] == [("quadratic-damping", True)]
    right, done, others = counted(tmp_path, plan, 2)
    assert right == done, others


@pytest.mark.slow
def test_of_fifty_campaigns_ninety_five_in_a_hundred_end_as_the_plan_said(tmp_path: Path) -> None:
    plan = planned(tmp_path, (), 50.0)
    assert len(plan["decides"]) >= 10
    right, done, others = counted(tmp_path, plan, 50)
    assert right >= 0.95 * done, others


@pytest.mark.slow
def test_the_same_holds_where_noise_is_ten_times_as_large(tmp_path: Path) -> None:
    plan = planned(tmp_path, (), 30.0)
    right, done, others = counted(tmp_path, plan, 50)
    assert right >= 0.95 * done, others


@pytest.mark.slow
def test_a_test_of_a_machine_ends_as_its_plan_said(tmp_path: Path) -> None:
    plan = plan_files(THREE_JOINTS, effects=("guide:coulomb", "bearing:refit"), folder=tmp_path / "plan").as_json()
    assert {d["effect"] for d in plan["decides"] if d["alone"]} == {"bearing:refit"}
    assert "guide:stribeck" in next(e["named"] for e in plan["ends"] if e["hidden"] == "guide:coulomb")
    right, done, others = counted_on_machine(tmp_path / "plan", plan, 3)
    assert right == done, others


@pytest.mark.slow
def test_of_fifty_tests_of_a_machine_ninety_five_in_a_hundred_end_as_the_plan_said(tmp_path: Path) -> None:
    plan = plan_files(THREE_JOINTS, folder=tmp_path / "plan").as_json()
    assert len(plan["decides"]) >= 12
    right, done, others = counted_on_machine(tmp_path / "plan", plan, 50)
    assert right >= 0.95 * done, others
