"""A machine as a system of FMUs: its structure, the same motion in two masters as in one solver, its step limit."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from fmpy import read_model_description, simulate_fmu
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from scipy.integrate import solve_ivp
from tools import package

import fmu.ssp
from fmu.loop_step import Loop, Master, largest_step
from fmu.members.archive import archive_bytes, read_archive
from fmu.members.machine_parts import parts_of_machine
from fmu.playback.ssp_replay import replay
from fmu.ssp import SspExport, export_ssp
from fmu.systems.ssd import INNER_SSD, NAMESPACES, SSD, check_structure
from fmu.systems.ssp_notes import step_notes
from fmu.systems.ssp_verify import verify_ssp
from fmu.systems.ssv import SSV, check_parameters
from jointlib import read_joint
from jointlib.arrays import Array
from jointlib.cli.main import cli
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.law import Motion
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.cubic import Cubic
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import read_machine
from machines.components.component import Component
from machines.components.connection import Connection, Identify
from machines.components.lumped import Lumped
from machines.components.static_load import StaticLoad
from machines.model.machine import Machine

LIBRARY = Path(__file__).parents[2] / "machines" / "library"
TWO_MASS = LIBRARY / "two_mass.toml"
GUIDE_BODY = LIBRARY / "guide_body.toml"
SOFT_K, SOFT_C, SOFT_K3 = 1e5, 150.0, 1e9


def soft_joint(c: float = SOFT_C) -> Joint:
    return Joint((Linear(stiffness=SOFT_K), Cubic(stiffness3=SOFT_K3), Viscous(damping=c)), "mount", validity=RANGE)


RANGE = {"amplitude": (0.0, 1e-3), "velocity": (0.0, 0.1)}


def soft_machine(joint: Joint | None = None) -> Machine:
    """Two masses on a soft hardening mount; the base stands on the ground by its own spring and damper."""
    base = Lumped("base", ("x",), np.array([[4.0]]), np.array([[80.0]]), np.array([[5e5]]))
    mount = Connection("mount", ("base.x", "table.x"), joint or soft_joint())
    return Machine((Lumped("table", ("x",), np.array([[2.0]])), base), (mount,), "soft", {"x": "table.x"})


@dataclass(frozen=True)
class Made:
    """A system of FMUs and what the export said about it."""

    file: Path
    done: SspExport


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> Made:
    file = tmp_path_factory.mktemp("soft") / "soft.ssp"
    return Made(file, export_ssp(replace(soft_machine(), author="A < B"), file))


@pytest.fixture(scope="module")
def two_mass(tmp_path_factory: pytest.TempPathFactory) -> Made:
    file = tmp_path_factory.mktemp("two_mass") / "two_mass.ssp"
    return Made(file, export_ssp(read_machine(TWO_MASS), file))


def solved(
    masses: tuple[float, float], ground: tuple[float, float], joint: Joint, force: Callable[[float], float], time: Array
) -> Array:
    """Displacement of the driven mass, from the equations of two masses written out, in one solver."""
    rest = joint.initial_state(0.0)

    def rate(t: float, x: Array) -> list[float]:
        f = float(joint.step(Motion(x[0] - x[1], x[2] - x[3]), rest)[0])
        base = f - ground[0] * x[1] - ground[1] * x[3]
        return [x[2], x[3], (force(t) - f) / masses[0], base / masses[1]]

    done = solve_ivp(rate, (0.0, time[-1]), np.zeros(4), t_eval=time, rtol=1e-10, atol=1e-14, max_step=time[-1] / 200)
    return np.asarray(done.y[0])


def soft_solved(force: Callable[[float], float], time: Array) -> Array:
    return solved((2.0, 4.0), (5e5, 80.0), soft_joint(), force, time)


def in_fmpy(file: Path, step: float, steps: int, force: Callable[[float], float]) -> tuple[Array, Array]:
    """Time at the end of each step and the tool's displacement then."""
    rows = simulate_ssp(str(file), stop_time=(steps - 0.5) * step, step_size=step, input={"force_x": force})
    return rows["time"] + step, rows["displacement_x"]


