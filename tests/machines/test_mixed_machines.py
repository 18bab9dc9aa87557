"""Machines that mix every kind of component: receptance coupling against the equations of the whole."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag, lu_factor, lu_solve
from scipy.sparse import csc_matrix
from test_machine_coupling import spring
from test_matrices import lattice

from jointlib.arrays import Array, ComplexArray
from machines import Connection, Lumped, Machine, Modal, Rigid, frozen_receptance, linear_check
from machines.components.beam import Beam, Segment
from machines.components.component import Component, SecondOrder
from machines.components.matrices import Matrices
from machines.components.measured import Measured
from machines.components.nodes import Nodes
from machines.components.state_space import StateSpace
from machines.coupling.state_equations import as_first_order
from machines.shapes.profile import Material

STEEL = Material("steel", 210e9, 0.3, 7800.0, loss_factor=0.01)
LINES = np.geomspace(30.0, 3000.0, 60)


def random_part(kind: str, name: str, rng: np.random.Generator) -> tuple[Component, SecondOrder]:
    """A component of that kind and the equations of motion that it stands for."""
    if kind == "beam":
        sizes = rng.uniform(0.02, 0.06, 2)
        segments = tuple(Segment(float(rng.uniform(0.1, 0.3)), STEEL, diameter=float(d)) for d in sizes)
        length = sum(s.length for s in segments)
        stations = {"p": 0.0, "q": length}
        beam = Beam(name, segments, stations, rng.normal(size=3), rng.normal(size=3), up_to=4e3)
        return beam, beam.second_order()
    if kind == "matrices":
        M, K, _ = lattice(4, 3, 2, grounded=False)
        rows = (0, 1, 2, 69, 70, 71)
        dofs = tuple(f"{node}.{axis}" for node in "pq" for axis in "xyz")
        nodes = Nodes(("p", "q"), rng.normal(size=(2, 3)))
        part = Matrices(name, dofs, rows, M, K, stiffness_damping=2e-6, nodes=nodes)
        M_full, K_full = M.toarray(), K.toarray()
        return part, SecondOrder(M_full, 2e-6 * K_full, K_full, np.eye(len(M_full))[list(rows)])
    if kind == "rigid":
        body = Rigid(name, float(rng.uniform(5, 20)), rng.uniform(0.1, 0.3, 3), rng.normal(size=3))
        return body, body.second_order()
    if kind == "lumped":
        root = rng.normal(size=(3, 3))
        stiffness = 1e7 * (root @ root.T + 0.1 * np.eye(3))
        lump = Lumped(name, ("a", "b", "c"), np.diag(rng.uniform(0.5, 3.0, 3)), 2e-5 * stiffness, stiffness)
        return lump, lump.second_order()
    frequency, ratio = rng.uniform(200, 2000, 5), rng.uniform(0.005, 0.05, 5)
    modal = Modal(name, ("a", "b", "c"), frequency, ratio, rng.normal(size=(3, 5)), rng.uniform(0.5, 3.0, 5))
    second = modal.second_order()
    if kind == "state-space":
        first = as_first_order(second)
        T = np.linalg.qr(rng.normal(size=(10, 10)))[0]
        return StateSpace(
            name, modal.dofs, np.linalg.solve(T, first.A @ T), np.linalg.solve(T, first.B), first.C @ T
        ), second
    if kind == "frf":
        return Measured(name, modal.dofs, LINES, modal.receptance(2 * np.pi * LINES)), second
    return modal, second


def random_machine(seed: int, kinds: tuple[str, ...]) -> tuple[Machine, list[SecondOrder]]:
    """A chain of parts in random order; where both sides have a shape in space they are joined at points of it."""
    rng = np.random.default_rng(seed)
    made = [random_part(kind, f"part{i}", rng) for i, kind in enumerate(rng.permutation(np.array(kinds)))]
    parts, links = [part for part, _ in made], []

    def side(part: Component) -> str:
        return f"{part.name}.{rng.choice(part.dofs)}"

    for i in range(1, len(parts)):
        for k in range(3):
            joint = spring(10 ** rng.uniform(6.5, 8.0), rng.uniform(50, 500))
            links.append(Connection(f"c{i}{k}", (side(parts[i - 1]), side(parts[i])), joint))
        links.append(Connection(f"w{i}", (side(parts[i - 1]), side(parts[i])), rigid=True))
    for i, part in enumerate(parts):
        nodes = getattr(part, "nodes", None)
        if nodes is not None:
            at, direction = (tuple(float(v) for v in w) for w in (nodes.positions[1], rng.normal(size=3)))
            link = Connection(f"g{i}", (part.name, "ground"), spring(3e7, 200.0), at=at, direction=direction)  # type: ignore[arg-type]
            links.append(link)
    links.append(Connection("foot", (side(parts[-1]), "ground"), spring(5e7, 300.0)))
    return Machine(tuple(parts), tuple(links), tool={"x": parts[0].name + "." + parts[0].dofs[0]}), [e for _, e in made]


def direct(machine: Machine, equations: list[SecondOrder], lines: Array) -> ComplexArray:
    """Receptance between all dofs and the tool from the assembled M, C, K, with multipliers on rigid connections."""
    keys = ("mass", "damping", "stiffness", "shapes")
    M, C, K, shapes = (block_diag(*(getattr(e, key) for e in equations)).astype(np.longdouble) for key in keys)
    for connection in machine.flexible:
        row = machine.rows([connection]) @ shapes
        assert connection.joint is not None
        values = connection.joint.parameters
        K += values["linear.stiffness"] * row.T @ row
        C += values["viscous.damping"] * row.T @ row
    R = machine.rows([c for c in machine.connections if c.rigid]) @ shapes
    force = shapes.T @ machine.dof_rows([machine.tool["x"]], "test")[0]
    out = []
    for w in 2 * np.pi * lines:
        Z = K - w**2 * M + 1j * w * C
        even = 1 / np.sqrt(np.diag(K) + w**2 * np.diag(M))  # slow and fast coordinates alike
        rows = R * even / np.sqrt(np.sum((R * even) ** 2, axis=1, keepdims=True))
        system = np.block([[even[:, None] * Z * even, rows.T], [rows, np.zeros((len(R), len(R)))]])
        right = np.concatenate([even * force, np.zeros(len(R))]).astype(np.clongdouble)
        rough, found = lu_factor(system.astype(complex)), np.zeros_like(right)
        for _ in range(4):  # residuals in extended precision
            found = found + lu_solve(rough, (right - system @ found).astype(complex))
        out.append((shapes @ (even * found[: len(Z)])).astype(complex))
    return np.array(out)


ALL = ("beam", "matrices", "rigid", "lumped", "modal", "state-space", "frf")


@pytest.mark.parametrize("seed", range(12))
def test_coupling_equals_direct_assembly(seed: int) -> None:
    """Kinds in random order and number, points in space and rigid connections among them."""
    rng = np.random.default_rng(1000 + seed)
    kinds = tuple(rng.choice(np.array(ALL), size=int(rng.integers(3, 6)))) if seed else ALL
    machine, equations = random_machine(seed, kinds)
    got = frozen_receptance(machine, LINES, 0.0, outputs=machine.dofs).receptance[:, :, 0]
    want = direct(machine, equations, LINES)
    assert np.linalg.norm(got - want) / np.linalg.norm(want) < 1e-10


@pytest.mark.parametrize("seed", range(6))
def test_python_control_agrees_for_every_kind_with_equations(seed: int) -> None:
    rng = np.random.default_rng(2000 + seed)
    pool = np.array(ALL[:-1])
    kinds = tuple(rng.choice(pool, size=4)) if seed else ALL[:-1]
    machine, _ = random_machine(seed, kinds)
    assert linear_check(machine, frequency=LINES).max_relative_difference < 1e-8


@pytest.mark.slow
def test_reduced_matrices_are_coupled_within_the_error_that_they_tell() -> None:
    M, K, _ = lattice(8, 5, 4)
    rows = (0, 1, 2, 477, 478, 479)
    dofs = tuple(f"{node}.{axis}" for node in "pq" for axis in "xyz")
    bed = Matrices("bed", dofs, rows, csc_matrix(M), csc_matrix(K), stiffness_damping=2e-6, up_to=3000.0)
    slide = Rigid("slide", 8.0, np.array([0.05, 0.06, 0.07]))
    links = tuple(Connection(f"c{a}", (f"bed.q.{a}", f"slide.u{a}"), spring(5e7, 300.0)) for a in "xyz")
    machine = Machine((bed, slide), links, tool={"x": "slide.ux"})
    full = SecondOrder(M.toarray(), 2e-6 * K.toarray(), K.toarray(), np.eye(480)[list(rows)])
    want = direct(machine, [full, slide.second_order()], LINES[::6])
    got = frozen_receptance(machine, LINES[::6], 0.0, outputs=machine.dofs).receptance[:, :, 0]
    assert np.linalg.norm(got - want) / np.linalg.norm(want) < 1e-5
