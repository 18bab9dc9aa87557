"""Machines as FMUs: the equations of motion written down again here, energy, steady response, events, saved states."""

from __future__ import annotations

import dataclasses
import itertools
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from machine_host import Exchange, Stepping, library_machine, unpacked
from repeats import repeats
from runtime_library import SANITIZED, STRICT
from samples import LAWS
from scipy.integrate import solve_ivp
from tools import require

from fmu.export import export_fmu
from fmu.members.archive import archive_bytes, read_archive
from fmu.members.machine_system import system_of_component, system_of_machine
from fmu.members.native_members import native_sources
from fmu.system.system import System, fmi_name, system_of_connection
from fmu.verify import verify_fmu
from jointlib.arrays import Array
from jointlib.errors import CheckFailed, InputError
from jointlib.joint import Joint
from jointlib.law import JointLaw, Motion
from jointlib.laws.contact_loss import ContactLoss
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.hertz_guide import HertzGuide
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.lugre import LuGre
from jointlib.laws.maxwell import Maxwell
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Rigid, SecondOrder, response

both_versions = pytest.mark.parametrize("fmi", [2, 3])
one_version = pytest.mark.parametrize("fmi", repeats([2, 3], lambda fmi: fmi == 3))
SHIPPED = ("paper_sdof", "two_mass", "guide_mill", "two_mode_tool", "guide_body")
TIGHT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-20}


@pytest.fixture(autouse=True)
def _compiler() -> None:
    require("cc")


@dataclass(frozen=True)
class Physics:
    """A shipped machine once more: x' = slope(x, forces), outputs(x), both from its file by hand."""

    name: str
    size: int
    step: float
    forces: dict[str, float]
    """Largest held forces in N."""
    slope: Callable[[Array, Array], Array]
    outputs: dict[str, Callable[[Array], float]]

    def run(self, forces: Array) -> Array:
        """Outputs behind each step at held forces (steps, forces)."""
        x, rows = np.zeros(self.size), []
        for held in forces:
            x = solve_ivp(lambda _, x, held=held: self.slope(x, held), (0.0, self.step), x, **TIGHT).y[:, -1]
            rows.append([output(x) for output in self.outputs.values()])
        return np.array(rows)


def eq33(z: float, v: float) -> float:
    """The guide of eq. 33 of the paper."""
    return 654.164e6 * z - 1.7083e18 * z**3 + 463.062 * v - 19.8415e12 * z**2 * v


def softening(z: float, v: float) -> float:
    """The guide of two_mass."""
    return 654.164e6 * z - 1.7083e18 * z**3 + 463.062 * v


def hertz(z: float, v: float) -> float:
    """The guide of guide.joint.toml: two rows of balls at 45 degrees, preloaded with 630 N."""
    u = z * np.sin(np.pi / 4) / (3.931408125e-8 * 630.0 ** (2 / 3))
    rows = max(1 + u, 0.0) ** 1.5 - max(1 - u, 0.0) ** 1.5
    return 2 * np.sin(np.pi / 4) * 630.0 * rows + 503.0 * v


def two_masses(x: Array, held: Array) -> Array:
    """Displacements and velocities of slide and base."""
    f = softening(x[0] - x[1], x[2] - x[3])
    return np.array([x[2], x[3], (held[0] - f) / 0.942, (f - 200.0 * x[3] - 2e8 * x[1]) / 2.2])


OMEGA_COLUMN, OMEGA_NORMAL = 2 * np.pi * 160.0, 2 * np.pi * 980.0
# Coordinates: column c, pitch of the head, tip. The head's centre stands 0.14 m below the nut, which moves with the
# column, and the spindle nose 0.36 m below the centre: u = c - 0.14 pitch, holder = u - 0.36 pitch.
HEAD, HOLDER, TIP = np.array([1.0, -0.14, 0.0]), np.array([1.0, -0.5, 0.0]), np.array([0.0, 0.0, 1.0])
SPRUNG = TIP - HOLDER
MASS = 260.0 * np.diag([1.0, 0.0, 0.0]) + 38.0 * np.outer(HEAD, HEAD) + np.diag([0.0, 1.6, 0.0])
MASS += 1.5 * np.outer(HOLDER, HOLDER) + 0.8 * np.outer(TIP, TIP)
DAMPING = np.diag([2 * 0.03 * OMEGA_COLUMN * 260.0, 0.0, 0.0]) + 560.0 * np.outer(SPRUNG, SPRUNG)
STIFFNESS = np.diag([OMEGA_COLUMN**2 * 260.0, 0.0, 0.0]) + 60e6 * np.outer(SPRUNG, SPRUNG)
GUIDE = np.array([0.0, -0.14, 0.0])