def in_container(
    file: Path, folder: Path, step: float, steps: int, force: Callable[[float], float], sequential: bool = False
) -> tuple[Array, Array]:
    """The same from one FMU that fmucontainer makes of the system, with this step inside.

    It steps the FMUs of an SSP at once; one after the other only those of a JSON file, which it makes of the SSP.
    """
    package("fmu_manipulation_toolbox")
    name = file.stem + "_" + re.sub(r"\W", "_", f"{step:g}")
    (folder / f"{name}.ssp").write_bytes(file.read_bytes())
    contain(folder, f"{name}.ssp:{step!r}", "-dump-json")
    if sequential:
        asked = json.loads((folder / f"{name}-dump.json").read_text())
        order = [f"{name}.dir/{element.name}.fmu" for element in read_ssd(str(file)).system.elements]
        assert sorted(order) == sorted(asked["fmu"])
        (folder / f"{name}.json").write_text(json.dumps({**asked, "fmu": order, "sequential": True}))
        contain(folder, f"{name}.json")
    time = step * np.arange(steps + 1)
    table = np.array([(t, force(t)) for t in time], dtype=[("time", float), ("force_x", float)])
    rows = simulate_fmu(
        str(folder / f"{name}.fmu"),
        stop_time=time[-1],
        output_interval=step,
        input=table,
        output=["displacement_x"],
        use_event_mode=False,
    )
    return rows["time"][1:], rows["displacement_x"][1:]


def contain(folder: Path, *options: str) -> None:
    """Let fmucontainer make an FMU."""
    command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmucontainer", "-fmu-directory", str(folder)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(
        [*command, "-container", *options], capture_output=True, text=True, env=environment, cwd=folder
    )
    assert done.returncode == 0, done.stdout + done.stderr


def pulse(length: float, size: float) -> Callable[[float], float]:
    """A smooth push that begins and ends at zero, N."""
    return lambda t: size * math.sin(math.pi * t / length) ** 2 if t < length else 0.0


@pytest.mark.slow
def test_the_document_follows_the_schema_and_names_what_it_joins(soft: Made) -> None:
    system = read_ssd(str(soft.file), validate=True).system
    assert ElementTree.fromstring(read_archive(soft.file)[SSD]).get("author") == "A < B"
    assert [element.name for element in system.elements] == ["base", "table", "mount"], (
        "bodies first, each group sorted"
    )
    assert {c.name: c.kind for c in system.connectors} == {
        "force_x": "input",
        "displacement_x": "output",
        "velocity_x": "output",
    }
    names = {element.name: {c.name for c in element.connectors} for element in system.elements}
    assert names["base"] == {"force_mount", "displacement_mount", "velocity_mount"}
    assert names["table"] == names["base"] | {"force_x", "displacement_x", "velocity_x"}
    assert names["mount"] == {f"{q}_{i}" for q in ("displacement", "velocity", "force") for i in (1, 2)}
    wires = {(c.startElement, c.startConnector, c.endElement, c.endConnector) for c in system.connections}
    assert ("mount", "force_1", "base", "force_mount") in wires, "the first side of the connection is the base"
    assert ("table", "velocity_mount", "mount", "velocity_2") in wires
    assert len(wires) == 9


@pytest.mark.thorough
def test_a_second_document_is_the_same_without_connectors_of_the_system(soft: Made, tmp_path: Path) -> None:
    members = read_archive(soft.file)
    (tmp_path / "inner.ssp").write_bytes(archive_bytes({**members, SSD: members[INNER_SSD]}))
    shown, inside = (read_ssd(str(file), validate=True).system for file in (soft.file, tmp_path / "inner.ssp"))
    assert inside.connectors == []
    assert [[c.name for c in e.connectors] for e in inside.elements] == [
        [c.name for c in e.connectors] for e in shown.elements
    ]
    assert len(inside.connections) == len(shown.connections) - 3


