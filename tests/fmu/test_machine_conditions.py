"""FMUs of machines whose joints follow conditions: one input for all joints, and a connector in a system of FMUs."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from machine_host import Exchange, Stepping, library_machine, unpacked
from repeats import repeats
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from tools import require

from fmu.members.machine_system import system_of_machine
from fmu.ssp import export_ssp
from fmu.systems.ssd import NAMESPACES, SSD
from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.modulation import Modulation
from jointlib.parameter import Role
from machines import Connection, Machine, Modal, read_machine
from machines.model.by_speed import BySpeed
from machines.model.spindle_speed import at_speed

SOFTER = ((283.0, 1.2), (293.0, 1.0), (313.0, 0.64))
WARMTH = Modulation(Role.STIFFNESS, "temperature", 293.0, SOFTER)
VOLTAGE = Modulation(Role.SLIP_FORCE, "voltage", 1.0, ((0.0, 0.4), (1.0, 1.0), (3.0, 1.7)))
SLIDE = """
schema = "jointlib/machine/1"
name = "slide"
[[component]]
name = "slide"
kind = "lumped"
dofs = ["x"]
mass = [[2.0]]
[[connection]]
name = "guide"
between = ["ground", "slide.x"]
[connection.joint]
law = [{ kind = "linear", stiffness = 1e7 }, { kind = "viscous", damping = 50.0 }]
[[connection.joint.modulation]]
role = "stiffness"
condition = "temperature"
reference = 293
table = [[283, 1.2], [293, 1.0], [313, 0.64]]
lag = LAG
[tool]
x = "slide.x"
"""
MASS, STIFFNESS, DAMPING = 2.0, 1e7, 50.0
H = 1e-5
OUT = ["displacement_x", "velocity_x", "guide.force"]


def slide(folder: Path, lag: float = 0.0, conditions: str = "") -> Machine:
    """A mass on a spring whose stiffness follows the temperature."""
    file = folder / "slide.toml"
    file.write_text(SLIDE.replace("LAG", repr(lag)) + conditions)
    return read_machine(file)


def course(n: int) -> tuple[Array, Array]:
    """Force (N) and temperature (K) step by step; the temperature jumps, and leaves its table."""
    rng = np.random.default_rng(3)
    return 100.0 * rng.normal(size=n), np.repeat(rng.uniform(275.0, 320.0, n // 20 + 1), 20)[:n]


def softness(temperature: Array) -> Array:
    """The factor of the stiffness."""
    return np.asarray(np.interp(temperature, *np.array(SOFTER).T))


def three(*modulations: Modulation, law: JointLaw | None = None) -> Machine:
    """The machine with three joints, which all follow the same conditions."""
    machine = library_machine("three_joints")
    for c in machine.flexible:
        assert c.joint is not None
        joint = c.joint + law if law is not None else c.joint
        machine = machine.with_joint(c.name, replace(joint, modulations=modulations))
    return machine


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_mass_on_a_spring_that_jumps_moves_as_its_closed_form(fmi: int, tmp_path: Path) -> None:
    require("cc")
    n = 200
    force, temperature = course(n)
    fmu = Stepping(unpacked(slide(tmp_path), fmi), fmi, {"temperature": temperature[0]})
    found = fmu.run({"force_x": force, "temperature": temperature}, H, OUT[:2])
    x, expected = np.zeros(2), []
    for f, k in zip(force, STIFFNESS * softness(temperature), strict=True):
        A = np.array([[0.0, 1.0, 0.0], [-k / MASS, -DAMPING / MASS, f / MASS], [0.0, 0.0, 0.0]])
        x = (expm(H * A) @ np.append(x, 1.0))[:2]
        expected.append(x)
    assert np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=0)) < 1e-8


def test_a_spring_that_follows_late_moves_the_mass_as_its_equation_says(tmp_path: Path) -> None:
    """x and the temperature behind its lag, integrated by scipy; model exchange has the same equations."""
    require("cc")
    n, lag = 100, 4e-4
    force, temperature = course(n)
    model = slide(tmp_path, lag)
    start = {"temperature": temperature[0]}
    signal = {"force_x": force, "temperature": temperature}
    found = Stepping(unpacked(model, 2), 2, start).run(signal, H, OUT[:2])
    y, expected = np.array([0.0, 0.0, temperature[0]]), []
    for f, u in zip(force, temperature, strict=True):

        def slope(_time: float, y: Array, f: float = f, u: float = u) -> list[float]:
            k = STIFFNESS * float(softness(y[2]))
            return [y[1], (f - k * y[0] - DAMPING * y[1]) / MASS, (u - y[2]) / lag]

        y = solve_ivp(slope, (0.0, H), y, method="DOP853", rtol=1e-11, atol=1e-16, max_step=H / 4).y[:, -1]
        expected.append(y[:2])
    assert np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=0)) < 1e-6
    fmu = Exchange(unpacked(model, 2), 2, start)
    assert fmu.states[-1] == "guide.followed.temperature"
    x = np.array([0.0, 0.0, temperature[0]])
    fmu.at(x)
    fmu.put({"force_x": force[0], "temperature": 300.0})
    assert fmu.slope(0.0, x)[-1] == pytest.approx((300.0 - temperature[0]) / lag, rel=1e-12)


def test_an_input_begins_at_the_conditions_of_the_machine(tmp_path: Path) -> None:
    """Bit for bit the machine with its joint as it is there."""
    require("cc")
    warm = slide(tmp_path, conditions="[conditions]\ntemperature = 303\n")
    (there,) = warm.joints()
    plain = warm.with_joint("guide", there.at({"temperature": 303.0}))
    fmus = [Stepping(unpacked(machine, 2), 2) for machine in (warm, plain)]
    assert fmus[0].get(["temperature"])[0] == 303.0
    assert fmus[0].get(["guide.linear.stiffness"])[0] == pytest.approx(0.82 * STIFFNESS, rel=1e-14)
    force = {"force_x": course(100)[0]}
    assert np.array_equal(*(fmu.run(force, H, OUT) for fmu in fmus))


def test_one_input_moves_all_joints_that_depend_on_it(tmp_path: Path) -> None:
    require("cc")
    machine = three(WARMTH)
    assert [s.name for s in system_of_machine(machine).inputs].count("temperature") == 1
    there = machine
    for c in machine.flexible:
        assert c.joint is not None
        there = there.with_joint(c.name, c.joint.at({"temperature": 308.0}))
    force, still = {"force_x": course(100)[0]}, np.full(100, 308.0)
    outputs = ["displacement_x", *(f"{c.name}.force" for c in machine.flexible)]
    found = Stepping(unpacked(machine, 2), 2, {"temperature": 308.0}).run({**force, "temperature": still}, H, outputs)
    expected = Stepping(unpacked(there, 2), 2).run(force, H, outputs)
    assert np.max(np.abs(found - expected) / np.max(np.abs(expected), axis=0)) < 1e-8


@pytest.mark.parametrize("lag", [0.0, 2e-3])
@pytest.mark.parametrize("law", [Linear(1e7), Jenkins(4e7, 5.0)], ids=lambda law: str(law.kind))
@pytest.mark.parametrize("how", ["ramps", "jumps"])
def test_both_ways_of_integration_agree_while_conditions_change(how: str, law: JointLaw, lag: float) -> None:
    require("cc")
    of = (WARMTH, replace(VOLTAGE, lag=lag)) if law.kind == "jenkins" else (replace(WARMTH, lag=lag),)
    folder, n, h = _three(law, of), 300, 2e-5
    t, k = h * np.arange(n), np.arange(n)
    ramps = {"temperature": 293 + 15 * np.sin(2 * np.pi * 100 * t), "voltage": 1.4 + 1.3 * np.sin(2 * np.pi * 60 * t)}
    jumps = {"temperature": np.where(k // 53 % 2, 285.0, 305.0), "voltage": np.where(k // 37 % 2, 0.2, 2.5)}
    at = {m.condition: (ramps if how == "ramps" else jumps)[m.condition] for m in of}
    start = {name: float(x[0]) for name, x in at.items()}
    signal = {"force_x": 200 * np.sin(2 * np.pi * 180 * t), **at}
    outputs = ["displacement_x", "guide.force", "guide.displacement"]
    explicit, loose, tight = (
        Stepping(folder, 2, start, tolerance).run(signal, h, outputs) for tolerance in (None, 1e-5, 1e-7)
    )
    size = np.max(np.abs(explicit), axis=0)
    assert np.max(np.abs(loose - explicit) / size) < 2e-4
    assert np.max(np.abs(tight - explicit) / size) < 1e-4


_FOLDERS: dict[tuple[JointLaw, tuple[Modulation, ...]], Path] = {}


def _three(law: JointLaw, of: tuple[Modulation, ...]) -> Path:
    """The FMU of :func:`three`, made once."""
    if (law, of) not in _FOLDERS:
        _FOLDERS[law, of] = unpacked(three(*of, law=law), 2)
    return _FOLDERS[law, of]


@pytest.mark.parametrize("tolerance", [None, 1e-5])
def test_a_state_saved_while_conditions_change_is_gone_on_from_bit_for_bit(tolerance: float | None) -> None:
    require("cc")
    folder, n = _three(Jenkins(4e7, 5.0), (WARMTH, replace(VOLTAGE, lag=2e-3))), 60
    force, temperature = course(2 * n)
    signal = {"force_x": force, "temperature": temperature, "voltage": 1.0 + 0.01 * np.arange(2 * n)}
    fmu = Stepping(folder, 2, {}, tolerance)
    fmu.run({name: x[:n] for name, x in signal.items()}, H, OUT)
    saved, time = fmu.fmu.getFMUState(), fmu.time
    first = fmu.run({name: x[n:] for name, x in signal.items()}, H, OUT)
    fmu.fmu.setFMUState(saved)
    fmu.time = time
    assert np.array_equal(first, fmu.run({name: x[n:] for name, x in signal.items()}, H, OUT))


@pytest.mark.parametrize("fmi", [2, 3])
def test_derivatives_by_a_condition_are_those_of_force_and_rates(fmi: int, tmp_path: Path) -> None:
    """∂f/∂T = k φ'(T) z in the guide, ∂ẍ/∂T of the mass is minus that over its root (modal mass 1 kg)."""
    require("cc")
    fmu = Exchange(unpacked(slide(tmp_path), fmi), fmi, {"temperature": 300.0})
    fmu.at(np.array([1e-6 * np.sqrt(MASS), 0.0]))
    z, slope = fmu.get(["guide.displacement"])[0], (0.64 - 1.0) / 20.0
    by = STIFFNESS * slope * z
    names = ["guide.force", "der(mode[0].velocity)", "displacement_x"]
    told = fmu.fmu.getDirectionalDerivative([fmu.place[n] for n in names], [fmu.place["temperature"]], [1.0])
    sign = fmu.get(["displacement_x"])[0] / z
    assert abs(z) == pytest.approx(1e-6, rel=1e-12)
    assert told[0] == pytest.approx(by, rel=1e-7)
    assert told[1] == pytest.approx(-sign * by / np.sqrt(MASS), rel=1e-7)
    assert told[2] == 0.0


@pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 2))
def test_a_system_of_fmus_has_one_connector_that_goes_to_all_joints_that_depend_on_it(fmi: int, tmp_path: Path) -> None:
    """The export runs it beside the reference in FMPy and holds it against the machine's own equations there."""
    require("cc")
    machine, file = three(WARMTH, replace(VOLTAGE, lag=1e-5)), tmp_path / "three.ssp"
    (bearing,) = (c.joint for c in machine.flexible if c.name == "bearing")
    assert bearing is not None
    machine = machine.with_joint("bearing", replace(bearing, modulations=()))
    told = export_ssp(machine, file, fmi=fmi).messages
    assert any("temperature (else 293 K)" in said and "voltage (else 1 V)" in said for said in told)
    with zipfile.ZipFile(file) as archive:
        system = ElementTree.fromstring(archive.read(SSD)).find("ssd:System", NAMESPACES)
    assert system is not None
    connectors = {c.get("name"): c.get("kind") for c in system.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES)}
    assert (connectors["temperature"], connectors["voltage"]) == ("input", "input")
    wires = [
        (wire.get("startConnector"), wire.get("endElement"), wire.get("endConnector"))
        for wire in system.iterfind("ssd:Connections/ssd:Connection", NAMESPACES)
        if wire.get("startElement") is None
    ]
    assert {w for w in wires if w[0] in {"temperature", "voltage"}} == {
        (name, joint, name) for name in ("temperature", "voltage") for joint in ("foot", "guide")
    }