def mill(x: Array, held: Array) -> Array:
    """Three coordinates of the feed direction and the tip normal to it, then their velocities."""
    q, p, y, w = x[:3], x[4:7], x[3], x[7]
    load = TIP * held[0] - GUIDE * hertz(GUIDE @ q, GUIDE @ p) - DAMPING @ p - STIFFNESS @ q
    normal = held[1] / 1.4 - 2 * 0.03 * OMEGA_NORMAL * w - OMEGA_NORMAL**2 * y
    return np.array([*p, w, *np.linalg.solve(MASS, load), normal])


SDOF = Physics(
    "paper_sdof",
    2,
    1e-4,
    {"force_x": 200.0},
    lambda x, held: np.array([x[1], (held[0] - eq33(x[0], x[1])) / 60.0]),
    {
        "displacement_x": lambda x: x[0],
        "velocity_x": lambda x: x[1],
        "guide.displacement": lambda x: x[0],
        "guide.velocity": lambda x: x[1],
        "guide.force": lambda x: eq33(x[0], x[1]),
    },
)
TWO_MASS = Physics(
    "two_mass",
    4,
    2e-5,
    {"force_x": 100.0},
    two_masses,
    {
        "displacement_x": lambda x: x[0],
        "velocity_x": lambda x: x[2],
        "guide.displacement": lambda x: x[0] - x[1],
        "guide.velocity": lambda x: x[2] - x[3],
        "guide.force": lambda x: softening(x[0] - x[1], x[2] - x[3]),
    },
)
MILL = Physics(
    "guide_mill",
    8,
    1e-4,
    {"force_x": 400.0, "force_y": 300.0},
    mill,
    {
        "displacement_x": lambda x: x[2],
        "velocity_x": lambda x: x[6],
        "displacement_y": lambda x: x[3],
        "velocity_y": lambda x: x[7],
        "guide.displacement": lambda x: GUIDE @ x[:3],
        "guide.velocity": lambda x: GUIDE @ x[4:7],
        "guide.force": lambda x: hertz(GUIDE @ x[:3], GUIDE @ x[4:7]),
    },
)
every_machine = pytest.mark.parametrize(
    "machine", repeats([SDOF, TWO_MASS, MILL], lambda m: m is SDOF), ids=lambda m: m.name
)


def held(machine: Physics, steps: int) -> dict[str, Array]:
    """Forces that jump from step to step and end."""
    rng = np.random.default_rng(4)
    quiet = np.arange(steps) > 0.8 * steps
    return {name: np.where(quiet, 0.0, rng.uniform(-size, size, steps)) for name, size in machine.forces.items()}


def shares(found: Array, expected: Array) -> Array:
    """Largest difference of each output as a share of its largest value."""
    return np.asarray(np.max(np.abs(found - expected), axis=0) / np.max(np.abs(expected), axis=0))


@one_version
@pytest.mark.parametrize("kind", [Stepping, Exchange])
@every_machine
def test_machine_moves_as_its_equations_of_motion_say(
    machine: Physics, kind: type[Stepping | Exchange], fmi: int
) -> None:
    forces = held(machine, 120)
    expected = machine.run(np.column_stack(list(forces.values())))
    found = kind(unpacked(library_machine(machine.name), fmi), fmi).run(forces, machine.step, list(machine.outputs))
    assert np.max(shares(found, expected)) < 1e-6


@one_version
@pytest.mark.parametrize(
    "name",
    repeats(["paper_sdof", "two_mass", "guide_mill", "two_mode_tool", "guide_body"], lambda name: name == "paper_sdof"),
)
def test_fmpy_finds_no_problem_in_the_fmu_of_a_shipped_machine(name: str, fmi: int) -> None:
    folder = unpacked(library_machine(name), fmi)
    assert validate_fmu(str(folder)) == []
    assert {path.name for path in (folder / "sources").iterdir()} >= {"integrate.c", "structure.c", "joint.c"}


def test_long_communication_step_hides_no_motion() -> None:
    fmus = [Stepping(unpacked(library_machine("two_mass"), 2), 2) for _ in range(2)]
    outputs = list(TWO_MASS.outputs)
    fine = fmus[0].run({"force_x": np.full(400, 80.0)}, 5e-6, outputs)
    coarse = fmus[1].run({"force_x": np.full(1, 80.0)}, 2e-3, outputs)
    assert coarse[-1] == pytest.approx(fine[-1], rel=1e-6, abs=1e-8 * float(np.max(np.abs(fine[:, 0]))))