def test_the_parameter_set_holds_what_the_joints_start_with(soft: Made, tmp_path: Path) -> None:
    members = read_archive(soft.file)
    assert f'<ssd:ParameterBinding source="{SSV}" />'.encode() in members[SSD]
    (tmp_path / "mount.fmu").write_bytes(members["resources/mount.fmu"])
    starts = {v.name: v.start for v in read_model_description(str(tmp_path / "mount.fmu")).modelVariables}
    listed = {p.name: float(p.value) for p in read_ssv(str(soft.file), SSV, validate=True).parameters}
    assert listed == {f"mount.{name}": float(starts[name]) for name in starts if f"mount.{name}" in listed}
    assert listed == {
        "mount.linear.stiffness": SOFT_K,
        "mount.cubic.stiffness3": SOFT_K3,
        "mount.viscous.damping": SOFT_C,
    }
    wrong = members[SSV].replace(repr(SOFT_C).encode(), b"151.0")
    with pytest.raises(CheckFailed, match=r"mount\.viscous\.damping = 151\.0, its FMU starts with 150\.0"):
        check_parameters(Path("wrong.ssp"), {**members, SSV: wrong})


@pytest.mark.slow
def test_a_set_that_was_edited_is_the_machine_with_that_joint(soft: Made, tmp_path: Path) -> None:
    """FMPy takes no set by itself, but one that it is handed."""
    edited = tmp_path / "joints.ssv"
    edited.write_bytes(read_archive(soft.file)[SSV].replace(repr(SOFT_C).encode(), b"300.0"))
    assert soft.done.max_step is not None
    step = soft.done.max_step / 4
    run = partial(simulate_ssp, stop_time=200 * step, step_size=step, input={"force_x": lambda t: 10.0})
    bound = run(str(soft.file), parameter_set=read_ssv(str(edited), validate=True))
    export_ssp(soft_machine(soft_joint(300.0)), tmp_path / "other.ssp")
    expected, as_exported = (run(str(file)) for file in (tmp_path / "other.ssp", soft.file))
    np.testing.assert_array_equal(bound["displacement_x"], expected["displacement_x"])
    assert np.max(np.abs(bound["displacement_x"] - as_exported["displacement_x"])) > 0


@pytest.mark.slow
def test_the_step_that_is_published_is_that_of_the_assembled_machine(soft: Made, two_mass: Made) -> None:
    k = SOFT_K + 3 * SOFT_K3 * 1e-6
    loop = Loop(
        np.diag([2.0, 4.0]),
        np.diag([0.0, 80.0]),
        np.diag([0.0, 5e5]),
        np.array([[1.0, -1.0]]),
        np.array([k]),
        np.array([SOFT_C]),
    )
    assert soft.done.max_step == pytest.approx(largest_step(loop, Master.JACOBI), rel=1e-5)
    assert soft.done.masters["gauss_seidel"] == pytest.approx(largest_step(loop, Master.GAUSS_SEIDEL), rel=1e-5)
    assert two_mass.done.max_step == pytest.approx(2 * 463.062 / (3 * 654.164e6), rel=0.06)
    for made in (soft, two_mass):
        assert made.done.max_step is not None
        assert made.done.recommended_step == pytest.approx(made.done.max_step / 20)
        text = read_archive(made.file)[SSD].decode()
        assert f'jacobiMaxStep="{made.done.max_step!r}"' in text
        assert f'gaussSeidelMaxStep="{made.done.masters["gauss_seidel"]!r}"' in text
        assert f'recommendedStep="{made.done.recommended_step!r}"' in text
        assert f'<oms:FixedStepMaster description="oms-ma" stepSize="{made.done.recommended_step!r}"' in text
    assert read_ssd(str(two_mass.file)).system.name == "two_mass", "OMSimulator takes identifiers only"


@pytest.mark.thorough
def test_another_road_is_advised_where_the_coupling_sets_the_step(soft: Made, two_mass: Made) -> None:
    assert any("jointlib fmu MACHINE" in message for message in two_mass.done.messages)
    assert not any("jointlib fmu MACHINE" in message for message in soft.done.messages)
    loop = Loop(np.eye(1), np.eye(1), np.eye(1), np.ones((1, 1)), np.array([SOFT_K]), np.array([SOFT_C]))
    steps: dict[Master, float | None] = {Master.JACOBI: 1e-3, Master.GAUSS_SEIDEL: 3e-3}
    for highest, advised in ((49.0, True), (51.0, False)):
        parts = parts_of_machine(replace(soft_machine(), frequency=(1.0, highest)))
        said = step_notes(parts, loop, steps, {})
        assert any("jointlib fmu MACHINE" in sentence for sentence in said) == advised


