"""Structures with their joints closed: exact where linear, within the host's tolerance beside explicit steps."""

from __future__ import annotations

import ctypes
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from machine_host import Stepping, library_machine, unpacked
from repeats import repeats
from scipy.linalg import expm
from tools import require

from fmu.export import export_fmu
from fmu.members.machine_system import system_of_component, system_of_machine
from fmu.playback.closed_simulation import simulate_closed
from fmu.playback.simulation import simulate
from fmu.system.closed import Kind, closed, modes, stiff_closed
from fmu.system.system import System
from fmu.verify import verify_fmu
from jointlib.arrays import Array
from jointlib.joint import Joint
from jointlib.law import JointLaw
from jointlib.laws.bouc_wen import BoucWen
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.dahl import Dahl
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.quadratic_damping import QuadraticDamping
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Rigid

both_versions = pytest.mark.parametrize("fmi", [2, 3])
one_version = pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 3))
KAPPA = 3.931408125e-8


@pytest.fixture(autouse=True)
def _compiler() -> None:
    require("cc")


def on_base(*laws: object, base: float = 1e8, frequency: tuple[float, float] | None = None) -> Machine:
    """A slide of 2 kg on a sprung base of 5 kg."""
    foot = Lumped("base", ("x",), np.array([[5.0]]), np.array([[300.0]]), np.array([[base]]))
    between = Connection("guide", ("slide.x", "base.x"), Joint(tuple(laws)))  # type: ignore[arg-type]
    slide = Lumped("slide", ("x",), np.array([[2.0]]))
    return Machine(
        (slide, foot), (between,), name="on base", tool={"x": "slide.x"}, force=(300.0,), frequency=frequency
    )


LINEAR = on_base(Linear(2e8), Viscous(400.0))
BENT = on_base(HertzGuide(630.0, KAPPA), Viscous(300.0))
RUBBING = on_base(HertzGuide(630.0, KAPPA), Viscous(300.0), Jenkins(4e7, 36.0))
BY_VELOCITY = on_base(Linear(2e8), Viscous(400.0), QuadraticDamping(3e4))
LIFTING = on_base(Linear(2e8), ContactLoss(1e8, 1e-7, 1.0), Viscous(400.0))
BRISTLE = LuGre(4e7, 300.0, 36.0, 50.0, 0.02)
BRISTLING = on_base(BRISTLE, Linear(2e8), Viscous(300.0))
PLAYING = on_base(Dahl(4e7, 36.0, 2e-7), Linear(2e8), Viscous(300.0))
RELAXING = on_base(Maxwell(5e7, 2e3), Linear(2e8), Viscous(300.0))
ROUNDED = on_base(BoucWen(4e7, 36.0, 2.0, 0.5), Linear(2e8), Viscous(300.0))
STIFF = on_base(HertzGuide(630.0, KAPPA), Viscous(300.0), base=1e14, frequency=(10.0, 3000.0))
OUTPUTS = ["displacement_x", "velocity_x", "guide.displacement", "guide.velocity", "guide.force"]


def forces(steps: int, size: float = 300.0) -> dict[str, Array]:
    return {"force_x": np.random.default_rng(6).uniform(-size, size, steps)}


def shares(found: Array, expected: Array) -> float:
    """Largest difference of an output as a share of its largest value."""
    return float(np.max(np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected), axis=0)))


