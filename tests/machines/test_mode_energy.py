"""Shares of energy and sensitivities of modes against machines computed anew."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from test_mixed_machines import random_machine
from test_natural_modes import chain

import machines
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Machine, natural_modes, read_machine
from machines.components.connection import Connection
from machines.components.lumped import Lumped
from machines.model.joint_places import bundles
from machines.modes.depth_sensitivity import depth_sensitivity, lowest_depth
from machines.modes.mode_energy import mode_energies
from machines.modes.mode_words import leading
from machines.modes.static_compliance import static_compliance
from machines.statics.working_point import at_working_point

LIBRARY = Path(machines.__file__).parent / "library"


def stiffer(machine: Machine, joint: int, by: float) -> Machine:
    """The machine with one joint stiffer by so many N/m, its damping as it was."""
    connection = machine.flexible[joint]
    assert connection.joint is not None
    return machine.with_joint(connection.name, connection.joint + Linear(by))


def by_difference(machine: Machine, joint: int, step: float = 1e-4) -> np.ndarray:
    """d ln f/d ln K from frequencies of two machines beside this one."""
    K = natural_modes(machine).stiffness[0, joint]
    up, down = (np.log(natural_modes(stiffer(machine, joint, s * step * K)).frequency) for s in (1, -1))
    return np.asarray(up - down) / (2 * step)


def test_strain_shares_sum_to_one_and_are_twice_the_slope_of_the_frequency() -> None:
    machine = chain(9, 0.0, 4)[0]
    found = mode_energies(natural_modes(machine))
    assert np.sum(found.strain, axis=0) == pytest.approx(np.ones(9), abs=1e-12)
    for joint in range(9):
        assert found.strain[joint] == pytest.approx(2 * by_difference(machine, joint), abs=1e-6)


@pytest.mark.parametrize("name", ["lathe", "carriage", "two_mass"])
def test_shares_of_joints_and_parts_together_are_one(name: str) -> None:
    modes = natural_modes(read_machine(LIBRARY / f"{name}.toml"))
    found = mode_energies(modes)
    assert found.kinetic is not None
    one = pytest.approx(np.ones(len(modes.pole)), abs=1e-12)
    assert np.sum(found.kinetic, axis=0) == one
    assert np.sum(found.strain, axis=0) + np.sum(found.strain_inside, axis=0) == one
    assert np.sum(found.loss, axis=0) + np.sum(found.loss_inside, axis=0) == one
    assert min(found.strain.min(), found.strain_inside.min(), found.loss.min()) > -1e-12


@pytest.mark.parametrize("kinds", [("beam", "rigid", "modal"), ("state-space", "rigid", "lumped")])
def test_slopes_of_the_frequency_are_exact_with_any_damping(kinds: tuple[str, ...]) -> None:
    machine, _ = random_machine(5, kinds)
    found = mode_energies(natural_modes(machine))
    for joint in (0, len(machine.flexible) // 2):
        expected = by_difference(machine, joint)[:8]
        assert found.sensitivity[joint, :8] == pytest.approx(expected, abs=1e-6 * max(1.0, np.abs(expected).max()))


def test_a_mode_moves_with_the_square_of_its_energies() -> None:
    """|s|² qᴴMq = qᴴKq of damped modes too: Rayleigh's quotient of a complex shape."""
    modes = natural_modes(read_machine(LIBRARY / "lathe.toml"))
    assert modes.equations is not None
    p, e = modes.coordinates, modes.equations
    assert p is not None
    kinetic = np.sum((p.conj() * (e.mass @ p)).real, axis=0) * np.abs(modes.pole) ** 2
    strain = np.sum((p.conj() * (e.stiffness @ p)).real, axis=0)
    strain += np.sum(modes.stiffness.T * np.abs(modes.stretch) ** 2, axis=0)
    assert strain == pytest.approx(kinetic, rel=1e-7)


@cache
def lathe() -> Machine:
    return at_working_point(read_machine(LIBRARY / "lathe.toml"))


def test_slopes_of_the_depth_are_those_of_lobes_computed_again() -> None:
    machine = lathe()
    found = depth_sensitivity(natural_modes(machine))
    assert found is not None
    K, h = natural_modes(machine).stiffness[0], 1e-3
    joint = int(np.argmax(np.abs(found.joints)))
    depths = [lowest_depth(stiffer(machine, joint, s * h * K[joint])).minimum_depth for s in (1, -1)]
    assert found.joints[joint] == pytest.approx((depths[0] - depths[1]) / (2 * h * found.depth), rel=1e-3)