@pytest.mark.slow
def test_fmpy_moves_the_soft_machine_as_one_solver_does_the_better_the_smaller_the_step(soft: Made) -> None:
    push, errors, runs = pulse(0.02, 60.0), [], []
    for step in (4e-5, 2e-5, 1e-5):
        time, x = in_fmpy(soft.file, step, round(0.06 / step), push)
        exact = soft_solved(push, time)
        errors.append(np.max(np.abs(x - exact)) / np.max(np.abs(exact)))
        runs.append(x)
    assert errors[-1] < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.05)
    # What is left after the part that is proportional to the step has been taken out.
    extrapolated = 2 * runs[-1][1::2] - runs[-2]
    assert np.max(np.abs(extrapolated - exact[1::2])) < 5e-5 * np.max(np.abs(exact))


@pytest.mark.slow
def test_fmpy_moves_the_two_masses_of_the_library_as_one_solver_does(two_mass: Made) -> None:
    push, errors = pulse(1e-4, 1500.0), []
    joint = read_joint(TWO_MASS.with_name("two_mass.joint.toml"))
    for step in (2e-8, 1e-8):
        time, x = in_fmpy(two_mass.file, step, round(1.5e-4 / step), push)
        exact = solved((0.942, 2.2), (2e8, 200.0), joint, push, time)
        errors.append(np.max(np.abs(x - exact)) / np.max(np.abs(exact)))
    linear = replace(joint, laws=tuple(law for law in joint.laws if law.kind != "cubic"))
    without = solved((0.942, 2.2), (2e8, 200.0), linear, push, time)
    assert errors[-1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert np.max(np.abs(without - exact)) / np.max(np.abs(exact)) > 5 * errors[-1], "the cubic spring matters here"


@pytest.mark.thorough
def test_each_structure_has_a_name_of_its_own_and_names_the_master_that_steps_it(two_mass: Made) -> None:
    """What OMSimulator 3 reads: variants by their names, the settings of a solver, its name at each element."""
    members = read_archive(two_mass.file)
    roots = [ElementTree.fromstring(members[name]) for name in (SSD, INNER_SSD)]
    assert [root.get("name") for root in roots] == ["two_mass", "two_mass_without_connectors"]
    for root in roots:
        system = root.find("ssd:System", NAMESPACES)
        assert system is not None
        assert system.get("name") == root.get("name")
        noted = "ssd:Annotations/ssc:Annotation[@type='org.openmodelica']/oms:Annotations/oms:SimulationInformation"
        (told,) = system.findall(noted, NAMESPACES)
        assert told.get("method") == "oms_ma"
        assert float(told.get("fixedStepSize", "nan")) == two_mass.done.recommended_step
        elements = system.findall("ssd:Elements/ssd:Component", NAMESPACES)
        assert len(elements) == 3
        for element in elements:
            assert element.get("implementation") == "CoSimulation"
            assert [x.get("name") for x in element.findall(noted, NAMESPACES)] == [told.get("name")]


def test_omsimulator_3_takes_the_system_and_its_step(soft: Made, tmp_path: Path) -> None:
    package("OMSimulator")
    force, end = 40.0, 0.02
    script = f"""
from OMSimulator import SSP, CRef
model = SSP({str(soft.file)!r}).instantiate()
model.setValue(CRef("soft", "force_x"), {force})
model.setStopTime({end})
model.setResultFile("soft.csv")
model.initialize()
model.simulate()
print("displacement", model.getValue(CRef("soft", "table", "displacement_x")))
model.terminate()
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    found = float(next(line.split()[1] for line in done.stdout.splitlines() if line.startswith("displacement")))
    assert found == pytest.approx(soft_solved(lambda _: force, np.array([0.0, end]))[-1], rel=0.02)


@pytest.mark.slow
def test_joints_and_bodies_in_fmi_3_move_as_those_in_fmi_2(soft: Made, tmp_path: Path) -> None:
    file = tmp_path / "soft3.ssp"
    assert export_ssp(soft_machine(), file, fmi=3).masters == soft.done.masters
    root = ElementTree.fromstring(read_archive(file)[SSD])
    assert root.get("version") == "2.0"
    assert root.findall(".//ssc:Real", NAMESPACES) == []
    push, step, steps = pulse(0.02, 60.0), 2e-5, 400
    request = {"fmi": 3, "file": str(file), "step": step, "steps": steps}
    found = replay({**request, "inputs": {"force_x": [push(i * step) for i in range(steps)]}})
    _, expected = in_fmpy(soft.file, step, steps, push)
    assert found["displacement_x"] == pytest.approx(expected, rel=1e-12, abs=1e-18)
    with pytest.raises(InputError, match="fmi is 4, expected 2 or 3"):
        export_ssp(soft_machine(), file, fmi=4)


@pytest.mark.slow
def test_fmucontainer_moves_the_machines_as_fmpy_does(soft: Made, two_mass: Made, tmp_path: Path) -> None:
    push, errors = pulse(0.02, 60.0), []
    for step in (4e-5, 2e-5):
        time, x = in_container(soft.file, tmp_path, step, round(0.06 / step), push)
        exact = soft_solved(push, time)
        errors.append(np.max(np.abs(x - exact)) / np.max(np.abs(exact)))
    assert errors[-1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    quick = pulse(1e-4, 1500.0)
    _, x = in_container(two_mass.file, tmp_path, 2e-8, 5000, quick)
    _, other = in_fmpy(two_mass.file, 2e-8, 5000, quick)
    assert np.max(np.abs(x - other)) < 3e-3 * np.max(np.abs(other))


LIBCOSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
asked = json.loads(sys.argv[1])
run = CosimExecution.from_ssp_file(asked["file"], step_size=asked["step"])
seen, pushed = CosimObserver.create_last_value(), CosimManipulator.create_override()
assert run.add_observer(seen) and run.add_manipulator(pushed)
table = next(info.index for info in run.slave_infos() if info.name.decode() == "table")
number = {variable.name.decode(): variable.reference for variable in run.slave_variables(table)}
assert pushed.slave_real_values(table, [number["force_x"]], [asked["force"]])
rows = []
for time in asked["times"]:
    assert run.simulate_until(time)
    rows += seen.last_real_values(table, [number["displacement_x"]])
open(asked["answer"], "w").write(json.dumps(rows))
"""


@pytest.mark.thorough
def test_libcosim_moves_the_soft_machine_as_one_solver_does(soft: Made, tmp_path: Path) -> None:
    package("libcosimpy")
    with zipfile.ZipFile(soft.file) as archive:
        archive.extractall(tmp_path)
    errors, nanoseconds = [], [int(1e6) * (i + 1) for i in range(60)]
    exact = soft_solved(lambda _: 10.0, np.array(nanoseconds) / 1e9)
    for step in (20_000, 10_000):
        asked = {"file": str(tmp_path / INNER_SSD), "step": step, "force": 10.0, "times": nanoseconds}
        request = json.dumps({**asked, "answer": str(tmp_path / "answer.json")})
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
        done = subprocess.run(
            [sys.executable, "-c", LIBCOSIM, request], capture_output=True, text=True, env=environment
        )
        assert done.returncode == 0, done.stderr
        x = np.array(json.loads((tmp_path / "answer.json").read_text()))
        errors.append(np.max(np.abs(x - exact)) / np.max(np.abs(exact)))
    assert errors[-1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


@pytest.fixture(scope="module")
def linear(tmp_path_factory: pytest.TempPathFactory) -> Made:
    file = tmp_path_factory.mktemp("linear") / "linear.ssp"
    joint = Joint((Linear(stiffness=SOFT_K), Viscous(damping=SOFT_C)), "mount", validity=RANGE)
    return Made(file, export_ssp(soft_machine(joint), file))


def late_over_early(x: Array) -> float:
    third = len(x) // 3
    return float(np.max(np.abs(x[2 * third :])) / np.max(np.abs(x[third : 2 * third])))


@pytest.mark.thorough
@pytest.mark.parametrize(("share", "grows"), [(0.9, False), (1.1, True)])
def test_the_published_step_is_where_fmpy_becomes_unstable(linear: Made, share: float, grows: bool) -> None:
    assert linear.done.max_step is not None
    step = share * linear.done.max_step
    _, x = in_fmpy(linear.file, step, 600, pulse(10 * step, 1.0))
    assert (late_over_early(x) > 1.5) == grows
    assert (late_over_early(x) < 0.7) == (not grows)


@pytest.mark.thorough
@pytest.mark.parametrize(("share", "grows"), [(0.9, False), (1.1, True)])
@pytest.mark.parametrize("master", ["jacobi", "gauss_seidel"])
def test_the_published_steps_are_where_fmucontainer_becomes_unstable(
    linear: Made, master: str, share: float, grows: bool, tmp_path: Path
) -> None:
    limit = linear.done.masters[master]
    assert limit is not None
    step = share * limit
    _, x = in_container(linear.file, tmp_path, step, 600, pulse(10 * step, 1.0), sequential=master == "gauss_seidel")
    assert (late_over_early(x) > 1.5) == grows
    assert (late_over_early(x) < 0.7) == (not grows)


@pytest.mark.slow
def test_a_machine_gives_the_same_bytes_again(soft: Made, tmp_path: Path) -> None:
    export_ssp(replace(soft_machine(), author="A < B"), tmp_path / "again.ssp")
    assert (tmp_path / "again.ssp").read_bytes() == soft.file.read_bytes()
    assert zipfile.ZipFile(soft.file).namelist() == sorted(zipfile.ZipFile(soft.file).namelist())


@pytest.mark.thorough
def test_nothing_is_written_where_the_system_fails_its_check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise CheckFailed("it does not run")

    file = tmp_path / "soft.ssp"
    file.write_bytes(b"before")
    monkeypatch.setattr(fmu.ssp, "verify_ssp", fails)
    with pytest.raises(CheckFailed, match="it does not run"):
        export_ssp(soft_machine(), file)
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("soft.ssp", b"before")]


@pytest.mark.thorough
def test_forces_on_the_wrong_sides_are_noticed_by_running_the_system(soft: Made) -> None:
    members = read_archive(soft.file)
    text = members[SSD].decode()
    for old, new in (("force_1", "force_0"), ("force_2", "force_1"), ("force_0", "force_2")):
        text = text.replace(f'startConnector="{old}"', f'startConnector="{new}"')
    crossed = members | {SSD: text.encode()}
    check_structure(soft.file, crossed)
    parts = parts_of_machine(soft_machine())
    loop = fmu.ssp.stiffest_loop(parts)[0]
    verify_ssp(soft.file, archive_bytes(members), parts, loop, soft.done.max_step)
    with pytest.raises(CheckFailed, match=r"differs from the machine's equations|does not run in FMPy"):
        verify_ssp(soft.file, archive_bytes(crossed), parts, loop, soft.done.max_step)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name="force_1" kind="output"', 'name="force_1" kind="input"', "mount.force_1 is input in N, the FMU has"),
        ('name="force_1" kind', 'name="force_3" kind', "mount.force_3 is output in N, the FMU has no such variable"),
        ('unit="m/s"', 'unit="mm/s"', r"velocity_\w+ is output in mm/s, the FMU has output in m/s"),
        ('source="resources/base.fmu"', 'source="resources/b.fmu"', "resources/b.fmu is not in the archive"),
        ('endConnector="velocity_1"', 'endConnector="velocity_2"', r"mount.velocity_\d has [02] sources, expected one"),
        ('endConnector="velocity_1"', 'endConnector="displacement_1"', "velocity_mount -> mount.displacement_1 joins"),
        ('startConnector="force_1"', 'startConnector="force"', "mount.force -> base.force_mount has an end"),
        ('startElement="mount" startConnector="force_1"', 'startElement="table" startConnector="force_x"', "joins"),
    ],
)  # fmt: skip
def test_a_document_that_does_not_fit_its_fmus_is_refused(soft: Made, old: str, new: str, said: str) -> None:
    members = read_archive(soft.file)
    changed = members[SSD].decode().replace(old, new)
    assert changed != members[SSD].decode()
    with pytest.raises(CheckFailed, match=said):
        check_structure(soft.file, members | {SSD: changed.encode()})