@both_versions
@pytest.mark.parametrize("step", [1e-6, 3e-4])
def test_a_linear_machine_is_exact_at_any_step(step: float, fmi: int) -> None:
    k, c = 2e8, 400.0
    M, C = np.diag([2.0, 5.0]), np.array([[c, -c], [-c, c + 300.0]])
    K = np.array([[k, -k], [-k, k + 1e8]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    b = np.array([0.0, 0.0, 0.5, 0.0])
    whole = expm(np.block([[A, b[:, None]], [np.zeros((1, 5))]]) * step)
    given, x, expected = forces(40), np.zeros(4), []
    for held in given["force_x"]:
        x = whole[:4, :4] @ x + whole[:4, 4] * held
        z, v = x[0] - x[1], x[2] - x[3]
        expected.append([x[0], x[2], z, v, k * z + c * v])
    found = Stepping(unpacked(LINEAR, fmi), fmi, tolerance=1e-3).run(given, step, OUTPUTS)
    assert shares(found, np.array(expected)) < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize(
    "machine",
    [
        BENT,
        *(
            pytest.param(machine, marks=pytest.mark.thorough)
            for machine in (RUBBING, BY_VELOCITY, LIFTING, BRISTLING, PLAYING, RELAXING, ROUNDED)
        ),
    ],
    ids=["bent", "rubbing", "by velocity", "lifting", "bristling", "playing", "relaxing", "rounded"],
)
def test_the_error_falls_with_the_tolerance_of_the_host(machine: Machine) -> None:
    """Beside explicit steps that locate stick, slip and contact."""
    folder, given = unpacked(machine, 2), forces(60)
    expected = Stepping(folder, 2).run(given, 3e-5, OUTPUTS)
    errors = [
        shares(Stepping(folder, 2, tolerance=tolerance).run(given, 3e-5, OUTPUTS), expected)
        for tolerance in (1e-3, 1e-5, 1e-7)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2] > 0
    assert errors[1] < 3e-4
    assert errors[2] < 1e-5


@pytest.mark.slow
def test_explicit_steps_keep_the_tolerance_of_the_host_too() -> None:
    """Damping that is tuned, however little, is not in the modes."""
    folder, given, start = unpacked(BRISTLING, 2), forces(40), {"guide.viscous.damping": 300.0 * (1 + 1e-12)}
    expected = Stepping(folder, 2, start).run(given, 3e-5, OUTPUTS)
    errors = [
        shares(Stepping(folder, 2, start, tolerance=t).run(given, 3e-5, OUTPUTS), expected) for t in (1e-3, 1e-6, 1e-9)
    ]
    assert errors[0] > errors[1] > errors[2] == 0.0


@pytest.mark.slow
def test_a_turn_within_a_step_is_not_overlooked() -> None:
    """Bouc-Wen hysteresis of this shape unloads in straight lines: both ends of a step tell nothing of a turn."""
    folder, given = unpacked(ROUNDED, 2), forces(80)
    expected = Stepping(folder, 2).run(given, 3e-5, OUTPUTS)
    assert shares(Stepping(folder, 2, tolerance=1e-7).run(given, 3e-5, OUTPUTS), expected) < 1e-6


@pytest.mark.slow
@one_version
def test_saved_state_repeats_the_run_bit_for_bit(fmi: int) -> None:
    fmu = Stepping(unpacked(RUBBING, fmi), fmi, tolerance=1e-5)
    fmu.run(forces(30), 3e-5, OUTPUTS[:1])
    get, put = (fmu.fmu.getFMUstate, fmu.fmu.setFMUstate) if fmi == 2 else (fmu.fmu.getFMUState, fmu.fmu.setFMUState)
    saved, time = get(), fmu.time
    first = fmu.run(forces(50), 3e-5, OUTPUTS)
    put(saved)
    fmu.time = time
    # What is asked in between moves nothing.
    fmu.get([*OUTPUTS, "mode[0].displacement", "mode[1].velocity", "guide.jenkins.slider"])
    assert np.array_equal(fmu.run(forces(50), 3e-5, OUTPUTS), first)


def test_a_parameter_in_the_modes_opens_the_structure_where_it_is() -> None:
    """Damping tuned half way: from there on as by explicit steps from the same states."""
    folder, given = unpacked(BENT, 2), forces(60)
    half = {"force_x": given["force_x"][:30]}
    rest = {"force_x": given["force_x"][30:]}
    runs = []
    for tolerance in (None, 1e-7):
        fmu = Stepping(folder, 2, tolerance=tolerance)
        fmu.run(half, 3e-5, OUTPUTS)
        fmu.put({"guide.viscous.damping": 900.0})
        runs.append(fmu.run(rest, 3e-5, OUTPUTS))
    assert shares(runs[1], runs[0]) < 1e-5


def test_a_parameter_of_a_bent_law_is_tuned_within_the_modes() -> None:
    folder, given = unpacked(BENT, 2), forces(40)
    start = {"guide.hertz_guide.preload": 500.0}
    expected = Stepping(folder, 2, start).run(given, 3e-5, OUTPUTS)
    assert shares(Stepping(folder, 2, start, tolerance=1e-7).run(given, 3e-5, OUTPUTS), expected) < 1e-5
    assert shares(Stepping(folder, 2, tolerance=1e-7).run(given, 3e-5, OUTPUTS), expected) > 1e-2


def test_modes_that_are_set_before_the_start_are_moved_by_explicit_steps() -> None:
    folder = unpacked(BENT, 2)
    start = {"mode[0].displacement": 1e-6}
    expected = Stepping(folder, 2, start).run(forces(10), 3e-5, OUTPUTS)
    assert shares(Stepping(folder, 2, start, tolerance=1e-6).run(forces(10), 3e-5, OUTPUTS), expected) < 1e-5


@pytest.mark.thorough
def test_free_body_accelerates_as_newton_says_by_modes_too() -> None:
    body = Rigid("body", 4.0, np.array([1.0, 2.0, 3.0]))
    system = system_of_component(body, {"top": np.eye(6)[0]})
    of = closed(system)
    assert of is not None
    found = modes(of)
    assert found is not None
    assert set(found.kinds) == {Kind.FREE}
    fmu = Stepping(unpacked(system, 2), 2, tolerance=1e-4)
    end = fmu.run({"force_top": np.full(10, 8.0)}, 0.1, ["displacement_top", "velocity_top"])[-1]
    assert end == pytest.approx([1.0, 2.0], rel=1e-12)


@pytest.mark.parametrize("machine", [BENT, RUBBING, BY_VELOCITY])
def test_modes_put_the_closed_matrix_together_again(machine: Machine) -> None:
    of = closed(system_of_machine(machine))
    assert of is not None
    found = modes(of)
    assert found is not None
    for h in (1e-6, 1e-3):
        blocks = np.zeros_like(found.W)
        for i, (a, b) in enumerate(found.blocks):
            assert found.kinds[i] is Kind.SWING
            blocks[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = expm(np.array([[a, -b], [b, a]]) * h)
        scale = np.where(np.arange(len(of.A)) % 2, 1e4, 1.0)
        wrong = (found.W @ blocks @ found.inverse - expm(of.A * h)) * scale / scale[:, None]
        assert np.max(np.abs(wrong)) < 1e-9


def second(system: System, u: Array, step: float) -> Array:
    of = closed(system)
    assert of is not None
    return simulate_closed(of, u, step, 1e-8, 1e-8)[0]


@pytest.mark.parametrize("machine", [BENT, BY_VELOCITY], ids=["bent", "by velocity"])
def test_both_simulations_in_python_agree(machine: Machine) -> None:
    system = system_of_machine(machine)
    u = forces(12)["force_x"][:, None]
    assert shares(second(system, u, 4e-6), simulate(system, u, 4e-6)) < 1e-6


@pytest.mark.thorough
def test_the_error_of_fixed_steps_bounds_what_finer_ones_change() -> None:
    system = system_of_machine(BENT)
    of = closed(system)
    assert of is not None
    u = forces(12)["force_x"][:, None]
    coarse, changed = simulate_closed(of, u, 2e-5, 0.0, 1e-2)
    fine = simulate_closed(of, u, 2e-5, 0.0, 0.0)[0]
    assert np.all(np.max(np.abs(fine - coarse), axis=0) <= changed)
    assert np.max(changed / np.max(np.abs(fine), axis=0)) > 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    "law", [BRISTLE, BoucWen(4e7, 36.0, 2.0, 0.5), Maxwell(5e7, 2e3)], ids=lambda law: str(law.kind)
)
def test_a_stiff_machine_with_a_law_that_is_integrated_repeats_its_run(law: JointLaw, tmp_path: Path) -> None:
    machine = on_base(law, Linear(2e8), Viscous(300.0), base=1e14, frequency=(10.0, 3000.0))
    assert stiff_closed(system_of_machine(machine)) is not None
    assert verify_fmu(export_fmu(machine, tmp_path / "a.fmu").file).difference < 5e-5


@pytest.mark.slow
def test_a_stiff_machine_has_no_explicit_steps_and_repeats_its_run(tmp_path: Path) -> None:
    """A base of 700 kHz: explicit steps would be bound by it."""
    system = system_of_machine(STIFF)
    assert stiff_closed(system) is not None
    assert stiff_closed(system_of_machine(BENT)) is None
    made = export_fmu(STIFF, tmp_path / "a.fmu")
    assert verify_fmu(made.file).difference < 1e-6
    folder, given = unpacked(STIFF, 2), forces(40, 30.0)
    fine = Stepping(folder, 2, tolerance=1e-8).run(given, 1.6e-5, OUTPUTS)
    usual = Stepping(folder, 2).run(given, 1.6e-5, OUTPUTS)
    assert 0 < shares(usual, fine) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", repeats(["guide_mill", "three_joints", "two_mass"], lambda name: name == "two_mass"))
def test_library_machines_keep_the_tolerance(name: str) -> None:
    machine = library_machine(name)
    system = system_of_machine(machine)
    given = {s.name: s.size * forces(100, 1.0)["force_x"] for s in system.inputs}
    run = partial(Stepping, unpacked(machine, 2), 2)
    assert system.step is not None
    outputs = [s.name for s in system.outputs]
    expected = run().run(given, system.step, outputs)
    assert shares(run(tolerance=1e-5).run(given, system.step, outputs), expected) < 1e-4


@pytest.mark.thorough
@pytest.mark.parametrize("tolerance", [None, 1e-6], ids=["explicit", "closed"])
def test_forces_that_go_on_between_steps_come_in_time(tolerance: float | None) -> None:
    """A sine in 178 steps a period beside one in tiny steps: held, as straight lines, as parabolas, and asked for."""
    folder, omega, h, steps = unpacked(BENT, 2), 2 * np.pi * 180.0, 3.125e-5, 400
    fine = 64
    t = h / fine * (np.arange(steps * fine) + 0.5)
    expected = Stepping(folder, 2).run({"force_x": 100 * np.sin(omega * t)}, h / fine, OUTPUTS[:1])[fine - 1 :: fine]

    def force(time: float) -> dict[str, float]:
        return {"force_x": 100 * float(np.sin(omega * time))}

    def run(order: int) -> Array:
        fmu, rows = Stepping(folder, 2, tolerance=tolerance), []
        for i in range(steps):
            now, between, then = (force(h * k)["force_x"] for k in (i, i + 0.5, i + 1))
            fmu.put({"force_x": now})
            bend = 4 * (now - 2 * between + then) / h**2 if order > 1 else 0.0
            given = [(then - now) / h - bend * h / 2, bend][:order]
            place = (ctypes.c_uint * order)(*[fmu.place["force_x"]] * order)
            orders, values = (ctypes.c_int * order)(*range(1, order + 1)), (ctypes.c_double * order)(*given)
            assert fmu.fmu.fmi2SetRealInputDerivatives(fmu.fmu.component, place, order, orders, values) == 0
            fmu.fmu.doStep(fmu.time, h)
            fmu.time += h
            rows.append(fmu.get(OUTPUTS[:1]))
        return np.array(rows)

    # The chord of a sine lies (ω h)²/12 of its amplitude beside it, in the mean square over a step.
    assert shares(run(1), expected) < 1.2 * (omega * h) ** 2 / 12
    assert shares(run(0), expected) > 1e-2
    # The parabola through both ends and the middle: (ω h)³/(72 √3).
    assert shares(run(2), expected) < (omega * h) ** 3 / 72
    asked = Stepping(unpacked(BENT, 3), 3, tolerance=tolerance, forces_at=force)
    rows = []
    for _ in range(steps):
        asked.step({}, h)
        rows.append(asked.get(OUTPUTS[:1]))
    assert shares(np.array(rows), expected) < (omega * h) ** 3 / 72
    assert asked.get(["force_x"])[0] == pytest.approx(force(steps * h)["force_x"], abs=1e-9)


@pytest.mark.slow
@one_version
@pytest.mark.parametrize("tolerance", [None, 1e-5], ids=["explicit", "closed"])
@pytest.mark.parametrize("machine", [BENT, RUBBING, BRISTLING], ids=["bent", "rubbing", "bristling"])
def test_derivatives_of_outputs_are_how_they_go_on(machine: Machine, tolerance: float | None, fmi: int) -> None:
    fmu = Stepping(unpacked(machine, fmi), fmi, tolerance=tolerance)
    fmu.run(forces(30), 3e-5, OUTPUTS[:1])
    n = len(OUTPUTS)
    places, rates = (ctypes.c_uint * n)(*(fmu.place[name] for name in OUTPUTS)), (ctypes.c_double * n)()
    asked = fmu.fmu.component, places, n, (ctypes.c_int * n)(*[1] * n), rates
    before = fmu.get(OUTPUTS)
    if fmi == 2:
        assert fmu.fmu.fmi2GetRealOutputDerivatives(*asked) == 0
    else:
        assert fmu.fmu.fmi3GetOutputDerivatives(*asked, n) == 0
    tiny = 1e-9
    fmu.step({}, tiny)
    found = (fmu.get(OUTPUTS) - before) / tiny
    assert np.array(rates) == pytest.approx(found, rel=1e-3)
