"""State-space components: the same receptance in any basis, what they tell, and the check by python-control."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from jointlib.arrays import Array
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, linear_check, read_machine
from machines.components.state_space import StateSpace
from machines.coupling.state_equations import as_first_order, machine_states

OMEGA = 2 * np.pi * np.linspace(20, 3000, 60)


def modal(seed: int, modes: int = 4, ports: int = 3) -> Modal:
    rng = np.random.default_rng(seed)
    frequency, ratio = rng.uniform(100, 2000, modes), rng.uniform(0.005, 0.03, modes)
    return Modal("m", tuple(f"q{i}" for i in range(ports)), frequency, ratio, rng.normal(size=(ports, modes)))


def state_space(name: str, seed: int, compliance: float = 0.0) -> StateSpace:
    """The modal component in a random orthogonal basis of states of comparable size, with direct compliance."""
    part, rng = modal(seed), np.random.default_rng(seed + 100)
    first = as_first_order(part.second_order())
    n = len(first.A) // 2
    T = np.linalg.qr(rng.normal(size=(2 * n, 2 * n)))[0]
    root = rng.normal(size=(3, 3))
    A, B = np.linalg.solve(T, first.A @ T), np.linalg.solve(T, first.B)
    return StateSpace(name, part.dofs, A, B, first.C @ T, compliance * root @ root.T)


def joint(stiffness: float, damping: float) -> Joint:
    return Joint((Linear(stiffness), Viscous(damping)))


def machine(compliance: float, rigid: int) -> Machine:
    parts = (
        state_space("a", 1, compliance),
        state_space("b", 2, compliance),
        Lumped("l", ("x", "y"), 2 * np.eye(2), None, np.array([[3e7, -1e7], [-1e7, 2e7]])),
    )
    links = [
        Connection("c1", ("a.q0", "b.q0"), joint(1e7, 300.0)),
        Connection("c2", ("b.q1", "l.x"), joint(2e7, 100.0)),
        Connection("w1", ("a.q1", "l.y"), rigid=True),
        Connection("w2", ("a.q2", "b.q2"), rigid=True),
    ]
    return Machine(parts, tuple(links[: 2 + rigid]))


def test_receptance_does_not_depend_on_the_basis_of_the_states() -> None:
    want = modal(1).receptance(OMEGA)
    assert np.linalg.norm(state_space("a", 1).receptance(OMEGA) - want) < 1e-11 * np.linalg.norm(want)


def test_direct_compliance_is_added_at_every_frequency() -> None:
    bare, stiff = state_space("a", 1, 1e-9), state_space("a", 1)
    ports = np.array([[1.0, -1.0, 0.0]])
    assert bare.D is not None
    added = bare.receptance(OMEGA, ports) - stiff.receptance(OMEGA, ports)
    assert added[:, 0, 0] == pytest.approx((ports @ bare.D @ ports.T)[0, 0], rel=1e-6)


@pytest.mark.parametrize("compliance", [0.0, 1e-9])
@pytest.mark.parametrize("rigid", [0, 1, 2])
def test_python_control_agrees(compliance: float, rigid: int) -> None:
    """With damped joints and rigid connections, also where a displacement jumps with a force."""
    check = linear_check(machine(compliance, rigid))
    assert check.max_relative_difference < 1e-8
    assert check.passed


def test_state_equations_of_second_order_parts_have_their_natural_frequencies() -> None:
    parts = (Lumped("l", ("x", "y"), 2 * np.eye(2), None, np.array([[3e7, -1e7], [-1e7, 2e7]])),)
    whole = Machine(parts, (Connection("w", ("l.y", "ground"), rigid=True),))
    assert machine_states(whole).natural_frequencies(np.empty(0)) == pytest.approx([np.sqrt(1.5e7) / (2 * np.pi)])


def test_what_a_model_cannot_be_in_nature_is_told() -> None:
    good = state_space("a", 1)
    assert good.remarks() == ()
    told = " ".join(state_space("a", 1, 1e-9).remarks())
    assert "D is not zero" in told
    skew = StateSpace("a", good.dofs, good.A, good.B, good.C + 0.5 * np.roll(good.C, 1, axis=0))
    assert "not reciprocal at" in " ".join(skew.remarks())
    against = StateSpace("a", good.dofs, good.A, good.B, -good.C)
    assert "yields energy" in against.remarks()[0]


def test_free_body_is_stable_enough() -> None:
    """Two poles at zero: ẍ = f/m."""
    body = StateSpace("b", ("x",), np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [0.5]]), np.array([[1.0, 0.0]]))
    assert body.receptance(OMEGA)[:, 0, 0] == pytest.approx(-0.5 / OMEGA**2)


GOOD = """
schema = "jointlib/machine/1"
[[component]]
name = "table"
kind = "state-space"
dofs = ["x", "y"]
file = "table.npz"
[tool]
x = "table.x"
"""
ARRAYS = {
    "A": np.array([[0, 1, 0, 0], [-1e6, -20, 0, 0], [0, 0, 0, 1], [0, 0, -4e6, -40.0]]),
    "B": np.array([[0, 0, 0], [1, 0, 5], [0, 0, 0], [0, 1.0, 5]]),
    "C": np.array([[1.0, 0, 0, 0], [0, 0, 1, 0]]),
}


def write(folder: Path, text: str = GOOD, **changed: Array) -> Path:
    arrays = {**ARRAYS, "B": ARRAYS["B"][:, :2], **changed}
    np.savez(folder / "table.npz", **{k: v for k, v in arrays.items() if v is not None})
    savemat(folder / "table.mat", {**ARRAYS, "D": np.zeros((2, 3))})
    (folder / "m.toml").write_text(text)
    return folder / "m.toml"


@pytest.mark.parametrize("file", ["table.npz", "table.mat"])
def test_file_is_read(tmp_path: Path, file: str) -> None:
    text = GOOD.replace("table.npz", file)
    if file.endswith("mat"):
        text = text.replace("[tool]", "inputs = [1, 2]\n[tool]")
    found = read_machine(write(tmp_path, text))
    H = found.components[0].receptance(OMEGA)
    assert H[:, 1, 1] == pytest.approx(1 / (4e6 - OMEGA**2 + 40j * OMEGA), rel=1e-9)
    assert np.all(H[:, 0, 1] == 0)
    assert linear_check(found).passed


@pytest.mark.parametrize(
    ("old", "new", "changed", "words"),
    [
        ('file = "table.npz"', 'file = "lost.npz"', {}, "no such file"),
        ('file = "table.npz"', 'file = "m.xyz"', {}, r"expected .npz or .mat"),
        ('file = "table.npz"', "", {}, "'file' is missing"),
        ('"x", "y"', '"x"', {}, r"B has shape \(4, 2\), expected \(4, 1\) for 4 states and 1 dofs"),
        ("[tool]", "inputs = [1, 3]\n[tool]", {}, "whole numbers from 1 to 2"),
        ("", "", {"A": np.eye(4)}, "stable model"),
        ("", "", {"A": np.eye(3)}, r"B has shape"),
        ("", "", {"A": np.full((4, 4), np.nan)}, "finite"),
        ("", "", {"D": np.zeros((3, 2))}, r"D has shape \(3, 2\)"),
        ("", "", {"C": None}, "holds A, B, expected A, B, C and D"),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence(
    tmp_path: Path, old: str, new: str, changed: dict[str, Array], words: str
) -> None:
    path = write(tmp_path, GOOD.replace(old, new, 1) if old else GOOD, **changed)
    (tmp_path / "m.xyz").write_text("")
    with pytest.raises(InputError, match=words) as caught:
        read_machine(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