@pytest.mark.thorough
def test_an_input_of_an_fmu_without_a_connector_is_refused(soft: Made) -> None:
    members = read_archive(soft.file)
    text = members[SSD].decode()
    start = text.index('<ssd:Connector name="displacement_1"')
    end = text.index("</ssd:Connector>", start) + len("</ssd:Connector>")
    with pytest.raises(CheckFailed, match="input displacement_1 of the FMU mount has no connector"):
        check_structure(soft.file, members | {SSD: (text[:start] + text[end:]).encode()})


def one_mass(name: str, m: float) -> Lumped:
    return Lumped(name, ("x",), np.array([[m]]))


@pytest.mark.slow
def test_components_that_are_tied_rigidly_are_one_fmu(tmp_path: Path) -> None:
    tied = Connection("bolts", ("head.x", "ram.x"), rigid=True)
    spring = Connection("way 1", ("ground", "ram.x"), soft_joint())
    machine = Machine((one_mass("head", 1.0), one_mass("ram", 3.0)), (tied, spring), "tied", {"x": "head.x"})
    parts = parts_of_machine(machine)
    (body,) = parts.bodies
    assert body.name == "head_ram"
    (link,) = parts.links
    assert (link.name, link.ends) == ("way_1", (("head_ram", "way_1"),))
    second = body.component.second_order()
    assert second is not None
    push, pull = body.ports["x"], body.ports["way_1"]
    inertia = push @ np.linalg.solve(second.mass, pull)
    assert inertia == pytest.approx(-1 / 4.0), "a push on the head moves 4 kg, away from the ground's side"
    export_ssp(machine, tmp_path / "tied.ssp")
    k, step = SOFT_K, 2e-5
    time, x = in_fmpy(tmp_path / "tied.ssp", step, 2000, lambda t: 10.0)
    omega, zeta = math.sqrt(k / 4.0), SOFT_C / (2 * math.sqrt(k * 4.0))
    damped = omega * math.sqrt(1 - zeta**2)
    decay = np.exp(-zeta * omega * time)
    step_response = 10.0 / k * (1 - decay * (np.cos(damped * time) + zeta * omega / damped * np.sin(damped * time)))
    assert np.max(np.abs(x - step_response)) < 0.01 * np.max(step_response)


