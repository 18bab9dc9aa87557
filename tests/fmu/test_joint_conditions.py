"""Forces of FMUs of joints whose parameters follow conditions, held against the laws under these in Python."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conditioned_joints import (
    EVERY,
    LAG,
    LATE,
    OF_ALL_KINDS,
    PLAIN,
    STEP,
    by_fmu,
    conditions,
    course,
    stepped,
)
from exported_library import unpacked as exported
from host import path
from runtime_library import HEADERS, HERE, compiled
from tools import require

from fmu.export import export_fmu
from fmu.system.under_conditions import UnderConditions
from fmu.verify import verify_fmu
from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.linear import Linear
from jointlib.modulation import Modulation
from jointlib.parameter import Role

KINDS = [("c", 2), ("c", 3), ("python", 2)]


def agree(found: Array, expected: Array) -> None:
    largest = float(np.max(np.abs(expected)))
    assert largest > 100.0
    assert np.max(np.abs(found - expected)) <= 1e-12 * largest


@pytest.mark.parametrize(("runtime", "fmi"), KINDS)
@pytest.mark.parametrize("temperature", [270.0, 283.0, 301.7, 313.0])
def test_under_constant_conditions_the_force_is_that_of_the_joint_there(
    temperature: float, runtime: str, fmi: int, tmp_path: Path
) -> None:
    at = {"voltage": 2.2, "temperature": temperature, "position": 1.8e-3}
    n = len(path()[0])
    expected = stepped(EVERY, [at] * n)
    agree(by_fmu(EVERY, [at] * n, runtime, fmi, tmp_path), expected)
    assert np.max(np.abs(expected - stepped(OF_ALL_KINDS, [{}] * n))) > 10.0


@pytest.mark.parametrize(("runtime", "fmi"), KINDS)
@pytest.mark.parametrize("how", ["ramps", "jumps"])
def test_conditions_that_change_give_the_force_of_the_laws_stepped_under_them(
    how: str, runtime: str, fmi: int, tmp_path: Path
) -> None:
    at = course(EVERY, how)
    agree(by_fmu(EVERY, at, runtime, fmi, tmp_path), stepped(EVERY, at))


@pytest.mark.parametrize(("runtime", "fmi"), KINDS)
def test_with_nothing_connected_the_force_is_that_of_the_joint_without_modulations(
    runtime: str, fmi: int, tmp_path: Path
) -> None:
    n = len(path()[0])
    found = {}
    for name, joint in (("every", EVERY), ("plain", PLAIN)):
        (tmp_path / name).mkdir()
        found[name] = by_fmu(joint, [{}] * n, runtime, fmi, tmp_path / name)
    assert np.array_equal(found["every"], found["plain"])


@pytest.mark.parametrize(("runtime", "fmi"), KINDS)
def test_what_changes_with_time_follows_an_elapsed_time_beside_that_of_the_fmu(
    runtime: str, fmi: int, tmp_path: Path
) -> None:
    warming = Modulation(Role.STIFFNESS, "time", 0.0, ((0.0, 1.0), (3600.0, 1.1)))
    joint, n = Joint((Linear(2e8),), "warming", modulations=(warming,)), len(path()[0])
    expected = stepped(joint, [{"time": 1800.0}] * n)
    agree(by_fmu(joint, [{"elapsed_time": 1800.0}] * n, runtime, fmi, tmp_path), expected)


@pytest.mark.parametrize(("runtime", "fmi"), KINDS)
def test_with_a_lag_parameters_are_behind_the_condition_by_it(runtime: str, fmi: int, tmp_path: Path) -> None:
    """At a held voltage v of lag v' + v = u, in closed form over all steps since it jumped."""
    n, jump, low, high = len(path()[0]), 40, 0.3, 2.7
    at = [{"voltage": low if i < jump else high, "temperature": 293.0} for i in range(n)]
    behind = [high + (low - high) * np.exp(-STEP * max(i - jump + 1, 0) / LAG) for i in range(n)]
    expected = stepped(LATE, [{**each, "voltage": float(v)} for each, v in zip(at, behind, strict=True)])
    agree(by_fmu(LATE, at, runtime, fmi, tmp_path), expected)
    assert np.max(np.abs(expected - stepped(LATE, at))) > 1.0


@pytest.mark.parametrize("joint", [EVERY, LATE], ids=lambda joint: str(joint.name))
def test_the_reference_run_inside_is_that_of_the_laws_and_repeats(joint: Joint, tmp_path: Path) -> None:
    require("cc")
    for runtime, fmi in KINDS:
        file = export_fmu(joint, tmp_path / f"{runtime}{fmi}.fmu", runtime=runtime, fmi=fmi).file
        assert verify_fmu(file).difference <= 1e-12


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads Linux libraries")
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("joint", [EVERY, LATE], ids=lambda joint: str(joint.name))
def test_a_host_without_python_finds_the_force_under_conditions_and_goes_on_from_a_saved_state(
    joint: Joint, fmi: int, tmp_path: Path
) -> None:
    host = compiled("conditioned", ["-Wno-unused-function", f"-I{HEADERS}", HERE / "conditioned_host.c", "-ldl", "-lm"])
    made = exported(export_fmu(joint, tmp_path / "joint.fmu", fmi=fmi, runtime="c").file, tmp_path / "out", fmi)
    (z, v), at, under = path(), course(joint, "ramps"), UnderConditions(joint)
    state, behind = joint.initial_state(z[0]), under.begun(at[0])
    expected = []
    for i in range(1, len(z)):
        force, state, behind = under.step(Motion(z[i], v[i], STEP), at[i], state, behind)
        expected.append(float(force))
    order = [made.references[name] for name in conditions(joint)]
    assert order == list(range(3, 3 + len(order)))
    rows = [" ".join(repr(float(x)) for x in (z[i], v[i], *at[i].values())) for i in range(len(z))]
    text = "\n".join([str(len(z) - 1), rows[0], *(f"{STEP!r} {row}" for row in rows[1:])]) + "\n"
    command = [str(host), str(fmi), str(made.library), made.token, str(len(order))]
    done = subprocess.run(command, input=text, capture_output=True, text=True, env={}, timeout=120)
    assert done.returncode == 0, done.stdout
    agree(np.array([float(x) for x in done.stdout.split()]), np.array(expected))
    assert done.stderr.startswith("1: fmi")
    assert "said once" in done.stderr