def test_work_of_the_force_is_stored_or_dissipated() -> None:
    h, rng = 5e-7, np.random.default_rng(9)
    force = np.repeat(np.where(np.arange(40) < 30, rng.uniform(-100.0, 100.0, 40), 0.0), 100)
    fmu = Stepping(unpacked(library_machine("two_mass"), 2), 2)
    names = ["displacement_x", "velocity_x", "guide.displacement", "guide.velocity"]
    rows = np.vstack([np.zeros(4), fmu.run({"force_x": force}, h, names)])
    x, v, z, w = rows.T
    worked = float(np.sum(force * np.diff(x)))
    base, speed = x - z, v - w
    power = 463.062 * w**2 + 200.0 * speed**2
    simpson = h / 3 * np.sum(power[:-2:2] + 4 * power[1:-1:2] + power[2::2])
    stored = 0.942 * v**2 / 2 + 2.2 * speed**2 / 2 + 2e8 * base**2 / 2 + 654.164e6 * z**2 / 2 - 1.7083e18 * z**4 / 4
    size = float(np.max(stored))
    assert simpson > 0.1 * size
    assert worked == pytest.approx(stored[-1] + simpson, rel=0, abs=1e-7 * size)


def steady_amplitude(machine: Machine, force: float, frequency: float, output: str) -> float:
    """First harmonic of an output under a sine in 400 held steps a period, from the start that repeats (Newton)."""
    folder, steps = unpacked(machine, 2), 400
    h = 1 / (steps * frequency)
    # The sine's mean over each step, so that held levels carry the whole first harmonic.
    edge = np.cos(2 * np.pi * np.arange(steps + 1) / steps)
    levels = force * (edge[:-1] - edge[1:]) * steps / (2 * np.pi)
    states = [v for v in Exchange(folder, 2).states if v.startswith("mode[")]

    def period(x: Array) -> tuple[Array, Array]:
        fmu = Stepping(folder, 2, dict(zip(states, x, strict=True)))
        try:
            z = fmu.run({"force_x": levels}, h, [output])[:, 0]
            return fmu.get(states), z
        finally:
            fmu.fmu.freeInstance()

    x = np.zeros(len(states))
    size = np.where(np.arange(len(states)) % 2, 2 * np.pi * frequency, 1.0) * 1e-9
    for _ in range(12):
        end, _ = period(x)
        columns = [(period(x + e)[0] - end) / s for e, s in zip(np.diag(size), size, strict=True)]
        move = np.linalg.solve(np.column_stack(columns) - np.eye(len(x)), x - end)
        x = x + move
        if np.max(np.abs(move / size)) < 1e-2:
            break
    else:
        pytest.fail("the periodic motion was not found")
    turn = np.exp(-2j * np.pi * np.arange(1, steps + 1) / steps)
    return float(abs(2 * np.mean(period(x)[1] * turn)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "force", "resonance"), [("paper_sdof", 1.527, 0), ("two_mass", 25.0, 0), ("two_mass", 25.0, 1)]
)
def test_steady_vibration_under_a_sine_has_the_amplitude_of_harmonic_balance(
    name: str, force: float, resonance: int
) -> None:
    machine = library_machine(name)
    peaks = [peak for peak in response(machine, force=[force]).peaks if peak.force == force]
    peak = sorted(peaks, key=lambda p: p.frequency)[resonance]
    found = steady_amplitude(machine, force, peak.frequency, "guide.displacement")
    assert found == pytest.approx(peak.amplitude, rel=5e-3)


@pytest.mark.slow
@both_versions
def test_saved_state_repeats_the_run_bit_for_bit(fmi: int) -> None:
    machine = rubbing()
    fmu = Stepping(unpacked(machine, fmi), fmi)
    outputs = ["displacement_x", "velocity_x", "'my guide'.force"]
    rng = np.random.default_rng(2)
    fmu.run({"force_x": rng.uniform(-300, 300, 50)}, 3e-5, outputs)
    later = {"force_x": rng.uniform(-300, 300, 80)}
    get, put = (fmu.fmu.getFMUstate, fmu.fmu.setFMUstate) if fmi == 2 else (fmu.fmu.getFMUState, fmu.fmu.setFMUState)
    saved, time = get(), fmu.time
    first = fmu.run(later, 3e-5, outputs)
    put(saved)
    fmu.time = time
    again = fmu.run(later, 3e-5, outputs)
    assert np.array_equal(first, again)
    pack, unpack = (
        ("serializeFMUstate", "deSerializeFMUstate") if fmi == 2 else ("serializeFMUState", "deserializeFMUState")
    )
    other = Stepping(unpacked(machine, fmi), fmi)
    kept = getattr(other.fmu, unpack)(getattr(fmu.fmu, pack)(saved))
    (other.fmu.setFMUstate if fmi == 2 else other.fmu.setFMUState)(kept)
    other.time = time
    assert np.array_equal(other.run(later, 3e-5, outputs), first)