def test_where_bodies_depend_on_the_spindle_speed_it_is_that_of_the_file_and_no_input() -> None:
    """An input would move the joints alone."""
    bodies = tuple(Modal("cutter", ("x",), np.array([f]), np.array([0.02]), np.eye(1)) for f in (900.0, 800.0))
    slower = Modulation(Role.STIFFNESS, "spindle-speed", 0.0, ((0.0, 1.0), (20e3, 0.8)))
    spring = Joint((Linear(1e6),), modulations=(slower, WARMTH))
    for body, inputs in ((BySpeed("cutter", (0.0, 20e3), bodies), []), (bodies[0], ["spindle_speed"])):
        machine = Machine((body,), (Connection("guide", ("cutter.x", "ground"), spring),), tool={"x": "cutter.x"})
        system = system_of_machine(at_speed(machine, 10e3))
        assert [s.name for s in system.inputs] == ["force_x", "temperature", *inputs]
        ((_, joint),) = system.joints
        assert joint.parameters["linear.stiffness"] == pytest.approx(0.9e6, rel=1e-14)


def test_joints_at_different_references_need_conditions_of_the_machine() -> None:
    machine = three(WARMTH)
    (guide,) = (c.joint for c in machine.flexible if c.name == "guide")
    assert guide is not None
    apart = machine.with_joint("guide", guide.based("temperature", 303.0))
    with pytest.raises(InputError, match="at 293 and 303 K, expected one value"):
        system_of_machine(apart)
