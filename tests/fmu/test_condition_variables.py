"""Conditions as variables of an FMU: what it says of them, their derivatives and states, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conditioned_joints import COLD, EVERY, LAG, LATE, OF_ALL_KINDS, SPRING, STEP, WARMTH
from host import FMICallException, running
from machine_host import Exchange, Stepping, unpacked
from runtime_library import HEADERS, STRICT
from scipy.integrate import solve_ivp
from tools import require

from fmu.export import export_fmu
from fmu.members.source import source_files
from fmu.system.step_limit import operating_range, step_limit
from fmu.system.system import system_of_joint
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.linear import Linear
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from jointlib.modulation import Modulation
from jointlib.parameter import Role

both_versions = pytest.mark.parametrize("fmi", [2, 3])


@both_versions
def test_the_description_tells_unit_and_start_of_a_condition_and_what_depends_on_it(fmi: int) -> None:
    require("cc")
    read = Stepping(unpacked(LATE, fmi), fmi).read
    known = {v.name: v for v in read.modelVariables}
    told = {
        n: (known[n].causality, known[n].variability, known[n].unit, float(known[n].start))
        for n in ("voltage", "temperature")
    }
    assert told["voltage"] == ("input", "continuous", "V", 1.0)
    assert told["temperature"] == ("input", "continuous", "K", 293.0)
    assert known["followed.voltage"].unit == "V"
    depends = {u.variable.name: {d.name for d in u.dependencies} for u in (*read.outputs, *read.derivatives)}
    assert {"temperature", "followed.voltage"} <= depends["force"]
    assert "voltage" not in depends["force"]
    assert depends["der(followed.voltage)"] == {"voltage", "followed.voltage"}
    assert "voltage" in {d.name for u in read.initialUnknowns if u.variable.name == "force" for d in u.dependencies}


@both_versions
def test_in_model_exchange_the_lag_is_a_state_that_relaxes_as_its_closed_form(fmi: int) -> None:
    require("cc")
    fmu = Exchange(unpacked(SPRING, fmi), fmi, {"displacement": 1e-6, "temperature": 293.0})
    fmu.put({"temperature": 313.0})
    t = np.linspace(0.0, 3 * LAG, 7)
    run = solve_ivp(fmu.slope, (0.0, t[-1]), [293.0], t_eval=t, rtol=1e-12, atol=1e-9)
    v = 313.0 - 20.0 * np.exp(-t / LAG)
    assert fmu.states == ["followed.temperature"]
    assert run.y[0] == pytest.approx(v, rel=1e-9)
    for x, expected in zip(run.y[0], 10.0 * (1 - 0.01 * (v - 293.0)), strict=True):
        fmu.at(np.array([x]))
        assert fmu.get(["force"])[0] == pytest.approx(expected, rel=1e-9)


@both_versions
def test_derivatives_by_conditions_are_those_of_the_force_and_of_the_rates(fmi: int) -> None:
    """Of a spring, a damper and a Maxwell element, told against differences by hand."""
    require("cc")
    start = {"displacement": 2e-6, "velocity": 1e-3, "temperature": 300.0, "voltage": 0.7}
    fmu = Exchange(unpacked(_SLOW, fmi), fmi, start)
    names, still = [*fmu.rates, "force"], fmu.get(fmu.states)

    def moved(known: str, by: float) -> Array:
        if known in fmu.states:
            fmu.at(np.where(np.array(fmu.states) == known, still + by, still))
        else:
            fmu.put({known: start[known] + by})
        return fmu.get(names)

    for known, by in (("voltage", 1e-3), ("temperature", 1e-2), ("followed.voltage", 1e-3), ("displacement", 1e-9)):
        told = fmu.fmu.getDirectionalDerivative([fmu.place[n] for n in names], [fmu.place[known]], [1.0])
        quotient = (moved(known, by) - moved(known, -by)) / (2 * by)
        moved(known, 0.0)
        size = np.maximum(np.abs(quotient), 1e-6 * np.max(np.abs(quotient)))
        assert np.max(np.abs(told - quotient) / size) < 1e-4, known
        assert np.any(quotient != 0)


_SLOW = Joint(
    (Maxwell(3e7, 500.0), Linear(2e7), Viscous(300.0)),
    "slow",
    modulations=(WARMTH, Modulation(Role.DAMPING, "voltage", 1.0, ((0.0, 0.5), (2.0, 1.5)), lag=1e-3)),
)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks gcc")
def test_generated_c_of_a_joint_with_conditions_pleases_a_strict_compiler(tmp_path: Path) -> None:
    for joint in (EVERY, LATE, SPRING):
        folder = tmp_path / joint.name.replace(" ", "_")
        folder.mkdir()
        for name, text in source_files(system_of_joint(joint), "Joint", "token").items():
            (folder / name).write_text(text, encoding="utf-8")
        command = [require("gcc"), *STRICT, "-c", f"-I{HEADERS}", "all.c", "-o", "all.o"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


def test_a_joint_without_conditions_ships_nothing_of_them() -> None:
    plain, own = (source_files(system_of_joint(j), "Joint", "token") for j in (OF_ALL_KINDS, EVERY))
    assert not [name for name, text in plain.items() if "CONDITION" in text.upper()]
    assert set(own) - set(plain) == {"conditions.h", "modulation.h"}
    assert not [name for name, text in plain.items() if text.count("#if") != text.count("#endif")]


def test_leaving_what_is_known_of_conditions_is_logged_once_beside_leaving_that_of_motions(
    capfd: pytest.CaptureFixture[str],
) -> None:
    require("cc")
    fmu = Stepping(unpacked(_SHORT, 2), 2, {"temperature": 312.0})
    for x, temperature in ((5e-7, 314.0), (5e-7, 280.0), (5e-6, 300.0), (6e-6, 320.0)):
        fmu.step({"displacement": x, "temperature": temperature}, STEP)
    said = [line for line in capfd.readouterr().out.splitlines() if "WARNING" in line]
    assert len(said) == 2
    assert "temperature is 314, the joint was identified from 283 to 313" in said[0]
    assert "displacement is 5e-06" in said[1]


_SHORT = replace(SPRING, name="short", validity={"amplitude": (0.0, 1e-6)})


def test_what_is_set_is_what_the_factor_multiplies(tmp_path: Path) -> None:
    require("cc")
    fmu = Stepping(unpacked(SPRING, 2), 2, {"linear.stiffness": 3e7, "temperature": 303.0, "displacement": 1e-6})
    assert fmu.get(["force"])[0] == pytest.approx(30.0 * 0.9, rel=1e-14)


def test_the_admissible_step_is_that_of_the_joint_at_its_stiffest_and_least_damped() -> None:
    damped = Modulation(Role.DAMPING, "voltage", 1.0, ((0.0, 0.5), (1.0, 1.0)))
    joint = Joint((Linear(1e7), Viscous(200.0)), "guide", modulations=(WARMTH, damped))
    limit = step_limit(joint, operating_range(joint))
    assert limit.max_step == pytest.approx(2 * 0.5 * 200.0 / (3 * 1.1 * 1e7), rel=1e-12)


@pytest.mark.parametrize(
    ("joint", "said"),
    [
        (
            replace(
                OF_ALL_KINDS, modulations=(WARMTH, replace(COLD, reference=298.0, table=((283.0, 1.3), (298.0, 1.0))))
            ),
            "at 293 and 298 K",
        ),
        (
            replace(OF_ALL_KINDS, modulations=(replace(WARMTH, table=((293.0, 1.0), (300.0, 0.0))),)),
            "at temperature 300: jenkins: stiffness is 0",
        ),
    ],
    ids=["references", "zero"],
)
def test_conditions_that_no_input_can_be_are_refused_in_a_sentence(joint: Joint, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        export_fmu(joint, tmp_path / "joint.fmu", runtime="python")
    assert not list(tmp_path.iterdir())


def test_a_parameter_that_its_factor_would_take_out_of_its_bounds_is_refused_when_it_is_set(tmp_path: Path) -> None:
    rounder = Modulation(Role.SHAPE, "voltage", 1.0, ((1.0, 1.0), (2.0, 1.5)))
    joint = Joint((BoucWen(3e7, 20.0, 2.0, 0.5),), "bound", modulations=(rounder,))
    require("cc")
    fmu = Stepping(unpacked(joint, 2), 2)
    fmu.put({"bouc_wen.shape": 0.6})
    fmu.step({"displacement": 1e-6}, STEP)
    fmu.put({"bouc_wen.shape": 0.7})
    with pytest.raises(FMICallException):
        fmu.step({"displacement": 1e-6}, STEP)
    file = export_fmu(joint, tmp_path / "joint.fmu", runtime="python").file
    with running([file], tmp_path) as (slave,):
        slave.initialize()
        slave.put({"bouc_wen.shape": 0.6})
        slave.step(1e-6, 0.0)
        slave.put({"bouc_wen.shape": 0.7})
        with pytest.raises(FMICallException):
            slave.step(2e-6, 0.0)