def on_base(name: str, joint: Joint, force: float = 300.0) -> Machine:
    """A slide of 2 kg on a sprung base, the joint between them."""
    base = Lumped("base", ("x",), np.array([[5.0]]), np.array([[300.0]]), np.array([[1e8]]))
    between = Connection(name, ("slide.x", "base.x"), joint)
    slide = Lumped("slide", ("x",), np.array([[2.0]]))
    return Machine((slide, base), (between,), name="on base", tool={"x": "slide.x"}, force=(force,))


RUBBING = Joint((HertzGuide(630.0, 3.931408125e-8), Viscous(300.0), Jenkins(4e7, 36.0)), "rubbing")
_RUBBING = on_base("my guide", RUBBING)
REMEMBERING = Joint((HertzGuide(630.0, 3.931408125e-8), Maxwell(4e7, 1.2e4), LuGre(4e7, 300.0, 36.0, 50.0, 0.02)))
_REMEMBERING = on_base("guide", REMEMBERING)


def rubbing() -> Machine:
    return _RUBBING


@pytest.mark.slow
def test_names_with_blanks_and_dots_stand_in_quotes() -> None:
    names = Stepping(unpacked(rubbing(), 2), 2).place
    assert {"'my guide'.hertz_guide.preload", "'my guide'.jenkins.slider", "'my guide'.force", "force_x"} <= set(names)
    assert [fmi_name(text) for text in ("guide", "a.b-c", "1st")] == ["guide", "'a.b-c'", "'1st'"]


@pytest.mark.thorough
@one_version
def test_slider_between_two_masses_sticks_and_slips_where_its_force_says(fmi: int) -> None:
    """Stick and slip integrated one after the other, each to the instant where it ends."""
    k, slip = 4e7, 36.0
    rng = np.random.default_rng(6)
    force = rng.uniform(-300.0, 300.0, 60)
    x, slider, mode, rows = np.zeros(4), 0.0, 0, []

    def pull(x: Array, slider: float, mode: int) -> float:
        z, v = x[0] - x[1], x[2] - x[3]
        return hertz(z, v) - 203.0 * v + (mode * slip if mode else k * (z - slider))

    for level in force:
        time, h = 0.0, 3e-5
        while time < h:

            def slope(_: float, x: Array, level: float = level, slider: float = slider, mode: int = mode) -> Array:
                f = pull(x, slider, mode)
                return np.array([x[2], x[3], (level - f) / 2.0, (f - 300.0 * x[3] - 1e8 * x[1]) / 5.0])

            def ends(_: float, x: Array, slider: float = slider, mode: int = mode) -> float:
                return mode * (x[2] - x[3]) if mode else slip - k * abs(x[0] - x[1] - slider)

            ends.terminal, ends.direction = True, -1.0  # type: ignore[attr-defined]
            done = solve_ivp(slope, (time, h), x, events=ends, **TIGHT)
            x, time = done.y[:, -1], float(done.t[-1])
            if done.status == 1:
                slider = x[0] - x[1] - mode * slip / k if mode else slider
                mode = 0 if mode else int(np.sign(x[0] - x[1] - slider))
        rows.append([x[0], x[2], pull(x, slider, mode)])
    fmu = Stepping(unpacked(rubbing(), fmi), fmi)
    found = fmu.run({"force_x": force}, 3e-5, ["displacement_x", "velocity_x", "'my guide'.force"])
    assert np.max(shares(found, np.array(rows))) < 1e-6


