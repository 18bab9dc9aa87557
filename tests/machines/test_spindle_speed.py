"""Spindles that depend on their speed: gyroscopic pairs, files by speed, joints by speed, and their lobes."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from tool_files import JOINT, SECTION, SIZES, SPINDLE, TOOL

from jointlib import Joint
from jointlib.cli.main import cli
from jointlib.errors import InputError
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from jointlib.modulation import Modulation
from jointlib.parameter import Role
from machines import Machine, linear_check, lobes, natural_modes, read_machine
from machines.components.beam import Beam
from machines.components.connection import Connection
from machines.components.measured import Measured
from machines.components.modal import Modal
from machines.cutting.amplitude.best_pitch import best_pitch
from machines.cutting.amplitude.charts_by_amplitude import within_budget
from machines.cutting.amplitude.frozen_lobes import lobes_at_amplitude
from machines.cutting.amplitude.frozen_modes import multipliers
from machines.cutting.process.cutting import Cutting
from machines.cutting.rest.solve import stability_lobes
from machines.explore.scene import Explorer
from machines.model.by_speed import BySpeed, stiffness_between
from machines.model.spindle_speed import at_speed, beyond_speeds, refuse_dependence
from machines.shapes.profile import Material
from machines.shapes.segment import Segment
from machines.study.conditions import Case
from machines.study.evaluation import Evaluation
from machines.tool.tool_model import ToolModel

STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
LENGTH, DIAMETER = 0.6, 0.04
RPM = 60000.0
VISCOUS = 1.4e-5
"""s; the first mode has 1 % of damping."""
CUT = {
    "process": "milling",
    "teeth": 2,
    "tangential": 6e8,
    "normal": 2e8,
    "mode": "down",
    "immersion": 0.3,
    "speed": (8000.0, 20000.0),
}


def simply_supported(turns: float, viscous: float = 0.0, cutting: dict[str, object] | None = None) -> Machine:
    steel = Material("steel", 2.1e11, 0.3, 7850.0, viscous=viscous)
    stations = {"a": 0.0, "middle": LENGTH / 2, "b": LENGTH}
    shaft = Beam("shaft", (Segment(LENGTH, steel, DIAMETER),), stations, axis=np.eye(3)[2], up_to=5e3, turns=turns)
    held = [f"{end}.{word}" for end in "ab" for word in "xy"] + ["a.z", "a.rz"]
    pins = tuple(Connection(dof, (f"shaft.{dof}", "ground"), rigid=True) for dof in held)
    tool = {"x": "shaft.middle.x", "y": "shaft.middle.y"}
    return Machine((shaft,), pins, tool=tool, cutting=cutting)


def whirl(order: int, spin: float) -> list[float]:
    """Hz of the whirls of a simply supported, rotating Timoshenko beam of n half waves, negative ones turn backward.

    With w + jv = W sin(kx) e^(jωt) and a slope P cos(kx) e^(jωt) of the round shaft, k = nπ/L:
    (κGA k² − ρA ω²) W = κGA k P and (EI k² + κGA − ρI ω² + 2ρI Ω ω) P = κGA k W.
    """
    k, area, second = order * np.pi / LENGTH, np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64
    shear = 2.1e11 / 2.6 * area * 6 * 1.3 / (7 + 6 * 0.3)  # Cowper's 6(1 + ν)/(7 + 6ν)
    deflection = np.polynomial.Polynomial([shear * k**2, 0.0, -7850.0 * area])
    slope = np.polynomial.Polynomial([2.1e11 * second * k**2 + shear, 2 * 7850.0 * second * spin, -7850.0 * second])
    roots = (deflection * slope - (shear * k) ** 2).roots()
    return sorted((roots.real / (2 * np.pi)).tolist(), key=abs)[:2]


@pytest.mark.parametrize("order", [1, 2])
def test_a_rotating_shaft_whirls_as_in_closed_form(order: int) -> None:
    low, high = sorted(abs(f) for f in whirl(order, 2 * np.pi * RPM / 60))
    assert high / low > 1.02, "the case shows no whirl"
    for turns in (1.0, -1.0):
        found = natural_modes(at_speed(simply_supported(turns), RPM)).frequency[2 * order - 2 : 2 * order]
        np.testing.assert_allclose(found, [low, high], rtol=1e-5)
    standing = natural_modes(simply_supported(1.0)).frequency[2 * order - 2 : 2 * order]
    np.testing.assert_allclose(standing, abs(whirl(order, 0.0)[0]), rtol=1e-8)


@pytest.mark.parametrize("turns", [1.0, -1.0])
def test_the_faster_whirl_goes_with_the_shaft(turns: float) -> None:
    modes = natural_modes(at_speed(simply_supported(turns), RPM))
    x, y = modes.tool[:, :2]
    # Turning from x to y about +z, y lags x by a quarter: y = −j x.
    np.testing.assert_allclose(y / x, [1j * turns, -1j * turns], atol=1e-6)


def test_a_force_on_x_moves_a_rotating_shaft_along_y() -> None:
    turning, standing = at_speed(simply_supported(1.0, VISCOUS), RPM), simply_supported(1.0, VISCOUS)
    model = turning.components[0].second_order()
    assert model is not None
    skew = (model.damping - model.damping.T) / 2
    assert np.linalg.norm(skew) > 1.0
    omega = 2 * np.pi * np.array([100.0, 223.0, 260.0])
    both = np.concatenate([turning.dof_rows([dof], "") for dof in turning.tool_dofs])
    G = turning.components[0].between(omega, both, both)
    np.testing.assert_allclose(G[:, 0, 1], -G[:, 1, 0], rtol=1e-6)
    H = standing.components[0].between(omega, both, both)
    assert np.all(np.abs(H[:, 0, 1]) < 1e-9 * np.abs(H[:, 0, 0]))


def whirling_tool(rpm: float) -> ToolModel:
    """The middle of the rotating shaft by its first whirls, of 1, 3 and 5 half waves, in closed form.

    With r = x + jy a pair of whirls ω_f forward and ω_b backward follows r̈ + (c − jg) ṙ + k r = f/m, k = ω_f ω_b and
    g = ω_f − ω_b; m = (ρA + ρI (P/W)²) L/2, and c = τ ω² of the standing shaft.
    """
    area, second, spin = np.pi * DIAMETER**2 / 4, np.pi * DIAMETER**4 / 64, 2 * np.pi * rpm / 60
    shear = 2.1e11 / 2.6 * area * 6 * 1.3 / (7 + 6 * 0.3)
    A, B, C = np.zeros((12, 12)), np.zeros((12, 2)), np.zeros((2, 12))
    for row, order in enumerate((1, 3, 5)):
        slow, fast = sorted(2 * np.pi * abs(f) for f in whirl(order, spin))
        still = 2 * np.pi * abs(whirl(order, 0.0)[0])
        slope = order * np.pi / LENGTH - 7850.0 * area * still**2 / (shear * order * np.pi / LENGTH)
        mass = 7850.0 * (area + second * slope**2) * LENGTH / 2
        at, c, g = slice(4 * row, 4 * row + 4), VISCOUS * still**2, fast - slow
        A[at, at] = np.block([
            [np.zeros((2, 2)), np.eye(2)],
            [-slow * fast * np.eye(2), np.array([[-c, -g], [g, -c]])],
        ])  # fmt: skip
        B[4 * row + 2 : 4 * row + 4], C[:, 4 * row : 4 * row + 2] = np.eye(2) / mass, np.eye(2)
    return ToolModel.from_states(A, B, C, np.zeros((2, 2)), ("x", "y"))


@pytest.mark.parametrize("method", ["multi-frequency", "collocation"])
def test_lobes_of_a_rotating_shaft_are_those_of_its_whirls(method: str) -> None:
    machine, speeds = simply_supported(1.0, VISCOUS, CUT), np.array([9000.0, 18000.0])
    chart = lobes_at_amplitude(machine, speeds, method=method)
    fixed = [stability_lobes(whirling_tool(n), Cutting(**CUT), [n], "collocation").depth[0] for n in speeds]
    np.testing.assert_allclose(chart.depth, fixed, rtol=2e-3)
    standing = [stability_lobes(whirling_tool(0.0), Cutting(**CUT), [n], "collocation").depth[0] for n in speeds]
    assert np.max(np.abs(np.array(standing) / fixed - 1)) > 0.02, "the case shows no effect of the speed"


def modal(rise: float) -> Modal:
    return Modal("cutter", ("x", "y"), np.array([900.0, 1400.0]) * (1 + rise), np.array([0.02, 0.03]), np.eye(2) * 5.0)


def by_speed(*known: float) -> BySpeed:
    return BySpeed("cutter", known, tuple(modal(-0.1 * rpm / 20e3) for rpm in known))


def spindle(part: object) -> Machine:
    return Machine((part,), tool={"x": "cutter.x", "y": "cutter.y"}, cutting=CUT)  # type: ignore[arg-type]


@pytest.mark.parametrize("method", ["zero-order", "multi-frequency", "collocation"])
def test_lobes_of_files_by_speed_are_those_of_the_machine_at_each_speed(method: str) -> None:
    speeds = np.array([14000.0, 9000.0, 17500.0])
    chart = lobes_at_amplitude(spindle(by_speed(0.0, 20e3)), speeds, method=method)
    alone = [lobes_at_amplitude(spindle(modal(-0.1 * n / 20e3)), [n], method=method).depth[0] for n in speeds]
    np.testing.assert_allclose(chart.depth, alone, rtol=1e-9)
    np.testing.assert_array_equal(chart.speed, speeds)
    assert chart.minimum_depth == pytest.approx(min(alone), rel=1e-9)
    assert np.ptp(lobes_at_amplitude(spindle(modal(0.0)), speeds, method=method).depth / alone) > 0.02


def test_growth_belongs_to_the_speed_as_well() -> None:
    machine = spindle(by_speed(0.0, 20e3))
    chart = lobes_at_amplitude(machine, [9000.0, 17500.0], method="collocation")
    at_limit = [multipliers(machine, [n], [b])[0, 0] for n, b in zip(chart.speed, chart.depth, strict=True)]
    np.testing.assert_allclose(at_limit, 1.0, atol=2e-3)
    assert multipliers(machine, chart.speed, chart.depth).shape == (2, 2)


def test_the_stiffness_between_two_is_that_of_a_spring_in_proportion() -> None:
    rng = np.random.default_rng(4)
    M, K = np.eye(2), np.array([[3e7, -1e7], [-1e7, 2e7]])
    change = rng.normal(size=(2, 2)) * 1e6
    change = change + change.T
    omega = np.linspace(500.0, 9000.0, 40)[:, None, None]

    def receptance(share: float) -> np.ndarray:
        return np.linalg.inv(K + share * change - omega**2 * M + 2e2j * omega * np.eye(2))

    np.testing.assert_allclose(
        stiffness_between(receptance(0.0), receptance(1.0), 0.3), receptance(0.3), rtol=1e-9, atol=1e-18
    )


def test_files_beyond_their_speeds_are_said() -> None:
    machine = spindle(by_speed(5000.0, 10e3, 20e3))
    chart = lobes_at_amplitude(machine, [8000.0, 25000.0], method="zero-order")
    end = lobes_at_amplitude(spindle(modal(-0.1)), [25000.0], method="zero-order")
    assert chart.depth[1] == pytest.approx(end.depth[0], rel=1e-9)
    assert any("known from 5000 to 20000 rpm" in said for said in chart.warnings)
    assert not beyond_speeds(machine, [5000.0, 20e3])
    remarks = " ".join(machine.remarks())
    assert "3 speeds" in remarks
    assert "beyond its files" in remarks


def test_a_spring_by_speed_is_the_spring_of_that_speed() -> None:
    table = ((0.0, 1.0), (10e3, 0.8), (20e3, 0.4))
    joint = Joint(
        (Linear(3e7), Viscous(100.0)), "bearing", modulations=(Modulation(Role.STIFFNESS, "spindle-speed", 0.0, table),)
    )
    held = Modal("cutter", ("x",), np.array([0.0]), np.array([0.0]), np.array([[1.0]]), np.array([2.0]))
    machine = Machine((held,), (Connection("bearing", ("cutter.x", "ground"), joint),), tool={"x": "cutter.x"})
    for rpm, factor in ((0.0, 1.0), (15e3, 0.6), (20e3, 0.4), (30e3, 0.4)):
        turning = at_speed(at_speed(machine, 10e3), rpm)  # from wherever it stood
        expected = np.sqrt(factor * 3e7 / 2.0) / (2 * np.pi)
        assert natural_modes(turning).frequency[0] == pytest.approx(expected, rel=1e-9)
        assert turning.joints()[0].parameters["viscous.damping"] == 100.0
    assert beyond_speeds(machine, [30e3])
    assert not beyond_speeds(machine, [20e3])
    with pytest.raises(InputError, match="connection 'bearing' depends on the spindle speed"):
        refuse_dependence(machine, "this")


FILE = """schema = "jointlib/machine/1"
[[component]]
name = "cutter"
speed = ["0 rpm", "20000 rpm"]
file = ["slow.component.toml", "fast.component.toml"]
[tool]
x = "cutter.x"
[response]
speed = {speed}
frequency = ["100 Hz", "2 kHz"]
"""
PART = """schema = "jointlib/component/1"
kind = "modal"
dofs = ["{dof}"]
frequency = [{frequency}]
damping_ratio = [0.02]
shapes = [[1.0]]
"""


def written(folder: Path, speed: str = "5000", dof: str = "x") -> Path:
    for name, frequency, own in (("slow", 1000.0, "x"), ("fast", 800.0, dof)):
        (folder / f"{name}.component.toml").write_text(PART.format(frequency=frequency, dof=own))
    (folder / "machine.toml").write_text(FILE.format(speed=speed))
    return folder / "machine.toml"


def test_a_machine_file_names_a_file_a_speed(tmp_path: Path) -> None:
    path = written(tmp_path)
    assert natural_modes(read_machine(path)).frequency[0] == pytest.approx(950.0)
    moved = read_machine(path, {"response.speed": "20000 rpm"})
    assert natural_modes(moved).frequency[0] == pytest.approx(800.0)


def test_what_is_wrong_with_files_by_speed_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the file at 20000 rpm has dofs y, expected those of the first one, x"):
        read_machine(written(tmp_path, dof="y"))
    path = written(tmp_path)
    path.write_text(path.read_text().replace('["0 rpm", "20000 rpm"]', '["20000 rpm", "0 rpm"]'))
    with pytest.raises(InputError, match=r"speed is .* expected at least 0 and ascending"):
        read_machine(path)
    with pytest.raises(InputError, match="speed is -3 rpm, expected at least 0"):
        read_machine(written(tmp_path, speed="-3"))


def test_a_beam_that_turns_is_round() -> None:
    with pytest.raises(InputError, match="turns is 1, expected round sections"):
        Beam("bar", (Segment(0.1, STEEL, width=0.02, height=0.01),), {"a": 0.0}, up=np.eye(3)[2], turns=1.0)


def test_python_control_has_the_same_rotating_shaft() -> None:
    turning = at_speed(simply_supported(1.0, VISCOUS), RPM)
    assert linear_check(turning, frequency=np.geomspace(50.0, 2000.0, 60)).passed


@pytest.mark.thorough
def test_cutter_and_holder_of_a_tool_file_turn_together(tmp_path: Path) -> None:
    text = f"{TOOL}{SIZES}turns = -1\n[[section]]\n{SECTION}{JOINT}"
    (tmp_path / "a.tool.toml").write_text(text)
    (tmp_path / "m.toml").write_text(SPINDLE.format(top='tool = "a.tool.toml"', parts="", tool="", teeth=4))
    machine = read_machine(tmp_path / "m.toml")
    turning = {c.name for c in machine.components if c.known_speeds is not None}
    assert turning == {"cutter", "holder"}
    slow, fast = (natural_modes(at_speed(machine, rpm)).frequency[:2] for rpm in (0.0, 40e3))
    assert slow[1] / slow[0] == pytest.approx(1.0, abs=1e-6)
    assert fast[1] / fast[0] > 1.0005
    standing = lobes_at_amplitude(machine, [9000.0], method="zero-order").depth[0]
    assert lobes_at_amplitude(at_speed(machine, 9000.0), [9000.0], method="zero-order").depth[0] == standing


def measured_at(factor: float) -> Measured:
    """A mass of 2 kg on a spring in two directions, that softens by a factor."""
    lines = np.linspace(100.0, 3000.0, 1200)
    w = 2 * np.pi * lines
    H = np.zeros((len(lines), 2, 2), dtype=complex)
    for i, (k, c) in enumerate(((6e7, 500.0), (9e7, 700.0))):
        H[:, i, i] = 1 / (factor * k - 2 * w**2 + 1j * w * c)
    return Measured("cutter", ("x", "y"), lines, H, interpolation="rational")


@pytest.mark.thorough
@pytest.mark.parametrize("method", ["zero-order", "multi-frequency"])
def test_measured_parts_at_two_speeds_are_between_what_a_softening_spring_is(method: str) -> None:
    part = BySpeed("cutter", (0.0, 10e3, 20e3), tuple(measured_at(factor) for factor in (1.0, 0.8, 0.6)))
    machine = spindle(part)
    speeds = np.array([10e3, 15e3])
    chart = lobes_at_amplitude(machine, speeds, method=method)
    exact = [lobes_at_amplitude(spindle(measured_at(1 - 0.4 * n / 20e3)), [n], method=method).depth[0] for n in speeds]
    np.testing.assert_allclose(chart.depth, exact, rtol=1e-6)
    assert part.left_out is not None
    assert part.left_out[0] < 1e-9, "the middle file is told by its neighbours"
    with pytest.raises(InputError, match="depends on the spindle speed, expected a machine that does not for pitches"):
        best_pitch(machine, 9000.0, 12000.0)


CUTTING = """
[cutting]
process = "milling"
teeth = 2
tangential = 6e8
normal = 2e8
mode = "down"
immersion = 0.3
speed = [8000, 20000]
"""
STUDY = """schema = "jointlib/study/1"
base = "machine.toml"
[[factor]]
path = "cutting.immersion"
values = [0.2, 0.3]
[[objective]]
quantity = "minimum-depth"
goal = "max"
[conditions]
speed = [8000, 20000]
speeds = 5
lobes = "zero-order"
"""


STUDIED = np.linspace(8e3, 20e3, 5)


@pytest.mark.thorough
def test_the_explorer_shows_lobes_of_every_speed(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text() + CUTTING)
    curves = Explorer(path).curves({})
    alone = [lobes_at_amplitude(read_machine(path), [n], method="zero-order").depth[0] for n in curves.speed[::13]]
    np.testing.assert_allclose(curves.depth[::13], alone, rtol=1e-12)
    assert "The spindle depends on its speed: 40 speeds, by zero-order." in curves.notes


@pytest.mark.slow
def test_a_study_takes_every_speed_with_the_machine_at_that_speed(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text() + CUTTING)
    (tmp_path / "depth.study.toml").write_text(STUDY)
    found = Evaluation(tmp_path / "depth.study.toml")(0, 2)["minimum-depth"]
    for immersion, depth in zip((0.2, 0.3), found, strict=True):
        machine = read_machine(path, {"cutting.immersion": immersion})
        alone = [lobes_at_amplitude(machine, [n], method="zero-order").depth[0] for n in STUDIED]
        assert depth == pytest.approx(min(alone), rel=1e-12)
    words = ["study", "run", str(tmp_path / "depth.study.toml"), "-o", str(tmp_path / "out")]
    assert CliRunner().invoke(cli, words, catch_exceptions=False).exit_code == 0
    assert found[0] != pytest.approx(found[1], rel=1e-3)
    (tmp_path / "depth.study.toml").write_text(STUDY.replace("[8000, 20000]", "[8000, 24000]"))
    with pytest.raises(InputError, match="component 'cutter' is known from 0 to 20000 rpm"):
        Evaluation(tmp_path / "depth.study.toml").each([(np.array([0.2]), Case(""))])


GUIDE = """[[connection]]
name = "guide"
between = ["cutter.x", "ground"]
joint = { law = [{ kind = "linear", stiffness = 1e6 }, { kind = "cubic", stiffness3 = 1e17 }] }
[cutting]
process = "turning"
specific = 2e9
speed = [3000, 18000]
"""


def guided(folder: Path) -> Machine:
    """A nonlinear machine that is another at every speed."""
    path = written(folder)
    path.write_text(path.read_text() + GUIDE)
    return read_machine(path)


def test_charts_at_amplitudes_end_within_their_budget_with_what_is_known(tmp_path: Path) -> None:
    machine, begun = guided(tmp_path), time.process_time()
    found = lobes(machine, amplitude=[0.0, 5e-6], budget=0.6)
    # A speed begun in time may end after it; what a slow machine adds is not counted.
    assert time.process_time() - begun < 2.0
    assert len(found.charts[1].speed) < 100
    (said,) = (w for w in found.charts[1].warnings if w.startswith("Time was up after 0.6 s"))
    assert f"{len(found.charts[1].speed)} of " in said
    assert said in found.lines
    assert found.charts[0].speed.tolist() == found.charts[1].speed.tolist()
    middle = len(found.charts[1].speed) // 2
    for A, chart in zip((0.0, 5e-6), found.charts, strict=True):
        alone = lobes_at_amplitude(machine, [chart.speed[middle]], A)
        assert chart.depth[middle] == pytest.approx(alone.depth[0], rel=1e-12)


@pytest.mark.thorough
def test_with_time_enough_every_speed_is_there_at_every_amplitude(tmp_path: Path) -> None:
    machine, speeds = guided(tmp_path), np.array([5000.0, 9000.0, 14000.0])
    charts = within_budget(machine, speeds, (2e-6, 5e-6), None, 60.0, 60.0)
    for A, chart in zip((2e-6, 5e-6), charts, strict=True):
        np.testing.assert_array_equal(chart.depth, lobes_at_amplitude(machine, speeds, A).depth)
        assert not any("Time was up" in said for said in chart.warnings)
