"""FMUs of joints whose parameters follow conditions, held against the joint under these conditions in Python."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_library import unpacked as exported
from host import FMICallException, path, running
from machine_host import Exchange, Stepping, unpacked
from runtime_library import HEADERS, HERE, STRICT, compiled
from scipy.integrate import solve_ivp
from tools import require

from fmu.export import export_fmu
from fmu.members.source import source_files
from fmu.system.step_limit import operating_range, step_limit
from fmu.system.system import system_of_joint
from fmu.system.under_conditions import UnderConditions
from fmu.verify import verify_fmu
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.dahl import Dahl
from jointlib.laws.gap import Gap
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.iwan import Iwan
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from jointlib.modulation import Modulation
from jointlib.parameter import Role

LAG = 3e-4
VOLTAGE = Modulation(Role.SLIP_FORCE, "voltage", 1.0, ((0.0, 0.4), (1.0, 1.0), (3.0, 1.7)))
WARMTH = Modulation(Role.STIFFNESS, "temperature", 293.0, ((283.0, 1.1), (293.0, 1.0), (313.0, 0.8)))
COLD = Modulation(Role.SLIP_FORCE, "temperature", 293.0, ((283.0, 1.3), (313.0, 0.4)))
BALLS = Modulation(Role.PRELOAD, "position", 0.0, ((0.0, 1.0), (1e-3, 1.2), (3e-3, 0.9)), period=4e-3)
REMEMBERING = (
    Jenkins(4e7, 36.0, 1e-7),
    BoucWen(3e7, 20.0, 2.0, 0.5),
    Dahl(3e7, 25.0),
    Iwan((2e7, 1e7), (20.0, 30.0)),
    LuGre(4e7, 300.0, 36.0, 50.0, 0.02),
    Maxwell(3e7, 500.0),
)
OF_ALL_KINDS = Joint((*REMEMBERING, HertzGuide(630.0, 3.9e-8), Gap(1e7, 4e-6), Viscous(500.0)), "of all kinds")
EVERY = replace(OF_ALL_KINDS, modulations=(VOLTAGE, WARMTH, COLD, BALLS))
LATE = replace(OF_ALL_KINDS, name="late", modulations=(replace(VOLTAGE, lag=LAG), WARMTH))
SPRING = Joint((Linear(1e7),), "spring", modulations=(replace(WARMTH, lag=LAG),))
PLAIN = replace(EVERY, modulations=())
STEP = 2e-5
_FOLDER = tempfile.TemporaryDirectory(prefix="jointlib-test-")
_MADE: list[tuple[Joint, Path]] = []
KINDS = [("c", 2), ("c", 3), ("python", 2)]
both_versions = pytest.mark.parametrize("fmi", [2, 3])
on_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="loads Linux libraries")


def conditions(joint: Joint) -> list[str]:
    return [c.kind for c in system_of_joint(joint).conditions]


def stepped(joint: Joint, at: Sequence[Mapping[str, float]]) -> Array:
    """Force in N after each step along :func:`path`, a joint of its own at every sample."""
    z, v = path()
    state, force = joint.at(at[0]).initial_state(z[0]), np.empty(z.shape)
    for i, each in enumerate(at):
        force[i], state = joint.at(each).step(Motion(z[i], v[i], STEP if i else 0.0), state)
    return force


def course(joint: Joint, how: str) -> list[dict[str, float]]:
    """Conditions along :func:`path`: ramps through the tables and beyond their ends, or jumps."""
    n = len(path()[0])
    ends = {"voltage": (-0.5, 3.5), "temperature": (280.0, 315.0), "position": (-7e-3, 9e-3)}
    rng = np.random.default_rng(5)
    out = {}
    for k, name in enumerate(conditions(joint)):
        low, high = ends[name]
        swept = np.interp(np.linspace(k, k + 4, n) % 2, [0, 1, 2], [low, high, low])
        out[name] = swept if how == "ramps" else np.repeat(rng.uniform(low, high, n // 7 + 1), 7)[:n]
    return [dict(zip(out, row, strict=True)) for row in np.array(list(out.values())).T.tolist()]


def in_python(joint: Joint) -> Path:
    """The FMU with the Python runtime, made once."""
    known = [file for each, file in _MADE if each is joint]
    if not known:
        known.append(export_fmu(joint, Path(_FOLDER.name) / f"{len(_MADE)}.fmu", runtime="python").file)
        _MADE.append((joint, known[0]))
    return known[0]


def by_fmu(joint: Joint, at: Sequence[Mapping[str, float]], runtime: str, fmi: int, folder: Path) -> Array:
    """The same by an FMU in FMPy."""
    z, v = path()
    rows = [{"displacement": z[i], "velocity": v[i], **each} for i, each in enumerate(at)]
    if runtime == "python":
        with running([in_python(joint)], folder) as (fmu,):
            fmu.fmu.setupExperiment()
            fmu.fmu.enterInitializationMode()
            fmu.put(rows[0])
            fmu.fmu.exitInitializationMode()
            force = [fmu.get("force")]
            for i, row in enumerate(rows[1:]):
                fmu.put(row)
                fmu.fmu.doStep(i * STEP, STEP)
                force.append(fmu.get("force"))
            return np.array(force)
    require("cc")
    fmu = Stepping(unpacked(joint, fmi), fmi, rows[0])
    force = [*fmu.get(["force"])]
    for row in rows[1:]:
        fmu.step(row, STEP)
        force += [*fmu.get(["force"])]
    return np.array(force)


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
    found = []
    for joint in (EVERY, PLAIN):
        folder = tmp_path / str(len(found))
        folder.mkdir()
        found.append(by_fmu(joint, [{}] * n, runtime, fmi, folder))
    assert np.array_equal(*found)


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
    """Of a spring behind a Maxwell element; damping and slip have no part in a spring's force at rest."""
    require("cc")
    joint = _SLOW
    start = {"displacement": 2e-6, "velocity": 1e-3, "temperature": 300.0, "voltage": 0.7}
    fmu = Exchange(unpacked(joint, fmi), fmi, start)
    names = [*fmu.rates, "force"]
    ask = fmu.fmu.getDirectionalDerivative
    for known, unit in (("voltage", 1e-3), ("temperature", 1e-2), ("followed.voltage", 1e-3), ("displacement", 1e-9)):
        told = np.array(ask([fmu.place[n] for n in names], [fmu.place[known]], [1.0]))
        ends = []
        for side in (-1, 1):
            x = np.array([fmu.get([s])[0] for s in fmu.states])
            if known in fmu.states:
                x[fmu.states.index(known)] += side * unit
                fmu.at(x)
            else:
                fmu.put({known: start[known] + side * unit})
            ends.append(fmu.get(names))
            if known in fmu.states:
                x[fmu.states.index(known)] -= side * unit
                fmu.at(x)
            else:
                fmu.put({known: start[known]})
        quotient = (ends[1] - ends[0]) / (2 * unit)
        size = np.maximum(np.abs(quotient), 1e-6 * np.max(np.abs(quotient)))
        assert np.max(np.abs(told - quotient) / size) < 1e-4, known
        assert np.any(quotient != 0)


_SLOW = Joint(
    (Maxwell(3e7, 500.0), Linear(2e7), Viscous(300.0)),
    "slow",
    modulations=(WARMTH, Modulation(Role.DAMPING, "voltage", 1.0, ((0.0, 0.5), (2.0, 1.5)), lag=1e-3)),
)


@on_linux
@both_versions
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


@on_linux
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
            replace(SPRING, modulations=(Modulation(Role.STIFFNESS, "time", 0.0, ((0.0, 1.0), (9.0, 0.9))),)),
            "time, a name",
        ),
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
    ids=["time", "references", "zero"],
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