@pytest.mark.slow
def test_directional_derivatives_are_the_differences_of_outputs_and_rates() -> None:
    fmu = Exchange(unpacked(_REMEMBERING, 2), 2)
    knowns = ["force_x", *fmu.states]
    outputs = [str(u.variable.name) for u in fmu.read.outputs]
    unknowns = [*outputs, *fmu.rates]
    size = np.array([10.0, *[1e-6 if i % 2 == 0 else 1e-2 for i in range(4)], 3e-7, 3e-7])
    assert len(size) == len(knowns)
    rng = np.random.default_rng(3)

    def answer(point: Array) -> Array:
        fmu.put({"force_x": point[0]})
        rates = fmu.slope(0.0, point[1:])
        return np.array([*fmu.get(outputs), *rates])

    for _ in range(5):
        point = size * rng.normal(size=len(size))
        jacobian = np.empty((len(unknowns), len(knowns)))
        answer(point)
        for j, known in enumerate(knowns):
            places = [fmu.place[u] for u in unknowns]
            jacobian[:, j] = fmu.fmu.getDirectionalDerivative(places, [fmu.place[known]], [size[j]])
        steps = 1e-4 * np.diag(size)
        found = np.column_stack([(answer(point + e) - answer(point - e)) / 2e-4 for e in steps])
        scale = np.max(np.abs(jacobian), axis=1, keepdims=True)
        assert np.max(np.abs(found - jacobian) / scale) < 1e-6
        declared = {
            str(u.variable.name): {str(v.name) for v in u.dependencies}
            for u in (*fmu.read.outputs, *fmu.read.derivatives)
        }
        for unknown, row in zip(unknowns, jacobian, strict=True):
            assert {k for k, slope in zip(knowns, row, strict=True) if slope} <= declared[unknown]


M, K, C, STOP, GAP = 3.0, 2e6, 40.0, 5e7, 1e-5
STOPPED = Machine(
    (Lumped("mass", ("x",), np.array([[M]]), np.array([[C]]), np.array([[K]])),),
    (Connection("stop", ("mass.x", "ground"), Joint((ContactLoss(-STOP, GAP, 1.0),))),),
    name="stopped",
    tool={"x": "mass.x"},
    force=(15.0,),
)


def stopped(force: Array, h: float) -> tuple[Array, int]:
    """Displacement and velocity behind each step, and how often the stop was met; contact by scipy's events."""
    x, rows, met = np.zeros(2), [], 0
    for level in force:
        time = 0.0
        while time < h:
            closed = x[0] > GAP or (x[0] == GAP and x[1] > 0)

            def slope(_: float, x: Array, level: float = level, closed: bool = closed) -> Array:
                push = STOP * (x[0] - GAP) if closed else 0.0
                return np.array([x[1], (level - push - C * x[1] - K * x[0]) / M])

            def edge(_: float, x: Array) -> float:
                return float(x[0] - GAP)

            edge.terminal, edge.direction = True, -1.0 if closed else 1.0  # type: ignore[attr-defined]
            done = solve_ivp(slope, (time, h), x, events=edge, max_step=1e-4, **TIGHT)
            x, time = done.y[:, -1].copy(), float(done.t[-1])
            if done.status == 1:
                x[0], met = GAP, met + (not closed)
        rows.append(x)
    return np.array(rows), met


@pytest.mark.thorough
@both_versions
def test_end_stop_is_met_within_one_communication_step(fmi: int) -> None:
    h, force = 8e-3, np.tile([15.0, 0.0, -12.0, 21.0], 4)
    expected, met = stopped(force, h)
    assert met > len(force)  # several contacts in a step
    found = Stepping(unpacked(STOPPED, fmi), fmi).run({"force_x": force}, h, ["displacement_x", "velocity_x"])
    assert np.max(shares(found, expected)) < 1e-6


@pytest.mark.thorough
def test_importer_with_events_meets_the_end_stop() -> None:
    h, force = 4e-3, 15.0
    expected, met = stopped(np.full(10, force), h)
    assert met > 2
    folder = str(unpacked(STOPPED, 2))
    result = simulate_fmu(
        folder,
        fmi_type="ModelExchange",
        stop_time=10 * h,
        output_interval=h,
        relative_tolerance=1e-10,
        start_values={"force_x": force},
        output=["displacement_x"],
    )
    at = [np.flatnonzero(np.abs(result["time"] - (i + 1) * h) < 1e-9 * h)[-1] for i in range(10)]
    found = result["displacement_x"][at]
    # CVode and FMPy find an event within a step's tolerance.
    assert np.max(np.abs(found - expected[:, 0])) < 1e-5 * np.max(np.abs(expected[:, 0]))


@one_version
def test_only_a_solver_that_went_on_with_old_forces_is_told_to_begin_again(fmi: int) -> None:
    fmu = Exchange(unpacked(STOPPED, fmi), fmi)
    x = np.zeros(fmu.n)

    def step(told: float | None, at: float, behind: float | None) -> bool:
        """A step whose rates are of time ``at``, with a force told before or after; True if it ends in an event."""
        fmu.fmu.setTime(at)
        if told is not None:
            fmu.put({"force_x": told})
        fmu.slope(at, x)
        if behind is not None:
            fmu.put({"force_x": behind})
        event, over = fmu.fmu.completedIntegratorStep()
        assert not over
        return bool(event)

    assert not any(step(t * 1e3, t, None) for t in np.linspace(1e-3, 1e-2, 10))
    assert not step(None, 2e-2, 10.0)  # as it was
    assert step(None, 3e-2, 11.0)
    fmu.fmu.enterEventMode()
    fmu.put({"force_x": 12.0})
    fmu.settle()
    assert not step(None, 4e-2, None)


