"""The same linearised machine by receptance coupling and as a python-control state space."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from repeats import repeats
from test_machine_coupling import lumped, random_machine

import machines
from jointlib.errors import InputError
from jointlib.io.joint_file import read_joint
from jointlib.joint import Joint
from jointlib.laws.coulomb import Coulomb
from jointlib.laws.jenkins import Jenkins
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Machine, Rigid, linear_check, read_machine
from machines.coupling.second_order import machine_equations
from machines.deadline import OutOfTime, within

LIBRARY = Path(machines.__file__).parent / "library"
MACHINES = sorted(p for p in LIBRARY.glob("*.toml") if 'schema = "jointlib/machine/1"' in p.read_text(encoding="utf-8"))
MEASURED = LIBRARY / "end_mill.toml"
FILES = [p for p in MACHINES if not p.stem.startswith(MEASURED.stem)]


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
@pytest.mark.parametrize("amplitude", repeats([None, 1e-6], lambda amplitude: amplitude is not None))
def test_every_shipped_machine_passes(path: Path, amplitude: float | None) -> None:
    machine = read_machine(path)
    for connection in machine.flexible:
        if connection.identify is not None:
            start = connection.identify.start
            assert start is not None
            machine = machine.with_joint(connection.name, read_joint(start))
    large = len(machine.connections) > 20
    lines = np.geomspace(*machine.frequency, 40) if large and machine.frequency else None
    check = linear_check(machine, amplitude, lines)
    assert check.passed
    assert check.max_relative_difference < 1e-8
    assert check.excluded == ()


def test_a_spindle_that_is_known_by_its_receptance_alone_cannot_be_checked() -> None:
    with pytest.raises(InputError, match="'spindle' has no equations of motion, only an FRF"):
        linear_check(read_machine(MEASURED))


@pytest.mark.parametrize("seed", range(8))
def test_machines_with_rigid_connections_pass(seed: int) -> None:
    machine = random_machine(seed, 3, rigid=True, free=seed % 2 == 0)
    assert linear_check(machine).max_relative_difference < 1e-8


def test_difference_of_one_percent_in_a_spring_is_seen() -> None:
    """The check must be able to fail: the state space of another machine lies far off."""
    machine = read_machine(LIBRARY / "two_mass.toml")
    other = machine.with_joint("guide", machine.joints()[0].with_parameters({"linear.stiffness": 1.01 * 654.164e6}))
    a, b = linear_check(machine), linear_check(other)
    assert np.linalg.norm(a.coupled.receptance - b.control.receptance) > 1e-3 * np.linalg.norm(a.coupled.receptance)


def test_gains_at_an_amplitude_are_those_of_the_describing_function_at_the_first_resonance() -> None:
    check = linear_check(read_machine(LIBRARY / "paper_sdof.toml"), 3e-6)
    assert check.resonance == pytest.approx(520.866, abs=1e-3)
    assert check.stiffness[0] == pytest.approx(654.164e6 - 0.75 * 1.7083e18 * 9e-12, rel=1e-12)
    assert check.damping[0] == pytest.approx(463.062 - 19.8415e12 * 9e-12 / 4, rel=1e-12)


def with_joint(*laws: Any) -> Machine:
    return Machine((lumped("m", [[60.0]]),), (Connection("guide", ("m.x", "ground"), Joint(laws)),), tool={"x": "m.x"})


def test_a_state_space_of_many_states_is_checked_on_fewer_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half as many states as it has: an eighth of the lines, which are spread over the same band."""
    machine = read_machine("machines/library/two_mass.toml")
    every = linear_check(machine)
    monkeypatch.setattr("machines.harmonic_balance.linear_check._SMALL", 2)
    few = linear_check(machine)
    assert few.passed
    assert (len(every.frequency), len(few.frequency)) == (400, 50)
    np.testing.assert_allclose(few.frequency[[0, -1]], every.frequency[[0, -1]])


def test_ideal_friction_has_no_tangent_at_rest_and_is_named() -> None:
    machine = with_joint(Linear(6e8), Viscous(500.0), Coulomb(10.0))
    check = linear_check(machine)
    assert [(e.connection, e.law) for e in check.excluded] == [("guide", "coulomb")]
    assert "no tangent at rest" in str(check.excluded[0])
    assert check.passed
    moving = linear_check(machine, 1e-6)
    assert moving.excluded == ()
    omega = 2 * np.pi * moving.resonance
    assert moving.damping[0] == pytest.approx(500.0 + 40 / (np.pi * 1e-6 * omega), rel=1e-9)
    assert moving.passed