def test_a_joint_between_two_places_of_one_body_has_one_side() -> None:
    frame = Lumped("frame", ("a", "b"), np.eye(2), np.eye(2), 1e5 * np.eye(2))
    machine = Machine((frame,), (Connection("tie", ("frame.b", "frame.a"), soft_joint()),), "ring", {"y": "frame.a"})
    parts = parts_of_machine(machine)
    assert parts.links[0].ends == (("frame", "tie"),)
    np.testing.assert_array_equal(parts.bodies[0].ports["tie"], [-1.0, 1.0])
    np.testing.assert_array_equal(parts.bodies[0].ports["y"], [1.0, 0.0])


@pytest.mark.slow
def test_the_corners_of_a_guide_are_four_joints_on_two_bodies(tmp_path: Path) -> None:
    made = export_ssp(read_machine(GUIDE_BODY), tmp_path / "body.ssp")
    system = read_ssd(str(tmp_path / "body.ssp")).system
    corners = ["front_left", "front_right", "rear_left", "rear_right"]
    assert [element.name for element in system.elements] == ["rail", "runner_block", *corners]
    assert [c.name for c in system.connectors] == ["force_drive", "displacement_drive", "velocity_drive"]
    assert made.max_step == pytest.approx(2 * 125.75 / (3 * 150e6), rel=0.01)