@pytest.mark.slow
def test_a_solver_that_holds_forces_past_output_points_comes_to_the_motion_of_co_simulation() -> None:
    """FMPy's CVode, which without an event for new forces is 11 % off."""
    folder = unpacked(library_machine("guide_mill"), 2)
    found = verify_fmu(folder.with_suffix(".fmu"), exchange=True).exchange
    assert found is not None
    assert found < 5e-3


@pytest.mark.thorough
def test_mass_that_only_grazes_the_stop_meets_it() -> None:
    """Free vibration about F/K reaches 2 F/K: the stop stands a hair before that."""
    force, h = 1.001 * GAP * K / (1 + np.exp(-np.pi * C / (2 * np.sqrt(K * M)))), 2 * np.pi * np.sqrt(M / K)
    expected, met = stopped(np.array([force]), h)
    free = solve_ivp(lambda _, x: [x[1], (force - C * x[1] - K * x[0]) / M], (0.0, h), [0.0, 0.0], **TIGHT).y[:, -1]
    found = Stepping(unpacked(STOPPED, 2), 2).run({"force_x": np.array([force])}, h, ["displacement_x", "velocity_x"])
    assert met == 1
    assert np.max(np.abs(found[0] - expected[0]) / np.abs(expected[0] - free)) < 1e-4


@pytest.mark.slow
def test_motion_that_cannot_go_on_ends_with_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    machine = on_base("guide", Joint((Linear(1e6), Coulomb(50.0, 1e-3))))
    fmu = Stepping(unpacked(machine, 2), 2, {"guide.coulomb.smoothing_velocity": 0.0})
    with pytest.raises(FMICallException):
        fmu.run({"force_x": np.full(50, 20.0)}, 1e-2, ["displacement_x"])
    assert "the motion takes too many steps; a joint that sticks without a spring" in capsys.readouterr().out
    with pytest.raises(FMICallException):
        fmu.get(["displacement_x"])


@pytest.mark.slow
def test_machine_repeats_its_reference_run_and_a_bent_one_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = export_fmu(library_machine("two_mass"), tmp_path / "a.fmu")
    found = verify_fmu(told.file)
    assert found.difference < 1e-7
    assert told.max_step == found.max_step == pytest.approx(1 / (20 * 7000.0))
    assert any("half a step late" in text for text in told.messages)
    monkeypatch.setattr(Linear, "force", lambda self, z, v: 1.00001 * self.stiffness * z)
    with pytest.raises(CheckFailed, match="the reference has"):
        export_fmu(library_machine("two_mass"), tmp_path / "b.fmu")
    assert not (tmp_path / "b.fmu").exists()


def test_tolerance_of_the_reference_run_is_part_of_what_the_token_covers(tmp_path: Path) -> None:
    members = read_archive(export_fmu(library_machine("paper_sdof"), tmp_path / "a.fmu").file)
    text = members["modelDescription.xml"]
    assert b'referenceTolerance="1e-06"' in text
    members["modelDescription.xml"] = text.replace(b'referenceTolerance="1e-06"', b'referenceTolerance="1e-07"')
    (tmp_path / "b.fmu").write_bytes(archive_bytes(members))
    with pytest.raises(CheckFailed, match="was changed after its export"):
        verify_fmu(tmp_path / "b.fmu")


def test_foreign_fmu_may_not_ask_for_much_to_be_overlooked(tmp_path: Path) -> None:
    members = read_archive(export_fmu(library_machine("paper_sdof"), tmp_path / "a.fmu").file)
    text = members["modelDescription.xml"].replace(b'generationTool="jointlib', b'generationTool="other')
    members["modelDescription.xml"] = text.replace(b'referenceTolerance="1e-06"', b'referenceTolerance="0.5"')
    (tmp_path / "b.fmu").write_bytes(archive_bytes(members))
    with pytest.raises(InputError, match=r"referenceTolerance is 0\.5, expected at most 0\.001"):
        verify_fmu(tmp_path / "b.fmu")


@pytest.mark.slow
def test_same_machine_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = library_machine("guide_mill")
    once = export_fmu(machine, tmp_path / "a.fmu", fmi=3).file.read_bytes()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert export_fmu(machine, tmp_path / "b.fmu", fmi=3).file.read_bytes() == once