def test_sticking_spring_takes_part_with_its_stiffness() -> None:
    check = linear_check(with_joint(Viscous(500.0), Jenkins(4e8, 20.0)))
    assert check.excluded == ()
    assert check.stiffness[0] == pytest.approx(4e8)
    assert check.passed


def test_law_of_the_frequency_domain_is_named() -> None:
    class Structural(Linear):
        kind: ClassVar[str] = "structural-damping"
        in_time: ClassVar[bool] = False

    check = linear_check(with_joint(Linear(6e8), Viscous(500.0), Structural(1e6)), 1e-6)
    assert [e.law for e in check.excluded] == ["structural_damping"]
    assert "no state space" in check.excluded[0].reason


def test_bodies_of_the_guide_have_the_natural_frequencies_of_its_modal_test() -> None:
    """Dhupia et al. 2008, eq. 14: 4800.2, 2656.2 and 2882.1 Hz; all other motions of two free bodies are free."""
    equations = machine_equations(read_machine(LIBRARY / "guide_body.toml"))
    found = equations.natural_frequencies(np.full(4, 150e6))
    assert found[-3:] == pytest.approx([2656.193, 2882.106, 4800.230], abs=6e-4)
    assert np.all(found[:-3] == 0)


def test_four_springs_at_the_corners_are_three_stiffnesses_at_the_centre() -> None:
    machine = read_machine(LIBRARY / "guide_body.toml")
    B = machine.rows(machine.flexible)
    K = B.T @ (150e6 * B)
    block = K[:6, :6]
    assert np.diag(block) == pytest.approx([0, 0, 600e6, 600e6 * 0.0125**2, 600e6 * 0.021**2, 0])
    assert np.abs(block - np.diag(np.diag(block))).max() < 1e-3


def test_lever_arm_is_the_motion_of_the_point_on_a_turning_body() -> None:
    """A small rotation moves the point at ρ by ϑ × ρ; the row must give its component along n."""
    rng = np.random.default_rng(3)
    at, centre, n, u, turn = (rng.normal(size=3) for _ in range(5))
    body = Rigid("b", 1.0, np.ones(3), centre)
    link = Connection("c", ("b", "ground"), Joint((Linear(1.0),)), at=tuple(at), direction=tuple(n))
    row = link.row([body])
    direction = n / np.linalg.norm(n)
    assert row @ np.concatenate([u, turn]) == pytest.approx(direction @ (u + np.cross(turn, at - centre)))


def test_frequency_and_amplitude_are_checked() -> None:
    machine = read_machine(LIBRARY / "two_mass.toml")
    with pytest.raises(InputError, match="amplitude is -1"):
        linear_check(machine, -1.0)
    with pytest.raises(InputError, match="ascending"):
        linear_check(machine, frequency=[7e3, 1e3])


def test_a_beam_held_by_a_flange_passes_as_what_cannot_move_is_not_compared(tmp_path: Path) -> None:
    bar = """schema = "jointlib/machine/1"
[[component]]
name = "bar"
kind = "beam"
axis = [0, 0, 1]
held = ["foot"]
material = [{ name = "steel", young = 2.1e11, poisson = 0.3, density = 7850, loss_factor = 0.01 }]
segment = [{ length = 0.2, diameter = 0.02 }]
station = [{ name = "tip", at = 0 }, { name = "foot", at = "end" }]
[[connection]]
name = "foot"
between = ["bar", "ground"]
at = [0, 0, 0.2]
rigid = true
[tool]
x = "bar.tip.x"
"""
    path = tmp_path / "bar.toml"
    path.write_text(bar)
    found = linear_check(read_machine(path), frequency=(100.0, 2000.0))
    assert found.passed
    assert found.coupled.outputs == tuple(f"bar.tip.{word}" for word in ("x", "y", "z", "rx", "ry", "rz"))


def test_the_check_ends_when_its_time_is_up() -> None:
    with within(0.0), pytest.raises(OutOfTime):
        linear_check(read_machine(Path(machines.__file__).parent / "library" / "two_mass.toml"))