@pytest.mark.slow
def test_slopes_of_a_mill_are_those_of_lobes_computed_again() -> None:
    machine = at_working_point(read_machine(LIBRARY / "column_mill_a.toml"))
    found = depth_sensitivity(natural_modes(machine))
    assert found is not None
    K, h = natural_modes(machine).stiffness[0], 1e-3
    for rows in [rows for name, rows in bundles(machine.flexible).items() if name in ("front", "taper", "z_guide")]:
        joint = rows[int(np.argmax(np.abs(found.joints[rows])))]
        depths = [lowest_depth(stiffer(machine, int(joint), s * h * K[joint])).minimum_depth for s in (1, -1)]
        assert found.joints[joint] == pytest.approx((depths[0] - depths[1]) / (2 * h * found.depth), rel=1e-3)


def test_a_bundle_gathers_its_contacts_and_the_sentence_names_it() -> None:
    modes = natural_modes(lathe())
    groups = bundles(modes.machine.flexible)
    assert {"front", "z_guide", "x_screw", "mount_1.x"} <= set(groups)
    assert sum(len(rows) for rows in groups.values()) == len(modes.machine.flexible)
    said = leading(modes, mode_energies(modes), depth_sensitivity(modes))
    assert said[0].startswith("the mode at 414.6 Hz that limits the depth bends front (")
    assert "10 % more stiffness there gives" in said[0]
    without = leading(modes, mode_energies(modes), None)[0]
    assert "that the tool feels most" in without
    assert without.endswith("more frequency.")


def test_static_compliance_is_that_of_springs_in_series_and_none_where_the_tool_is_free() -> None:
    machine, _, _, K = chain(6, 5.0, 7)
    found = static_compliance(natural_modes(machine))["x"]
    assert found == pytest.approx(np.linalg.inv(K)[-1, -1], rel=1e-10)
    loose = Machine(machine.components, machine.connections[1:], tool=machine.tool)
    assert static_compliance(natural_modes(loose)) == {"x": None}


def test_static_compliance_of_a_state_space_is_that_of_the_same_part_in_motions() -> None:
    machine, _ = random_machine(5, ("state-space", "lumped"))
    found = static_compliance(natural_modes(machine))["x"]
    slow = machines.frozen_receptance(machine, [1e-2], 0.0).receptance[0, 0, 0].real
    assert found == pytest.approx(slow, rel=1e-5)


def on_a_base(stiffness: float) -> Machine:
    """Turning with a mass on a spring on a damped base, that takes up its vibration best at one stiffness."""
    parts = (Lumped("base", ("x",), np.eye(1) * 8.0), Lumped("tool", ("x",), np.eye(1)))
    rows = (
        Connection("base", ("base.x", "ground"), Joint((Linear(stiffness), Viscous(1500.0)))),
        Connection("holder", ("tool.x", "base.x"), Joint((Linear(4e6), Viscous(40.0)))),
    )
    return Machine(parts, rows, tool={"x": "tool.x"}, cutting={"process": "turning", "specific": 1e9})


@pytest.mark.thorough
def test_what_more_stiffness_gives_is_computed_again_and_not_carried_past_a_maximum() -> None:
    grid = np.geomspace(5e6, 5e7, 60)
    depths = [lowest_depth(on_a_base(k)).minimum_depth for k in grid]
    best = int(np.argmax(depths))
    assert 0 < best < len(grid) - 1
    K = grid[best] / 1.02
    modes = natural_modes(on_a_base(K))
    found = depth_sensitivity(modes)
    assert found is not None
    again = lowest_depth(on_a_base(1.1 * K)).minimum_depth
    assert found.stiffer(np.array([0]), 0.1) == pytest.approx(again, rel=1e-9)
    assert found.joints[0] > 0
    assert again < found.depth
    said = leading(modes, mode_energies(modes), found)
    (sentence,) = (one for one in said if "base" in one and "10 % more" in one)
    assert sentence.endswith(f"{100 * (1 - again / found.depth):.2g} % less depth.")
