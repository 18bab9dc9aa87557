"""Receptance coupling against the equations of motion of the whole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from jointlib.arrays import Array, ArrayLike, ComplexArray
from jointlib.errors import InputError
from jointlib.joint import Joint
from jointlib.laws.linear import Linear
from jointlib.laws.viscous import Viscous
from machines import Connection, Lumped, Machine, Modal, couple, response
from machines.components.component import Component


def lumped(name: str, mass: ArrayLike, damping: ArrayLike | None = None, stiffness: ArrayLike | None = None) -> Lumped:
    """A lumped component whose dofs are x, or x and y."""
    matrices = [None if m is None else np.array(m, dtype=float) for m in (damping, stiffness)]
    own = np.array(mass, dtype=float)
    return Lumped(name, ("x", "y")[: len(own)], own, *matrices)


def spring(stiffness: float, damping: float) -> Joint:
    return Joint((Linear(stiffness), Viscous(damping)))


def random_machine(seed: int, parts: int, rigid: bool, free: bool) -> Machine:
    """Lumped and modal components in a chain of connections, the last one held by the ground unless free."""
    rng = np.random.default_rng(seed)
    components: list[Component] = []
    for i in range(parts):
        n = int(rng.integers(1, 4))
        dofs = tuple(f"q{k}" for k in range(n))
        if rng.random() < 0.5:
            root = rng.normal(size=(n, n))
            stiffness = 1e7 * (root @ root.T + 0.1 * np.eye(n)) if rng.random() < 0.7 else None
            damping = None if stiffness is None else 2e-5 * stiffness
            mass = np.diag(rng.uniform(0.5, 3.0, n))
            components.append(Lumped(f"part{i}", dofs, mass, damping, stiffness))
        else:
            modes = n + int(rng.integers(0, 3))
            shapes = rng.normal(size=(n, modes))
            frequency, ratio = rng.uniform(200, 2000, modes), rng.uniform(0.005, 0.05, modes)
            components.append(Modal(f"part{i}", dofs, frequency, ratio, shapes, rng.uniform(0.5, 3.0, modes)))
    connections = []
    for i in range(1, parts):
        for k in range(int(rng.integers(1, 3))):
            sides = [f"part{j}.{rng.choice(components[j].dofs)}" for j in (i - 1, i)]
            joint = spring(10 ** rng.uniform(6.5, 8.0), rng.uniform(50, 500))
            connections.append(Connection(f"c{i}{k}", (sides[0], sides[1]), joint))
    if not free:
        connections.append(Connection("foot", (f"part{parts - 1}.q0", "ground"), spring(5e7, 300.0)))
    if rigid:
        connections.append(Connection("weld", ("part0.q0", "part1.q0"), rigid=True))
    return Machine(tuple(components), tuple(connections))


def direct(machine: Machine, omega: Array) -> tuple[ComplexArray, float]:
    """Receptance between all dofs from M, C, K and Lagrange multipliers, and the first elastic resonance."""
    blocks = [c.second_order() for c in machine.components]
    sizes = [len(b.mass) for b in blocks if b is not None]
    n, dofs = sum(sizes), len(machine.dofs)
    M, C, K, shapes = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros((dofs, n))
    at = row = 0
    for b in blocks:
        assert b is not None
        s, r = slice(at, at + len(b.mass)), slice(row, row + len(b.shapes))
        M[s, s], C[s, s], K[s, s], shapes[r, s] = b.mass, b.damping, b.stiffness, b.shapes
        at, row = s.stop, r.stop
    held = []
    for connection in machine.connections:
        incidence = np.zeros(dofs)
        for side, sign in zip(connection.between, (1.0, -1.0), strict=True):
            if side != "ground":
                incidence[machine.dofs.index(side)] += sign
        line = incidence @ shapes
        if connection.joint is None:
            held.append(line)
            continue
        stiffness, damping = connection.joint.laws
        assert isinstance(stiffness, Linear)
        assert isinstance(damping, Viscous)
        K += stiffness.stiffness * np.outer(line, line)
        C += damping.damping * np.outer(line, line)
    R = np.array(held).reshape(len(held), n)
    out = np.empty((len(omega), dofs, dofs), dtype=complex)
    size = np.max(np.abs(K))
    for i, w in enumerate(omega):
        bordered = np.block([[K - w**2 * M + 1j * w * C, size * R.T], [size * R, np.zeros((len(R), len(R)))]])
        force = np.concatenate([shapes.T, np.zeros((len(R), dofs))])
        out[i] = shapes @ np.linalg.solve(bordered, force)[:n]
    _, _, V = np.linalg.svd(R) if len(R) else (None, None, np.eye(n))
    N = V[len(R) :].T
    squared = np.sort(np.linalg.eigvals(np.linalg.solve(N.T @ M @ N, N.T @ K @ N)).real)
    elastic = squared[squared > 1e-6 * squared[-1]]
    return out, float(np.sqrt(elastic[0]))


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 4), rigid=st.booleans(), free=st.booleans())
def test_linear_joints_equal_direct_assembly(seed: int, parts: int, rigid: bool, free: bool) -> None:
    machine = random_machine(seed, parts, rigid, free)
    _, first = direct(machine, np.empty(0))
    assume(first > 1.0)  # a single free body has no resonance
    lines = np.geomspace(0.1, 20.0, 60) * first / (2 * np.pi)
    drive = machine.dofs[int(seed % len(machine.dofs))]
    got = response(machine, force=3.0, frequency=lines, drive=drive, outputs=machine.dofs).frfs[0]
    want = direct(machine, 2 * np.pi * lines)[0][:, :, machine.dofs.index(drive)]
    difference = np.linalg.norm(got.receptance[:, :, 0] - want) / np.linalg.norm(want)
    assert difference < 1e-10


def test_receptance_of_coupled_machine_is_reciprocal() -> None:
    machine = random_machine(7, 4, True, False)
    lines = np.linspace(50.0, 2000.0, 40)
    a, b = machine.dofs[0], machine.dofs[-1]
    there = response(machine, 1.0, lines, drive=a, outputs=[b]).frfs[0].receptance
    back = response(machine, 1.0, lines, drive=b, outputs=[a]).frfs[0].receptance
    assert np.linalg.norm(there - back) < 1e-12 * np.linalg.norm(there)


def two_masses(omega: Array) -> ComplexArray:
    H = np.zeros((len(omega), 2, 2), dtype=complex)
    H[:, 0, 0] = -1 / (2.0 * omega**2)
    H[:, 1, 1] = 1 / (1e7 - 3.0 * omega**2 + 50j * omega)
    return H


def test_open_joint_leaves_the_parts_alone_to_the_last_bit() -> None:
    H = two_masses(np.linspace(100.0, 5000.0, 20))
    assert np.array_equal(couple(H, np.array([[1.0, -1.0]]), 0.0), H)


def test_rigid_joint_is_the_limit_of_a_stiff_one_and_makes_one_body() -> None:
    omega = np.linspace(100.0, 5000.0, 20)
    H, B = two_masses(omega), np.array([[1.0, -1.0]])
    locked = couple(H, B, np.inf)
    body = 1 / (1e7 - 5.0 * omega**2 + 50j * omega)
    assert np.max(np.abs(locked - body[:, None, None]) / np.abs(body)[:, None, None]) < 1e-12
    # The gap to the limit closes as the inverse of the stiffness.
    gap = [np.max(np.abs(couple(H, B, k) - locked)) for k in (1e13, 1e15)]
    assert gap[0] / gap[1] == pytest.approx(100, rel=1e-2)


def test_form_without_inverse_equals_the_published_one_where_both_exist() -> None:
    H, B, Z = two_masses(np.linspace(100.0, 5000.0, 20)), np.array([[1.0, -1.0]]), 3e8 + 1e6j
    Hzz = B @ H @ B.T
    published = H - H @ B.T @ np.linalg.inv(Hzz + 1 / Z) @ B @ H
    assert np.linalg.norm(couple(H, B, Z) - published) < 1e-13 * np.linalg.norm(published)


def test_splitting_a_spring_over_two_connections_changes_nothing() -> None:
    parts = (lumped("a", [[2.0]]), lumped("b", [[3.0]], [[50.0]], [[1e7]]))
    one = Machine(parts, (Connection("j", ("a.x", "b.x"), spring(4e7, 80.0)),), drive="a.x")
    two = Machine(
        parts,
        tuple(Connection(n, ("a.x", "b.x"), spring(2e7, 40.0)) for n in ("left", "right")),
        drive="a.x",
    )
    lines = np.linspace(50, 2000, 50)
    a, b = (response(m, 1.0, lines).frfs[0].receptance for m in (one, two))
    assert np.linalg.norm(a - b) < 1e-13 * np.linalg.norm(a)


def test_rigid_connection_that_modes_cannot_follow_is_refused() -> None:
    stiff = Modal("m", ("a", "b"), np.array([500.0]), np.array([0.02]), np.array([[1.0], [0.0]]))
    other = lumped("l", [[1.0]])
    machine = Machine(
        (stiff, other),
        (Connection("w1", ("m.b", "ground"), rigid=True),),
        drive="l.x",
    )
    with pytest.raises(InputError, match=r"w1.*cannot make"):
        response(machine, 1.0, [100.0, 200.0, 300.0])