@pytest.mark.slow
def test_without_damping_there_is_no_step_and_it_is_said(tmp_path: Path) -> None:
    bare = Lumped("base", ("x",), np.array([[4.0]]), None, np.array([[5e5]]))
    spring = Connection("mount", ("table.x", "base.x"), Joint((Linear(stiffness=1e5),), "mount"))
    machine = Machine((one_mass("table", 2.0), bare), (spring,), "bare", {"x": "table.x"})
    made = export_ssp(machine, tmp_path / "bare.ssp")
    assert (made.max_step, made.recommended_step) == (None, None)
    assert made.masters == {"jacobi": None, "gauss_seidel": None}
    assert any("no communication step is stable" in message for message in made.messages)
    assert b"MaxStep" not in read_archive(made.file)[SSD]


def test_a_component_that_nothing_touches_is_left_out_and_named() -> None:
    machine = soft_machine()
    parts = parts_of_machine(replace(machine, components=(*machine.components, one_mass("spare", 1.0))))
    assert [body.name for body in parts.bodies] == ["base", "table"]
    loop, tangents = fmu.ssp.stiffest_loop(parts)
    steps = {master: largest_step(loop, master) for master in Master}
    assert "spare is touched by nothing and left out." in step_notes(parts, loop, steps, tangents)