@pytest.mark.thorough
def test_connection_pulls_its_sides_together_with_equal_forces() -> None:
    joint = Joint((HertzGuide(630.0, 3.931408125e-8), Viscous(503.0)))
    fmu = Stepping(unpacked(system_of_connection("guide 1", joint, 2), 3), 3)
    sides = {"displacement_1": 3e-6, "velocity_1": 0.01, "displacement_2": 1e-6, "velocity_2": -0.02}
    fmu.put(sides)
    force = float(joint.step(Motion(np.asarray(2e-6), np.asarray(0.03)), joint.initial_state(0.0))[0])
    assert fmu.get(["force_1", "force_2"]) == pytest.approx([-force, force], rel=1e-12)
    alone = Stepping(unpacked(system_of_connection("guide 1", joint, 1), 3), 3)
    alone.put({"displacement_1": 2e-6, "velocity_1": 0.03})
    assert alone.get(["force_1"])[0] == pytest.approx(-force, rel=1e-12)
    assert "displacement_2" not in alone.place


def test_free_body_accelerates_as_newton_says() -> None:
    body = Rigid("body", 4.0, np.array([1.0, 2.0, 3.0]))
    row = body.motion_at(np.array([0.0, 0.0, 0.5]), np.array([1.0, 0.0, 0.0]))
    assert row is not None
    fmu = Stepping(unpacked(system_of_component(body, {"top": row}), 2), 2)
    found = fmu.run({"force_top": np.full(10, 8.0)}, 0.1, ["displacement_top", "velocity_top"])[-1]
    # The force on the arm of 0.5 m turns the body about its y axis, too.
    acceleration = 8.0 * (1 / 4.0 + 0.5**2 / 2.0)
    assert found == pytest.approx([acceleration / 2, acceleration], rel=1e-9)


