"""Natural modes of coupled machines against hand-assembled eigenproblems, receptances and python-control."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eig, eigh
from test_machine_coupling import lumped, spring
from test_mixed_machines import random_machine

import machines
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.structural_damping import StructuralDamping
from jointlib.laws.viscous import Viscous
from machines import (
    Connection,
    Lumped,
    Machine,
    Measured,
    NaturalModes,
    Rigid,
    linear_check,
    natural_modes,
    read_machine,
)

LIBRARY = Path(machines.__file__).parent / "library"


def from_modes(found: NaturalModes, frequency: np.ndarray) -> np.ndarray:
    """Σ φ φᵀ/(2s (jω − s)) and conjugates over the tool, (nf, axes, axes)."""
    jw = 2j * np.pi * frequency[:, None]
    residue = found.tool.T[:, :, None] * found.tool.T[:, None, :] / (2 * found.pole)[:, None, None]
    pairs = [
        np.einsum("fr,rij->fij", 1 / (jw - p), R)
        for p, R in ((found.pole, residue), (found.pole.conj(), residue.conj()))
    ]
    return np.asarray(pairs[0] + pairs[1])


def chain(count: int, damping: float, seed: int) -> tuple[Machine, np.ndarray, np.ndarray, np.ndarray]:
    """Masses in a row, joined by springs with dampers; the first one to the ground. And M, C, K by hand."""
    rng = np.random.default_rng(seed)
    m, k = rng.uniform(1, 5, count), rng.uniform(1e6, 1e8, count)
    c = damping * rng.uniform(0.2, 2.0, count)
    K, C = np.zeros((2, count, count))
    links = []
    for i in range(count):
        row = np.zeros(count)
        row[i] = 1.0
        if i:
            row[i - 1] = -1.0
        K += k[i] * np.outer(row, row)
        C += c[i] * np.outer(row, row)
        joint = Joint((Linear(float(k[i])), Viscous(float(c[i]))))
        links.append(Connection(f"j{i}", (f"m{i}.x", f"m{i - 1}.x" if i else "ground"), joint))
    parts = tuple(lumped(f"m{i}", [[float(m[i])]]) for i in range(count))
    return Machine(parts, tuple(links), tool={"x": f"m{count - 1}.x"}), np.diag(m), C, K


def test_without_damping_they_are_the_symmetric_eigenproblem() -> None:
    machine, M, _, K = chain(12, 0.0, 1)
    squared, shapes = eigh(K, M)
    found = natural_modes(machine)
    assert found.frequency == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=1e-12)
    assert np.abs(found.damping_ratio).max() < 1e-13
    assert np.abs(found.shapes) == pytest.approx(np.abs(shapes), abs=1e-11)
    assert found.free.shape == (12, 0)


@pytest.mark.parametrize("damping", [50.0, 3e4])
def test_with_any_damping_they_are_the_poles_of_the_state_matrix(damping: float) -> None:
    """Weak damping, and so much that some motions no longer swing."""
    machine, M, C, K = chain(8, damping, 2)
    n, zero = 8, np.zeros((8, 8))
    poles = eig(np.block([[zero, np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]), right=False)
    up = np.sort_complex(poles[poles.imag > 1e-6])
    found = natural_modes(machine)
    assert np.sort_complex(found.pole) == pytest.approx(up, rel=1e-9)
    assert found.decay == pytest.approx(np.sort(poles[np.abs(poles.imag) < 1e-6].real), rel=1e-8)
    assert (len(found.decay) > 0) == (damping > 1e3)


def test_free_motions_are_counted_apart_braked_or_not() -> None:
    """Two masses that nothing holds share one free motion; a brake makes a decay of it and leaves it free."""
    joint = spring(1e7, 0.0)
    parts = lumped("a", [[2.0]]), lumped("b", [[3.0]])
    free = natural_modes(Machine(parts, (Connection("j", ("a.x", "b.x"), joint),)))
    assert free.frequency == pytest.approx([np.sqrt(1e7 * (1 / 2 + 1 / 3)) / (2 * np.pi)], rel=1e-12)
    assert len(free.decay) == 0
    assert free.free[:, 0] / free.free[0, 0] == pytest.approx([1.0, 1.0])
    brake = Connection("brake", ("a.x", "ground"), Joint((Viscous(50.0),)))
    braked = natural_modes(Machine(parts, (Connection("j", ("a.x", "b.x"), joint), brake)))
    assert braked.free.shape == (2, 1)
    assert braked.decay == pytest.approx([-50.0 / 5.0], rel=1e-4)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "kinds", [("beam", "rigid", "modal", "matrices"), ("beam", "state-space", "lumped"), ("state-space", "rigid")]
)
def test_their_sum_is_the_receptance_of_python_control(seed: int, kinds: tuple[str, ...]) -> None:
    """Rigid connections, beams, finite elements, state spaces: poles and shapes against a route that has neither."""
    machine, _ = random_machine(seed, kinds)
    found = natural_modes(machine)
    lines = np.geomspace(40.0, 2500.0, 25)
    check = linear_check(machine, None, lines)
    at = check.control.outputs.index(machine.tool["x"])
    expected = check.control.receptance[:, at, at]
    rest = expected - from_modes(found, lines)[:, 0, 0]
    # What is left are real poles and the inertia of free motions, of real weights that are not known here.
    jw = 2j * np.pi * lines
    columns = [1 / (jw - s) for s in found.decay] + [1 / jw**2] * bool(found.free.shape[1])
    if columns:
        basis = np.array([np.concatenate([c.real, c.imag]) / np.linalg.norm(c) for c in columns]).T
        both = np.concatenate([rest.real, rest.imag])
        rest = both - basis @ np.linalg.lstsq(basis, both)[0]
    assert np.abs(rest).max() < 1e-7 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["two_mass", "lathe", "three_joints"])
def test_their_slopes_are_those_of_finite_differences(name: str) -> None:
    machine = read_machine(LIBRARY / f"{name}.toml")
    found = natural_modes(machine)
    for joint in (0, len(machine.flexible) - 1):
        connection, step = machine.flexible[joint], 1e-5 * abs(found.gain[0, joint].real)
        moved = []
        for sign in (1, -1):
            assert connection.joint is not None
            stiffer = connection.joint + Linear(float(sign * step))
            moved.append(natural_modes(machine.with_joint(connection.name, stiffer)).pole[:10])
        by_difference = (moved[0] - moved[1]) / (2 * step)
        assert np.abs(found.slope[joint, :10] - by_difference).max() < 1e-6 * np.abs(by_difference).max()


def test_structural_damping_gives_half_its_loss_factor_at_the_frequency_of_the_mode() -> None:
    joint = Joint((Linear(4e7), StructuralDamping(4e5)))
    found = natural_modes(Machine((lumped("m", [[10.0]]),), (Connection("j", ("m.x", "ground"), joint),)))
    assert found.frequency == pytest.approx([np.sqrt(4e6) / (2 * np.pi)], rel=1e-9)
    assert found.damping_ratio == pytest.approx([0.005], rel=1e-9)


def test_at_an_amplitude_the_joint_has_the_gain_of_its_describing_function() -> None:
    """f = k·z − k3·z³ … at z = 3 µm: K and C of the linear check at that amplitude, one degree of freedom."""
    machine = read_machine(LIBRARY / "paper_sdof.toml")
    found, check = natural_modes(machine, 3e-6), linear_check(machine, 3e-6)
    assert found.stiffness[0] == pytest.approx(check.stiffness, rel=1e-9)
    assert found.frequency == pytest.approx([check.resonance], rel=1e-6)
    assert found.frequency[0] < 0.995 * natural_modes(machine).frequency[0]


def test_joints_at_the_limit_of_their_range_are_told() -> None:
    machine = read_machine(LIBRARY / "paper_sdof.toml")
    assert natural_modes(machine, 1e-3).limited.tolist() == [True]


def test_what_has_no_modes_is_refused_in_a_sentence() -> None:
    lines = np.linspace(10.0, 100.0, 20)
    part = Lumped("m", ("x",), np.array([[1.0]]), np.array([[3.0]]), np.array([[1e5]]))
    measured = Measured("m", ("x",), lines, part.receptance(2 * np.pi * lines))
    with pytest.raises(InputError, match="component 'm' is known by its receptance only"):
        natural_modes(Machine((measured,), tool={"x": "m.x"}))
    falling = Connection("j", ("m.x", "ground"), Joint((Linear(-2e5),)))
    with pytest.raises(InputError, match="does not stand by itself"):
        natural_modes(Machine((part, Rigid("b", 1.0, np.ones(3))), (falling,)))
    with pytest.raises(InputError, match="amplitude is -1"):
        natural_modes(Machine((part,)), -1.0)
    with pytest.raises(InputError, match="no tool point"):
        natural_modes(Machine((part,)), 1e-6)