class Measured(Lumped):
    """Known by its receptance only."""

    def second_order(self) -> None:  # type: ignore[override]
        return None


def refused(machine: Machine, file: Path, said: str) -> None:
    with pytest.raises(InputError, match=said):
        export_ssp(machine, file)
    assert not file.exists()


def test_all_that_keeps_a_machine_from_being_a_system_of_fmus_is_refused_at_once(tmp_path: Path) -> None:
    apart = {"x": "table.x - base.x"}
    machine = replace(soft_machine(), tool=apart, static=StaticLoad(force={"table.x": 10.0}))
    with pytest.raises(InputError) as told:
        export_ssp(machine, tmp_path / "x.ssp")
    load, tool = told.value.sentences
    assert "or leave [static] out" in load
    assert "the x of tool or drive moves table and base against each other" in tool
    assert "or give the motion of one" in tool
    assert not list(tmp_path.iterdir())
    assert parts_of_machine(replace(machine, static=None, tool={"x": "table.x"})).outside["x"] == ("table", "x")


def test_a_machine_that_cannot_be_a_system_of_fmus_is_refused_in_one_sentence(tmp_path: Path) -> None:
    machine = soft_machine()
    refused(machine, tmp_path / "x.fmu", r"x.fmu: .* expected one that ends in .ssp")
    (tmp_path / "d.ssp").mkdir()
    with pytest.raises(InputError, match="a folder"):
        export_ssp(machine, tmp_path / "d.ssp")
    todo = Connection("mount", ("table.x", "base.x"), identify=Identify((Path("r.toml"),)))
    refused(replace(machine, connections=(todo,)), tmp_path / "x.ssp", "'mount' has no joint yet; identify it")
    measured: Component = Measured("table", ("x",), np.eye(1))
    refused(
        replace(machine, components=(measured, machine.components[1])),
        tmp_path / "x.ssp",
        "component 'table' has no equations of motion",
    )
    rigid = Connection("mount", ("table.x", "base.x"), rigid=True)
    refused(replace(machine, connections=(rigid,)), tmp_path / "x.ssp", "no flexible connection")
    refused(replace(machine, tool={}), tmp_path / "x.ssp", "no drive is given and the machine has no tool")
    held = Connection("foot", ("table.x", "ground"), rigid=True)
    refused(
        replace(machine, connections=(*machine.connections, held)), tmp_path / "x.ssp", "the x of tool or drive is held"
    )


@pytest.mark.slow
def test_friction_that_jumps_runs_too(tmp_path: Path) -> None:
    joint = soft_joint() + Coulomb(slip_force=2.0, smoothing_velocity=1e-3)
    made = export_ssp(soft_machine(joint), tmp_path / "dry.ssp")
    assert made.file.is_file()


@pytest.mark.slow
def test_the_command_prints_the_promised_keys(tmp_path: Path) -> None:
    file = tmp_path / "two_mass.ssp"
    done = CliRunner().invoke(cli, ["ssp", str(TWO_MASS), "-o", str(file), "--json"])
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    assert data["file"] == str(file)
    assert data["max_step"] == data["masters"]["jacobi"] == pytest.approx(4.927e-7, rel=1e-3)
    assert data["recommended_step"] == data["max_step"] / 20
    assert file.is_file()
    told = CliRunner().invoke(cli, ["ssp", str(TWO_MASS), "-o", str(file)])
    assert told.stdout.startswith(f"wrote {file}\n")
    assert "Steps of 4.93e-07 s and more are unstable" in told.stdout


@pytest.mark.slow
def test_joints_that_turn_over_or_stay_at_rest_do_not_disturb_the_check(tmp_path: Path) -> None:
    """A soft joint whose force falls beyond a thirtieth of its range; across it one that nothing moves."""
    turning = Joint((Linear(stiffness=SOFT_K), Cubic(stiffness3=-3e13), Viscous(damping=SOFT_C)), validity=RANGE)
    head = Lumped("head", ("x", "y"), np.eye(2))
    ways = (Connection("x way", ("head.x", "ground"), turning), Connection("y way", ("head.y", "ground"), soft_joint()))
    made = export_ssp(Machine((head,), ways, "head", {"x": "head.x"}), tmp_path / "head.ssp")
    assert made.file.is_file()