class Measured(Lumped):
    """A component known by its receptance only."""

    def second_order(self) -> SecondOrder:
        return None  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("machine", "asked", "said"),
    [
        (
            on_base("guide", Joint((Linear(1e7), Coulomb(5.0)))),
            {},
            "coulomb.smoothing_velocity is 0, so the force jumps",
        ),
        (
            Machine((Measured("frf", ("x",), np.eye(1)),), name="m", tool={"x": "frf.x"}),
            {},
            "component 'frf' has no equations of motion, only an FRF",
        ),
        (on_base("guide", Joint((Linear(1e7),))), {"runtime": "python"}, "the Python runtime does lone joints only"),
    ],
)
def test_machine_that_cannot_be_an_fmu_is_refused_in_a_sentence(
    machine: Machine, asked: dict[str, str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as error:
        export_fmu(machine, tmp_path / "a.fmu", **asked)  # type: ignore[arg-type]
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_law_that_exists_in_steps_only_is_refused_in_a_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fmu.code.c_kernel import FOLDER

    text = (FOLDER / "jenkins.h").read_text().replace("exchange: yes", "exchange: no")
    (tmp_path / "jenkins.h").write_text(text)
    monkeypatch.setattr("fmu.code.c_kernel.FOLDER", tmp_path)
    with pytest.raises(InputError, match="jenkins exists in steps only and cannot be integrated in a machine FMU"):
        export_fmu(on_base("guide", Joint((Jenkins(4e7, 36.0),))), tmp_path / "a.fmu")


@pytest.mark.slow
@pytest.mark.parametrize(
    "system",
    [
        system_of_machine(library_machine("guide_mill")),
        system_of_machine(_REMEMBERING),
        system_of_machine(STOPPED),
        system_of_component(Rigid("body", 4.0, np.ones(3)), {"x": np.eye(6)[0]}),
        system_of_connection("guide", RUBBING, 2),
    ],
    ids=lambda system: system.name,
)
def test_generated_source_pleases_a_strict_compiler(system: System, tmp_path: Path) -> None:
    gcc = require("gcc")
    for name, text in native_sources(system, 3, "model", "token").items():
        (tmp_path / Path(name).name).write_text(text)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O2", "-c", "-o", "all.o", "-I."]
    done = subprocess.run([gcc, *flags, "all.c"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("law", [law for law in LAWS if law.in_time], ids=lambda law: law.kind)
def test_every_law_in_a_machine_repeats_the_reference_run_of_its_python_law(law: JointLaw, tmp_path: Path) -> None:
    if isinstance(law, Coulomb) and law.smoothing_velocity == 0:
        pytest.skip("refused in a machine")
    machine = on_base("my guide", Joint((law, Linear(8e8), Viscous(300.0)), law.kind))
    assert verify_fmu(export_fmu(machine, tmp_path / "a.fmu").file).difference < 1e-6


def test_motion_starts_from_the_modes_that_are_set() -> None:
    """Free vibration: the displacement of a mode of 1 kg is the mass's times the root of it."""
    fmu = Stepping(unpacked(STOPPED, 3), 3, {"mode[0].displacement": -2e-6 * np.sqrt(M)})
    assert fmu.get(["displacement_x"])[0] == pytest.approx(-2e-6, rel=1e-12)
    omega, decay = np.sqrt(K / M - (C / (2 * M)) ** 2), C / (2 * M)
    t = 1e-3
    found = fmu.run({"force_x": np.zeros(1)}, t, ["displacement_x"])[0, 0]
    expected = -2e-6 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    assert found == pytest.approx(expected, rel=1e-8)


def test_parameter_of_a_joint_is_tuned_and_one_that_voids_it_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    folder = unpacked(library_machine("two_mass"), 2)
    soft = Stepping(folder, 2, {"guide.linear.stiffness": 0.0, "guide.cubic.stiffness3": 0.0})
    found = soft.run({"force_x": np.full(20, 1.0)}, 1e-5, ["guide.displacement"])[-1, 0]
    # The slide alone, held by the damper: m v' = F - c v, the base almost at rest.
    rate = 463.062 / 0.942
    alone = 1.0 / 463.062 * (2e-4 - (1 - np.exp(-rate * 2e-4)) / rate)
    assert found == pytest.approx(alone, rel=2e-2)
    with pytest.raises(FMICallException):
        Stepping(unpacked(STOPPED, 2), 2, {"stop.contact_loss.side": 0.5})
    assert "stop: contact-loss: side is neither of 1 and -1" in capsys.readouterr().out


@pytest.mark.thorough
def test_drive_that_is_not_the_tool_has_a_force_of_its_own_and_reciprocity_holds() -> None:
    machine = dataclasses.replace(on_base("guide", Joint((Linear(2e8), Viscous(300.0)))), drive="base.x")
    folder = unpacked(machine, 2)
    names = Stepping(folder, 2).place
    assert {"force_x", "force_drive", "displacement_x", "displacement_drive"} <= set(names)
    level = np.random.default_rng(8).uniform(-1.0, 1.0, 40)
    pairs = (("force_x", "displacement_drive"), ("force_drive", "displacement_x"))
    one, two = (Stepping(folder, 2).run({force: level}, 1e-4, [moved])[:, 0] for force, moved in pairs)
    assert one == pytest.approx(two, rel=0, abs=1e-8 * float(np.max(np.abs(one))))


def sanitized_host(machine: Machine, folder: Path) -> Path:
    """A program that holds a machine's FMU, built with the sanitizers."""
    for name, text in native_sources(system_of_machine(machine), 2, "model", "token").items():
        (folder / Path(name).name).write_text(text)
    host = Path(__file__).with_name("machine_sanitized.c")
    command = [require("gcc"), *STRICT, *SANITIZED, f"-I{folder}", str(host), "-o", str(folder / "host"), "-lm"]
    subprocess.run(command, check=True)
    return folder / "host"


@pytest.mark.slow
@pytest.mark.parametrize(
    "machine",
    [
        pytest.param(library_machine("guide_mill"), marks=pytest.mark.slow),
        pytest.param(_RUBBING, marks=pytest.mark.slow),
        _REMEMBERING,
        pytest.param(STOPPED, marks=pytest.mark.slow),
    ],
)
def test_memory_and_arithmetic_of_a_machine_are_sound(machine: Machine, tmp_path: Path) -> None:
    asked = [["2000", way, fmi] for way in ("0", "1e-4", "rates") for fmi in "23"]
    host = str(sanitized_host(machine, tmp_path))
    for words in ([], *asked):
        done = subprocess.run([host, *words], capture_output=True, text=True, env={}, timeout=120)
        assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)


@pytest.mark.slow
@pytest.mark.parametrize("machine", [library_machine("guide_mill"), _RUBBING, _REMEMBERING, STOPPED])
def test_ten_million_steps_of_machines_are_sound(machine: Machine, tmp_path: Path) -> None:
    """A quarter of them each: explicit steps, joints closed at their tangents, model exchange, in both versions."""
    host = str(sanitized_host(machine, tmp_path))
    for (way, count), fmi in itertools.product({"0": 250_000, "1e-6": 50_000, "rates": 950_000}.items(), "23"):
        done = subprocess.run([host, str(count), way, fmi], capture_output=True, text=True, env={}, timeout=7200)
        assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)
