"""Instances of one guide: state, tuning, refusals, and two FMUs in one process."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest
from host import GUIDE, JOINTS, FMICallException, exported, law_force, path, running

HERTZ = JOINTS[0]


def test_two_joints_run_in_one_process_without_mixing(tmp_path: Path) -> None:
    z, v = path()
    files = [exported(GUIDE).file, exported(HERTZ).file, exported(GUIDE).file]
    with running(files, tmp_path) as fmus:
        for fmu in fmus:
            fmu.initialize(z[0], v[0])
        found = np.array([[fmu.step(z[i], v[i]) for fmu in fmus] for i in range(1, len(z))])
    guide, hertz = (law_force(joint, z, v, 1e-5)[1:] for joint in (GUIDE, HERTZ))
    for column, expected in zip(found.T, (guide, hertz, guide), strict=True):
        assert column == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))


def test_restored_state_repeats_the_motion_bit_for_bit(tmp_path: Path) -> None:
    z, v = path()
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        fmu.initialize()
        for i in range(50):
            fmu.step(z[i], v[i])
        state, before = fmu.fmu.getFMUState(), (fmu.get("force"), fmu.get("jenkins.slider"))
        first = [fmu.step(z[i], v[i]) for i in range(50, 250)]
        fmu.fmu.setFMUState(state)
        assert (fmu.get("force"), fmu.get("jenkins.slider")) == before
        assert [fmu.step(z[i], v[i]) for i in range(50, 250)] == first
        fmu.fmu.freeFMUState(state)


def test_state_travels_between_instances_as_bytes(tmp_path: Path) -> None:
    z, v = path()
    with running([exported(GUIDE).file] * 2, tmp_path) as (one, other):
        for fmu in (one, other):
            fmu.initialize()
        for i in range(120):
            one.step(z[i], v[i])
        state = one.fmu.getFMUState()
        copy = other.fmu.deSerializeFMUstate(one.fmu.serializeFMUstate(state))
        other.fmu.setFMUState(copy)
        assert [other.step(z[i], v[i]) for i in range(120, 250)] == [one.step(z[i], v[i]) for i in range(120, 250)]


def test_slider_starts_where_the_joint_is_initialized(tmp_path: Path) -> None:
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        fmu.initialize(displacement=3e-6)
        assert fmu.get("jenkins.slider") == 3e-6
        fmu.step(9e-6, 0.0)
        jenkins = GUIDE.laws[3]
        slip = jenkins.slip_force / jenkins.stiffness  # type: ignore[attr-defined]
        assert fmu.get("jenkins.slider") == pytest.approx(9e-6 - slip, rel=1e-12)


def test_tuned_parameters_give_the_joint_with_those_parameters(tmp_path: Path) -> None:
    z, v = path()
    values = {"hertz_guide.preload": 900.0, "jenkins.slip_force": 11.0, "viscous.damping": 0.0}
    expected = law_force(GUIDE.with_parameters(values), z, v, 1e-5)
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        fmu.put(values)
        found = fmu.run(z, v, 1e-5)
    assert found == pytest.approx(expected, rel=0, abs=1e-12 * np.max(np.abs(expected)))


def test_reset_gives_a_fresh_instance(tmp_path: Path) -> None:
    z, v = path()
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        first = fmu.run(z, v, 1e-5)
        fmu.put({"viscous.damping": 1.0})
        fmu.fmu.reset()
        assert fmu.get("viscous.damping") == 503.0
        assert np.array_equal(fmu.run(z, v, 1e-5), first)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("displacement", float("nan"), "displacement and velocity are [nan, 0.0], expected finite numbers"),
        ("viscous.damping", float("inf"), "viscous.damping is inf, expected a finite number"),
        ("hertz_guide.kappa", 0.0, "hertz_guide.kappa is 0.0, expected a value above 0.0"),
        ("viscous.damping", -1.0, "viscous.damping is -1.0, expected a value between 0.0 and inf"),
    ],
)
def test_values_that_void_the_joint_fail_the_step_by_name_until_they_are_mended(
    name: str, value: float, said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        good = fmu.get(name)
        fmu.initialize()
        fmu.put({name: value})
        assert np.isnan(fmu.get("force"))
        with pytest.raises(FMICallException):
            fmu.fmu.doStep(0.0, 1e-5)
        fmu.put({name: good})
        mended = fmu.step(1e-6, 0.1)
    expected = law_force(GUIDE, np.array([0.0, 1e-6]), np.array([0.0, 0.1]), 1e-5)[1]
    assert mended == pytest.approx(float(expected), rel=1e-12)
    # A failed call must leave the interpreter whole.
    gc.collect()
    out, err = capfd.readouterr()
    assert said in out + err


def test_parameters_that_do_not_go_together_fail_the_step(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    stribeck = next(joint for joint in JOINTS if joint.laws[0].kind == "stribeck")
    with running([exported(stribeck).file], tmp_path) as (fmu,):
        fmu.put({"stribeck.static_force": 19.0})
        fmu.initialize()
        with pytest.raises(FMICallException):
            fmu.step(0.0, 1.0)
    out, err = capfd.readouterr()
    assert "stribeck: static_force is 19.0 N, expected at least slip_force = 20.0 N" in out + err


@pytest.mark.parametrize("state", [b"\xff nonsense", b"{}", b'{"model": "another"}', b"[]"])
def test_damaged_or_foreign_state_fails_the_step(state: bytes, tmp_path: Path) -> None:
    with running([exported(GUIDE).file], tmp_path) as (fmu,):
        fmu.initialize()
        sound = fmu.fmu.getFMUState()
        fmu.fmu.setFMUState(fmu.fmu.deSerializeFMUstate(state))
        with pytest.raises(FMICallException):
            fmu.fmu.doStep(0.0, 1e-5)
        fmu.fmu.setFMUState(sound)
        assert fmu.step(0.0, 0.0) == 0.0
